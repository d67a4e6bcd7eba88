"""The Fuse screen with real races and no browser: what Reset takes back, and what an address sets."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
import viser

from app.screens.fuse.labels import RACE_NAMES, RESULT
from app.screens.fuse.panel import FusePanel
from app.screens.fuse.place import race_text
from app.screens.fuse.race_job import contest_of
from app.screens.fuse.rooms import ROOMS
from app.screens.fuse.setup import RaceSetup
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


class Requests(Bench):
    """Keeps the races that the screen requests for a scene, and runs none."""

    def __init__(self, ui, nodes):
        super().__init__(FusePanel, ui, None, steps=())
        self.races = []
        names = [SimpleNamespace(name=f"node_{index:02d}") for index in range(nodes)]
        views = {"scene": SimpleNamespace(nodes=names, has_walk=False), "depth": SimpleNamespace(nodes=names)}
        for step, view in views.items():
            self.results.put(step, self.spec.key(step), view)
            self.panel.on_view(step, view)
        self.results.put("fuse", self.spec.key("fuse"), None)
        self.panel.on_show()

    def side_job(self, job, race, on_end):
        self.races.append(race)

    @property
    def pair(self):
        """Mode, source and target of the race that was requested last."""
        race = self.races[-1]
        return race.mode, race.source, race.target


@pytest.fixture(scope="module")
def requests():
    """A screen with a scene of this many nodes."""
    server = viser.ViserServer(port=0, verbose=False)
    yield lambda nodes: Requests(ui_of(server.scene), nodes)
    server.stop()


@pytest.mark.parametrize("mode", ROOMS)
def test_a_room_is_raced_without_the_degradation_of_the_race_before(requests, mode):
    bench = requests(2)
    bench.gui.set("Noise (cm)", 1.0)
    assert bench.races[-1].noise_m == 0.01
    bench.gui.set("Show", RACE_NAMES[mode])
    contest = contest_of(None, (), bench.races[-1])
    assert contest.source is ROOMS[mode]().source
    noise = bench.gui.find("Noise (cm)")
    assert (noise.value, noise.disabled) == (0.0, True)
    assert "scan cannot be degraded" in bench.gui.text()
    bench.gui.set("Show", RACE_NAMES["nodes"])
    assert not noise.disabled
    assert "scan cannot be degraded" not in bench.gui.text()


@pytest.mark.parametrize(
    ("text", "pair"),
    [
        ("source=2 target=1", ("nodes", 2, 1)),
        ("source=5 target=1", ("nodes", 1, 0)),
        ("target=99", ("nodes", 1, 0)),
        ("mode=inferred source=2", ("inferred", 2, 0)),
    ],
)
def test_an_address_with_a_node_that_is_not_there_races_the_first_pair(requests, text, pair):
    bench = requests(3)
    bench.panel.in_address["race"].take(f"{text} seed=3")
    assert bench.pair == pair


def test_the_nodes_of_an_address_wait_for_its_scene():
    setup = RaceSetup(ui_of(), lambda: None)
    setup.add_methods("1234")
    setup.add_preset()
    setup.add_nodes()
    setup.add_numbers()
    setup.add_degradations()
    for names, nodes in (("abc", (2, 1)), ("ab", (1, 0)), ("a", (0, 0))):
        setup.choose(Race(source=2, target=1))
        assert (setup.race.source, setup.race.target) == (2, 1)
        setup.choose_nodes(names)
        assert (setup.race.source, setup.race.target) == nodes


@pytest.mark.parametrize(
    ("label", "shown", "text"),
    [
        ("Noise (cm)", 7.0, "noise_m=0.07"),
        ("Noise (cm)", 0.7, "noise_m=0.007"),
        ("Holes (%)", 29.0, "hole_share=0.29"),
    ],
)
def test_a_slider_and_its_address_have_no_more_digits_than_were_set(requests, label, shown, text):
    bench = requests(2)
    bench.gui.set(label, shown)
    bench.gui.set("Seed", 3)
    assert text in race_text(bench.races[-1]).split()
    bench.panel.in_address["race"].take(race_text(bench.races[-1]))
    assert bench.gui.find(label).value == shown
    bench.gui.set("Seed", 4)
    assert text in race_text(bench.races[-1]).split()


@pytest.mark.parametrize("text", ["", "seed=3", "mode=nodes", "source=1 noise_m=0.01"])
def test_with_one_node_an_address_races_its_inferred_cloud(requests, text):
    bench = requests(1)
    bench.panel.in_address["race"].take("seed=5")
    bench.panel.in_address["race"].take(text)
    assert bench.pair == ("inferred", 0, 0)


def test_with_one_node_the_race_behind_the_result_is_possible_too(requests):
    bench = requests(1)
    bench.gui.set("Show", RESULT)
    bench.panel.in_address["race"].take("seed=4")
    assert bench.pair == ("inferred", 0, 0)
