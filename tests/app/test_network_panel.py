"""The whole Network screen with real runs and no browser: what is drawn, what settings do, what fails."""

import re
import shlex
from dataclasses import replace

import numpy as np
import pytest
import viser

from app.screens.network.draw import ground_of
from app.screens.network.labels import NETWORKS
from app.screens.network.panel import ORIGIN, NetworkPanel
from app.screens.network.view import What
from network_sim.config import PRESETS
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from tests.app.fakes import Bench, Impatient, ui_of

pytestmark = pytest.mark.xdist_group("network panel")


class Screen(Bench):
    """The screen; keeps the runs that it was answered, and does not wait for a hand to rest."""

    def __init__(self, scene, store):
        super().__init__(NetworkPanel, ui_of(scene, kind=Impatient), store, steps=("network",))
        self.use("nodes.image_bytes=3000")
        self.panel.on_show()

    @property
    def views(self):
        """The runs that are there, if they are those that are asked for."""
        there = self.results.fresh("network", self.spec)
        return self.results.view("network") if there else ()

    def retry(self):
        """Press *Retry*."""
        self.results.retry_failed()
        self.advance()

    def use(self, text):
        """Write free settings and have them simulated."""
        self.gui.set("Setting key=value", text)
        self.gui.press("Use these settings")

    def handle(self, name):
        """What is drawn of the newest runs by a name."""
        (found,) = (node for node in self.ui.scene.names("/network/runs") if node.endswith(f"/{name}"))
        return self.drawn(found)

    @property
    def packets(self):
        """Places of the packets and losses that are drawn now."""
        points = self.handle("packets").points
        return points[points[:, 2] > -50.0]

    @property
    def now_ns(self):
        """Simulated time that the player shows."""
        return round(1e9 * self.gui.find("Time (s)").value)

    @property
    def pages(self):
        """The pictures of the timelines."""
        return re.findall('<img alt="timeline"[^>]*src="([^"]*)"', self.gui.text())

    @property
    def span_s(self):
        """Length of the timelines' window."""
        return 10.0 ** self.gui.find_starting("Span").value


@pytest.fixture(scope="module")
def screen(store):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    screen = Screen(server.scene, store)
    yield screen
    screen.ui.close()
    server.stop()


def test_the_first_visit_simulates_and_shows_nodes_numbers_and_timeline(screen):
    (view,) = screen.views
    assert view.config.nodes.image_bytes == 3000
    assert len(screen.handle("0/node").points) == 3
    assert len(screen.handle("0/sink").points) == 1
    assert "simulated in" in screen.gui.text()
    assert "Image delivery ratio" in screen.gui.text()
    assert len(screen.pages) == 1
    assert screen.client.camera.position[2] > 3.0
    np.testing.assert_array_equal(screen.client.camera.look_at, np.zeros(3))


def test_nodes_and_ranges_are_drawn_to_one_scale(screen):
    (view,) = screen.views
    scale = ground_of(screen.views).scale
    nodes, sink = screen.handle("0/node").points, screen.handle("0/sink").points[0]
    reach = np.linalg.norm(nodes[:, :2] - sink[:2], axis=1)
    np.testing.assert_allclose(reach, scale * view.config.nodes.spacing_m, rtol=1e-5)
    rim = screen.handle("0/range-sink").points.reshape(-1, 3)
    np.testing.assert_allclose(
        np.linalg.norm(rim[:, :2] - sink[:2], axis=1), scale * view.config.radio.range_m, rtol=1e-5
    )


