"""Export offers what the screens have, and nothing else; its commands are those of what is there."""

from __future__ import annotations

import threading
from types import SimpleNamespace

from app.screens.export.panel import ExportPanel
from app.screens.fuse.export import race_offers
from app.screens.fuse.view import Race
from app.screens.network.export import network_offers
from app.screens.surface.export import surface_offers
from app.screens.surface.labels import AFTER
from tests.app.fakes import Bench, ui_of


class Screens(Bench):
    """A session whose other screens have something to take along."""

    others = ()

    def offers(self):
        return (*self.panel.offers(), *self.others)


def test_rows_of_buttons_come_with_what_is_there(server, store):
    bench = Screens(ExportPanel, ui_of(server.scene), store)
    shown = {one.label for one in bench.gui.all("button_group")}
    assert shown == {"Surface", "Clouds", "Numbers"}
    assert "packetmesh reconstruct" in bench.gui.text()
    bench.others = (race_offers(Race()), network_offers(("a",), "packetmesh simulate --preset street-grid"))
    bench.panel.on_show()
    shown = {one.label for one in bench.gui.all("button_group")}
    assert shown == {"Surface", "Clouds", "Numbers", "Race", "Network"}
    assert bench.gui.find("Race").options == ("Page", "GIF")
    assert "No command runs a race" in bench.gui.text()
    assert "simulate --preset street-grid --out runs/network-1" in bench.gui.text()
    bench.others = ()
    bench.panel.on_show()
    assert "No command runs a race" not in bench.gui.text()


def test_a_file_goes_to_who_asked_for_it(server, store):
    bench, sent = Screens(ExportPanel, ui_of(server.scene), store), []
    client = SimpleNamespace(send_file_download=lambda name, content, **_: sent.append((name, content)))
    bench.panel._clicked("Numbers", "Config", client)
    ((name, content),) = sent
    assert name == "config.json"
    assert b"box-on-table" in content
    bench.panel._clicked("Numbers", "no such label", client)
    assert len(sent) == 1


def test_no_other_control_waits_while_a_browser_draws_a_picture(server, store):
    """Controls are handled one after the other: in a lecture all would wait for one hidden tab."""
    bench, drawn = Screens(ExportPanel, ui_of(server.scene), store), threading.Event()

    def get_render(*_, **__):
        assert drawn.wait(20.0)
        raise TimeoutError

    camera = SimpleNamespace(image_height=400, image_width=600)
    client = SimpleNamespace(camera=camera, get_render=get_render)
    bench.others = (surface_offers(AFTER, "photographs", True),)
    bench.panel.on_show()
    before = set(threading.enumerate())
    bench.panel._clicked("To show", "This view, PNG", client)
    (drawing,) = set(threading.enumerate()) - before
    drawn.set()
    drawing.join()
