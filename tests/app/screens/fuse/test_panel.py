"""The Fuse screen with real races and no browser: what Reset takes back."""

from __future__ import annotations

import pytest
import viser

from app.screens.fuse.panel import FusePanel
from app.screens.fuse.view import Race, Start
from tests.app.fakes import Bench, ui_of

STEPS = ("scene", "depth", "fuse")


@pytest.fixture(scope="module")
def fuse(store):
    server = viser.ViserServer(port=0, verbose=False)
    bench = Bench(FusePanel, ui_of(server.scene), store, steps=STEPS)
    bench.advance()
    bench.panel.on_show()
    yield bench
    server.stop()


def test_reset_takes_the_race_back_to_that_of_the_start(fuse):
    gui, panel = fuse.gui, fuse.panel
    before, clock_ns = panel._arrived, panel._player.clock.end_ns
    gui.press("Compare", "All four")
    gui.set("Start", "far off (20°, 40 cm)")
    gui.set("Move", "node_02")
    gui.set("Noise (cm)", 2.0)
    gui.set("Axis", "milliseconds")
    panel._player.seek_at(None)
    assert panel._arrived != before
    panel.on_action("Reset")
    assert panel._arrived == before
    assert panel._setup.race == Race(start=Start.towards(3.0, 6.0, seed=0))
    assert gui.find("Axis").value == "iterations"
    assert (panel._player.now_ns, panel._player.clock.end_ns) == (0, clock_ns)


def test_reset_leaves_a_race_that_was_not_changed_at_its_start(fuse):
    view = fuse.panel._view
    fuse.panel._player.seek_at(None)
    fuse.panel.on_action("Reset")
    assert fuse.panel._view is view
    assert fuse.panel._player.now_ns == 0