def test_stepping_goes_from_event_to_event_and_packets_move(screen):
    (view,), gui = screen.views, screen.gui
    starts_ns = 1000 * np.unique(-(-view.pieces.start_ns // 1000))  # the player counts microseconds
    later_ns = starts_ns[starts_ns > view.start_ns]
    gui.set("Time (s)", view.start_ns / 1e9)
    for expected_ns in later_ns[:20]:
        gui.press("Player", "Next event")
        assert screen.now_ns == expected_ns
    gui.press("Player", "Event back")
    assert screen.now_ns == later_ns[18]
    frame = int(np.flatnonzero(view.pieces.what == What.AIR)[5])
    gui.set(gui.find_starting("Speed").label, -3.0)
    places = []
    for share in (0.25, 0.75):
        span_ns = view.pieces.end_ns[frame] - view.pieces.start_ns[frame]
        gui.set("Time (s)", (view.pieces.start_ns[frame] + share * span_ns) / 1e9)
        assert 1 <= len(screen.packets) < 10
        places.append(screen.packets)
    assert not np.array_equal(*places)
    assert "packetmesh-now" in gui.text()


def test_the_window_zooms_about_the_player_and_turns_pages(screen):
    (view,), gui = screen.views, screen.gui
    whole_s = screen.span_s
    gui.set("Time (s)", (view.start_ns + view.end_ns) / 2e9)
    gui.press("Timeline", "Frames")
    assert screen.span_s < whole_s / 4
    frames_ns = view.pieces.start_ns[view.pieces.what == What.AIR]
    assert 0 <= screen.now_ns - frames_ns[frames_ns <= screen.now_ns].max() < 1000
    page, span_s = screen.pages, screen.span_s
    gui.set("Time (s)", screen.now_ns / 1e9 + 0.2 * span_s)
    assert screen.pages == page
    gui.set("Time (s)", screen.now_ns / 1e9 + span_s)
    assert screen.pages != page
    assert screen.span_s == span_s
    gui.press("Timeline", "All")
    assert screen.span_s == pytest.approx(whole_s, rel=0.15)  # the slider has steps
    gui.set("Time (s)", view.end_ns / 1e9)
    gui.press("Timeline", "Frames")
    assert screen.span_s < whole_s / 3
    assert "packetmesh-now" in gui.text()


def test_a_second_run_gets_a_column_rows_and_a_place_beside(screen):
    gui = screen.gui
    gui.set("Beside", "a link of its own for each")
    one, two = screen.views
    assert (one.config.mac.kind, two.config.mac.kind) == ("ieee802154", "ideal")
    assert ">a link of its own for each</th>" in gui.text()
    assert len(screen.pages) == 2
    west, east = (screen.handle(f"{index}/sink").points[0][0] for index in (0, 1))
    assert east - west > ground_of(screen.views).width
    lines = screen.panel.command.splitlines()
    assert len(lines) == 2
    for line, view in zip(lines, screen.views, strict=True):
        words = shlex.split(line)
        assert words[:4] == ["packetmesh", "simulate", "--preset", "thesis-link"]
        assert with_settings(PRESETS[words[3]], words[5:]) == view.config
    gui.set("Beside", "nothing")
    assert len(screen.views) == 1


def test_a_wrong_key_names_the_nearest_and_keeps_what_was(screen):
    before = screen.panel.command
    with pytest.raises(InputError, match=r"try radio\.shadowing_db"):
        screen.use("radio.shadow_db=3")
    assert screen.panel.command == before
    with pytest.raises(InputError, match=r"run\.horizon_s"):
        screen.use("run.horizon_s=0")
    assert screen.panel.command == before


@pytest.mark.parametrize("seed", [7, 8])
@pytest.mark.parametrize("sentence", ["There is no memory left.", "Cancelled."])
def test_a_failed_or_cancelled_run_says_why_and_retry_runs_it(screen, seed, sentence):
    screen.refuse = sentence
    screen.gui.set("Seed", seed)
    assert sentence in screen.gui.text()
    assert screen.ui.scene.names("/network/runs") == []
    screen.refuse = ""
    screen.retry()
    assert screen.views[0].config.run.seed == seed
    assert "simulated in" in screen.gui.text()
    screen.gui.set("Seed", 0)


def test_vehicles_move_and_the_origin_of_the_schemes_is_named(screen):
    gui, screen.refuse = screen.gui, "not yet"
    gui.set("Preset", NETWORKS["street-grid"].title)
    gui.set("Vehicles", 5)
    screen.refuse = ""
    screen.use("run.horizon_s=660")
    assert ORIGIN in gui.text()
    assert gui.find("Scheme").seen
    (view,) = screen.views
    assert view.start_ns == 600_000_000_000
    start = screen.handle("0/vehicle").points.copy()
    gui.set("Time (s)", 610.0)
    moved = np.linalg.norm(screen.handle("0/vehicle").points - start, axis=1)
    assert moved.max() <= 1.001 * 100.0 * ground_of(screen.views).scale
    assert moved.min() > 0.0
    screen.want(replace(screen.spec, networks=()))  # as *Reset* does
    assert gui.find("Preset").value == NETWORKS["thesis-link"].title
