"""The Network screen with a real delivery and no browser: what is drawn, what settings do, what fails."""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import viser

from app.compute.state import Results, Spec
from app.dock.dock import time_text
from app.drawing.colors import COVERAGE_STOPS, linear
from app.lesson.reading import read_lesson
from app.looking.look import Look, text_of
from app.screens.network import setup
from app.screens.network.delivery_numbers import legend, moment_table
from app.screens.network.delivery_view import DeliveryView, PacketView
from app.screens.network.draw import STREET, ground_of
from app.screens.network.inspector import Inspector
from app.screens.network.labels import ANSWER, CODINGS, NETWORKS, ORIGIN, PICK
from app.screens.network.lanes import lanes_of
from app.screens.network.lesson import CROSSING, KIND, LOST_PACKET, PLACING, NetworkLook, numbers
from app.screens.network.packets import Frames
from app.screens.network.panel import NetworkPanel
from app.screens.network.setup import NetworkSetup
from app.screens.network.state_colors import EMPTY, FULL
from app.screens.network.view import What
from app.screens.network.what_if import WhatIf
from network_sim.presets import PRESETS
from network_sim.types import Cause, PacketKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from pipeline.io.rigs import save_rig
from pipeline.sources import RigFolder
from tests.app.fakes import Bench, Impatient, ui_of
from tests.pipeline.delivery.small import CONFIG, small_rig

CROSSING_FOLDER = "Lesson: How images cross a sensor network"
pytestmark = pytest.mark.xdist_group("network panel")


class Screen(Bench):
    """The screen with its clock; does not wait for a hand to rest."""

    def __init__(self, scene, store, spec):
        super().__init__(NetworkPanel, ui_of(scene, kind=Impatient), store, steps=("network",), spec=spec)
        assert self.gui.find("Moments").value == 4
        self.panel.on_show()

    @property
    def view(self) -> DeliveryView:
        """The delivery that is there, which is the one that is asked for."""
        assert self.results.fresh("network", self.spec)
        return self.results.view("network")

    @property
    def dock(self):
        return self.panel._dock

    @property
    def lanes(self):
        return lanes_of(self.panel._delivery, self.panel._runs, self.panel._frames)

    def names(self):
        """What is drawn of the newest delivery, by the last part of its name."""
        return [name.split("/")[-1] for name in self.ui.scene.names("/network/runs")]

    def handle(self, name):
        (found,) = (one for one in self.ui.scene.names("/network/runs") if one.endswith(f"/{name}"))
        return self.drawn(found)

    @property
    def packets(self):
        """Places of the packets and losses that are drawn now."""
        points = self.handle("packets").points
        return points[points[:, 2] > -50.0]

    def clouds(self):
        """Which nodes have a cloud."""
        return {name.rsplit("-", 1)[0] for name in self.names() if name.startswith("cloud-")}

    def drag(self, arrows, by_m):
        """Drag arrows and let them go."""
        arrows.position = np.array(arrows.position) + by_m
        for ended in arrows._impl_aux.update_cb:
            ended(SimpleNamespace(phase="end"))

    def use(self, text):
        self.gui.set("Setting key=value", text)
        self.gui.press("Use these settings")


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    """A room whose images are small, so that a moment is soon rebuilt."""
    folder = tmp_path_factory.mktemp("rigs") / "small room"
    save_rig(folder, small_rig(nodes=3))
    return Spec(RigFolder(str(folder)), config=CONFIG)


@pytest.fixture(scope="module")
def screen(store, spec):
    """The screen, which asks for few moments wherever it asks of itself: of a lesson's stop, too."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with pytest.MonkeyPatch.context() as few:
        few.setattr(setup, "MOMENTS", 4)
        screen = Screen(server.scene, store, spec)
        yield screen
        screen.ui.close()
    server.stop()


def test_the_first_visit_sends_the_room(screen):
    view = screen.view
    assert len(view.moments) == len(view.times_ns) == 4
    assert [node.name for node in view.nodes] == ["node_00", "node_01", "node_02"]
    assert view.moments[-1].delivered_bytes == view.total_bytes
    assert {"node_00", "node_01", "node_02", "sink", "cloud", "client", "routes"} <= set(screen.names())
    assert "3 nodes sent" in screen.gui.text()
    assert "Rays without a surface" in screen.gui.text()


def test_of_a_recording_it_is_said_that_its_camera_is_one_node(screen):
    assert "The cameras of the room send" in screen.gui.text()
    screen.panel._take_delivery(replace(screen.view, walk="one walking camera sends its keyframes"))
    assert "It is **one node** with one radio" in screen.gui.text()
    assert "One node sent" in screen.gui.text()
    screen.panel._take_delivery(screen.view)
    assert "The cameras of the room send" in screen.gui.text()


def test_scrubbing_shows_the_moment_before_and_nothing_before_the_first(screen):
    view = screen.view
    screen.dock.seek(view.moments[0].t_ns - 1)
    assert screen.clouds() == set()
    for moment in (view.moments[3], view.moments[0], view.moments[2]):
        screen.dock.seek(moment.t_ns + 1)
        assert screen.clouds() == {f"cloud-{node.name}" for node in view.nodes}
        for node, now in zip(view.nodes, moment.nodes, strict=True):
            (cloud,) = (name for name in screen.names() if name.startswith(f"cloud-{node.name}-"))
            assert len(screen.handle(cloud).points) == len(now.points_m)
    assert sum(name.startswith("mesh-") for name in screen.names()) == 1


def test_more_and_more_arrives(screen):
    moments = screen.view.moments
    for one, two in pairwise(moments):
        assert one.t_ns < two.t_ns
        assert one.delivered_bytes < two.delivered_bytes
        assert one.energy_j < two.energy_j
        assert sum(node.energy_j for node in two.nodes) == pytest.approx(two.energy_j)
        for before, after in zip(one.nodes, two.nodes, strict=True):
            assert before.depth_share <= after.depth_share
    assert moments[-1].no_hit_share < moments[0].no_hit_share


def test_the_table_says_until_when_it_counts_and_why_frames_were_lost(screen):
    """The radios also use energy after the last arrival, until which the columns count."""
    view = screen.view
    screen.dock.seek(view.run.end_ns)
    html = moment_table(view, view.moments[-1])
    last = time_text(view.moments[-1].t_ns)
    assert last != time_text(view.run.end_ns)
    assert f">by {last}<" in html
    assert f">end, {last}<" in html
    why = re.findall(r">· ([\w ]+)</button></td><td[^>]*>([\d,]+)</td>", html)
    assert sum(int(count.replace(",", "")) for _, count in why) == view.moments[-1].packets_lost
    assert f">by {time_text(view.times_ns[0])}<" in moment_table(view, view.moments[0])
    assert ("acknowledgement on the air", ANSWER) in legend(view)
    cleared = replace(view.run, config=with_settings(view.run.config, ("mac.rts=true",)))
    assert ("acknowledgement, RTS or CTS on the air", ANSWER) in legend(replace(view, run=cleared))


def test_the_more_a_node_has_used_the_nearer_is_its_ball_to_orange(screen):
    moments = screen.view.moments
    greens = []
    for t_ns in (moments[0].t_ns - 1, moments[0].t_ns, moments[-1].t_ns):
        screen.dock.seek(t_ns)
        greens.append([screen.handle(f"battery-{node.name}").color for node in screen.view.nodes])
    assert greens[0] == [FULL] * 3
    used_j = [node.energy_j for node in moments[-1].nodes]
    assert greens[2][int(np.argmax(used_j))] == EMPTY
    assert f"{used_j[0]:.3g} J" in screen.handle("name-node_00").text


def test_in_a_narrow_window_the_cameras_have_short_names_below_them(screen):
    drawing, names = screen.panel._drawing, [screen.handle(f"name-node_0{row}") for row in range(3)]
    drawing.spread_names(0.9, 1.7, 230.0)
    assert [name.text for name in names] == ["node_00", "node_01", "node_02"]
    for name, node in zip(names, screen.view.nodes, strict=True):
        assert name.position[2] < node.T_world_camera[2, 3]
    drawing.spread_names(0.9, 1.7, 600.0)
    assert all(" J" in name.text for name in names)


def test_packets_move_and_losses_name_their_cause(screen):
    pieces = screen.view.run.pieces
    in_air = np.flatnonzero(pieces.what == What.AIR)
    frame = int(in_air[len(in_air) // 2])
    screen.dock.seek(int(pieces.start_ns[frame]) + 1)
    assert len(screen.packets) >= 1
    lost = int(np.flatnonzero((pieces.what == What.LOSS) & (pieces.cause == Cause.COLLISION))[0])
    screen.dock.seek(int(pieces.start_ns[lost]))
    causes = [screen.handle(name).text for name in screen.names() if name.startswith("cause-")]
    assert "lost: collision" in causes


def test_picking_a_frame_tells_of_it_and_lights_its_pixels(screen):
    pieces = screen.view.run.pieces
    frames = pieces.where(pieces.what == What.AIR)
    item = int(np.flatnonzero((frames.peer == 3) & (frames.first_byte > 8_000))[0])
    screen.dock.seek(screen.view.moments[-1].t_ns)
    screen.panel._inspector.pick(0, item)
    text = screen.gui.text("Packet")
    assert "→ sink" in text
    assert "Attempt" in text
    assert "Without this packet the depth of" in text
    first, last = (int(n.replace(",", "")) for n in re.search(r"bytes ([\d,]+) to ([\d,]+)", text).groups())
    nodes = screen.spec.sent.network.nodes
    assert (last - first + 1, first % (last - first + 1)) == (nodes.payload_bytes - nodes.header_bytes, 0)
    assert "lit" in screen.names()
    screen.panel._inspector.pick(0, -1)
    assert PICK in screen.gui.text("Packet")
    assert "lit" not in screen.names()


def test_the_answer_on_a_frame_that_is_no_longer_picked_is_ignored(screen):
    view, asked, lit = screen.view, [], []
    ui, drawing = ui_of(), SimpleNamespace(light=lit.append)
    session = SimpleNamespace(quick_job=lambda *_, on_end: asked.append(on_end))
    inspector, frames = Inspector(ui, session), Frames(view.run)
    pixels = np.ones((1, 1), bool)
    packet = PacketView(0, pixels, pixels, np.zeros((1, 1, 3)), np.zeros((0, 3)))
    item = next(item for item in range(len(frames.pieces)) if frames.carries_image(item))
    for leave in (
        lambda: inspector.pick(0, -1),
        lambda: inspector.load([frames], view, SimpleNamespace(light=lit.append)),
    ):
        inspector.load([frames], view, drawing)
        inspector.pick(0, item)
        leave()
        asked.pop()(packet)
        assert packet not in lit
        assert ui.gui.text() == PICK
    inspector.pick(0, item)
    asked.pop()(packet)
    assert lit[-1] is packet


def test_the_command_delivers_the_same(screen):
    words = shlex.split(screen.panel.command)
    assert words[:6] == ["packetmesh", "deliver", *screen.spec.source.arguments(), "--preset", "office"]
    assert words[words.index("--moments") + 1] == "4"
    assert words[words.index("--coding") + 1] == screen.spec.sent.coding


def test_a_node_switched_off_is_not_heard_and_the_difference_is_told(screen):
    before = screen.view
    screen.gui.set("Switch off", "node_01")
    view = screen.view
    assert view.sent.down == ("node_01",)
    assert view.moments[-1].nodes[1].delivered_bytes == 0
    assert [node.row for node in view.nodes] == [0, -1, 1]
    assert view.run.names[:2] == ("node_00", "node_02")
    streams = [view.nodes[row].total_bytes for row in (0, 2)]
    assert f"2 nodes sent {1e-6 * sum(streams):.2f} MB" in screen.gui.text()
    told = numbers("", view, Frames(view.run))
    assert told["packets"] == f"{view.run.packets:,}"
    assert told["bytes_time"] == time_text(round(8e9 * sum(streams) / view.run.config.mac.rate_bps))
    screen.dock.seek(view.moments[-1].t_ns)
    assert screen.clouds() == {"cloud-node_00", "cloud-node_02"}
    assert "node_01 off" in screen.gui.text()
    assert f"instead of {100.0 * before.moments[-1].no_hit_share:.1f} %" in screen.gui.text()
    assert "--down node_01" in screen.panel.command
    screen.gui.set("Switch off", "none")


LEAVE_OUT, BY_WORTH = "Leave out seen tiles", "Most surface first"


def test_tiles_that_another_camera_showed_are_left_out_and_counted(screen):
    before = screen.view
    assert not screen.gui.find(LEAVE_OUT).disabled
    assert "Left out" not in screen.gui.text()
    screen.gui.set(LEAVE_OUT, True)
    view = screen.view
    assert view.sent.leave_out_seen
    assert 0 < view.left_out_bytes == before.total_bytes - view.total_bytes
    assert sum(node.left_out_tiles for node in view.nodes) > 0
    assert view.moments[-1].delivered_bytes == view.total_bytes
    asked_ns = view.run.pieces.start_ns[view.run.pieces.carries == PacketKind.REQUEST].min()
    assert view.times_ns[0] > asked_ns > 1e9  # the sink computes for a second; few bytes come before
    screen.dock.seek(view.moments[-1].t_ns)
    text = screen.gui.text()
    assert f"with {view.left_out_bytes:,} bytes" in text
    assert "shown tiles left out" in text
    assert "node_01: left out" in text
    assert "--leave-out-seen" in screen.panel.command.split()
    assert "leave-out=true" in screen.panel.in_address["net"].read()
    screen.gui.set(LEAVE_OUT, False)
    assert "Left out" not in screen.gui.text()
    assert "--leave-out-seen" not in screen.panel.command


def test_tiles_that_add_most_come_first_and_the_surface_is_there_with_fewer_bytes(screen):
    own = screen.view
    screen.gui.set(BY_WORTH, True)
    view = screen.view
    assert view.sent.order == "worth"
    assert view.total_bytes == own.total_bytes
    text = screen.gui.text()
    assert "The sink requested the depth tiles that add most surface first, in " in text
    assert "most surface first" in text.split("in the mesh")[0]
    assert "--order worth" in screen.panel.command
    assert "by-worth=true" in screen.panel.in_address["net"].read()
    screen.gui.set(BY_WORTH, False)
    assert screen.view.sent.order == "own"
    assert "--order" not in screen.panel.command


def test_what_cannot_be_left_out_cannot_be_chosen(screen):
    gui, box = screen.gui, screen.gui.find(LEAVE_OUT)
    screen.refuse = "not yet"
    box.value = True
    for name, value in (
        ("Coding", CODINGS["jpeg"]),
        ("Preset", NETWORKS["lte-m"].title),
        ("Medium access", "IEEE 802.11b"),
    ):
        before = gui.find(name).value
        gui.set(name, value)
        assert box.disabled == gui.find(BY_WORTH).disabled == (name != "Medium access")
        assert screen.spec.sent.leave_out_seen == (name == "Medium access")
        gui.set(name, before)
    assert not box.disabled
    box.value, screen.refuse = False, ""
    gui.set("Preset", NETWORKS["office"].title)


def test_losses_that_nobody_repairs_cost_bytes(screen):
    gui, screen.refuse = screen.gui, "not yet"
    gui.set("Send lost packets again", False)
    gui.set("in bursts of (frames)", 40)
    screen.refuse = ""
    gui.set("Lose packets (%)", 40.0)
    last = screen.view.moments[-1]
    assert last.delivered_bytes < screen.view.total_bytes
    words = shlex.split(screen.panel.command)
    changed = [
        word for word in words[words.index("--set") + 1 : words.index("--out")] if "surface." not in word
    ]
    assert with_settings(PRESETS["office"], changed) == screen.spec.sent.network
    screen.refuse = "not yet"
    gui.set("Lose packets (%)", 0.0)
    screen.refuse = ""
    gui.set("Send lost packets again", True)


def test_a_stop_of_the_lesson_sends_and_looks_at_one_frame(screen):
    screen.gui.press("Go", "Next", CROSSING_FOLDER)
    screen.gui.press("Your guess", "Skip", CROSSING_FOLDER)
    assert "(1 of 10)" in screen.gui.text()
    assert "bytes 0 to 1,463 of image" in screen.gui.text("Packet")
    assert len(screen.packets) == 1
    screen.gui.press("Go", "Next", CROSSING_FOLDER)
    screen.gui.press("Your guess", "Skip", CROSSING_FOLDER)
    answers = screen.view.run.pieces
    began = answers.start_ns[answers.what == What.ACK][0]
    assert began < screen.dock.now_ns < answers.end_ns[answers.what == What.ACK][0]
    screen.gui.press("Go", "Next", CROSSING_FOLDER)
    screen.gui.press("Your guess", "Skip", CROSSING_FOLDER)
    assert "Lost: collision" in screen.gui.text("Packet")
    screen.panel.on_action("Reset")


def test_frames_go_round_a_wall_over_another_camera_until_it_is_gone(screen):
    def heard_by():
        run, node = screen.view.run, screen.view.nodes[1].row
        sent = run.pieces.where((run.pieces.what == What.AIR) & (run.pieces.node == node))
        return {run.roles[peer] for peer in sent.peer.tolist()}

    gui = screen.gui
    assert heard_by() == {"sink"}
    gui.set("Wall loss (dB)", 80.0)
    gui.set("Wall at", "node_01")
    assert heard_by() == {"node"}
    assert "a wall of 80 dB" in gui.text()
    assert "radio.walls_m=" in screen.panel.command
    assert screen.drawn("/network/what-if/wall") is not None
    gui.set("Wall at", "none")
    assert heard_by() == {"sink"}
    assert screen.drawn("/network/what-if/wall") is None


def test_a_slower_rate_takes_longer(screen):
    gui, before = screen.gui, screen.view
    gui.set("802.11b rate", "5.5 Mbit/s")
    assert screen.view.sent.network.mac.rate_bps == 5.5e6
    assert screen.view.moments[-1].t_ns > 1.4 * before.moments[-1].t_ns
    assert "mac.rate_bps=5500000" in screen.panel.command.replace("5.5e+06", "5500000")
    gui.set("802.11b rate", "11 Mbit/s")
    assert screen.view.sent == before.sent


def test_a_second_drag_before_the_first_is_answered_counts_once(screen):
    ui = ui_of(screen.ui.scene)
    what_if = WhatIf(ui, "/alone", lambda: None)
    what_if.load(screen.view, lambda name: np.array([1.0, 2.0, 3.0]))
    ui.gui.set("Move radio of", "node_00")
    for by_m in ((0.4, 0.0, 0.0), (0.0, 0.3, 0.0)):
        screen.drag(screen.drawn("/alone/arrows"), by_m)
    places_m = next(one for one in what_if.settings() if one.startswith("nodes.places_m="))
    x_m, y_m = (float(word) for word in places_m.partition("=")[2].split(",")[:2])
    run, row = screen.view.run, screen.view.nodes[0].row
    assert np.array([x_m, y_m]) - run.positions_m(run.start_ns)[row] == pytest.approx((0.4, 0.3), abs=2e-3)
    assert not what_if.off
    ui.gui.set("Move radio of", "none")
    assert what_if.settings() == ()


def test_a_radio_that_is_dragged_out_of_range_is_not_heard_and_comes_back(screen):
    gui, view = screen.gui, screen.view
    gui.set("Move radio of", "node_02")
    assert screen.drawn("/network/what-if/arrows") is not None
    screen.drag(screen.drawn("/network/what-if/arrows"), (1e5, 0.0, 0.0))
    assert screen.view.moments[-1].nodes[2].delivered_bytes == 0
    assert "radios moved" in gui.text()
    assert screen.handle("battery-node_02").position[0] > 9e4
    gui.set("Move radio of", "none")
    assert screen.view.moments[-1].delivered_bytes == view.total_bytes
    assert screen.drawn("/network/what-if/arrows") is None


@pytest.mark.parametrize("path", [CROSSING, LOST_PACKET], ids=lambda path: path.stem)
def test_every_stop_of_the_lessons_asks_for_a_network_that_there_is(path):
    setup = NetworkSetup(ui_of(), lambda: None)
    setup.add_what_if("/what-if")
    setup.add_advanced()
    setup.what_if.offer(["node_00", "node_01", "node_02"])
    asked = []
    for stop in read_lesson(path, KIND).stops:
        setup.take(stop.look)
        asked.append(tuple(setup.runs().values()) if setup.street else setup.sent())
        if stop.look.off:
            assert asked[-1].down == (stop.look.off,)
    assert len(set(asked)) >= 7


def test_a_stop_on_a_plan_rebuilds_the_surface_at_the_fewest_moments():
    controls = NetworkSetup(ui_of(), lambda: None)
    controls.add_what_if("/what-if")
    controls.add_advanced()
    controls.take(read_lesson(PLACING, KIND).stops[0].look)
    assert controls.sent().moments == setup.FEWEST
    controls.take(NetworkLook())
    assert controls.sent().moments == setup.MOMENTS


def test_the_lesson_on_plans_says_the_plans_numbers_and_takes_its_plan_away(screen, monkeypatch):
    gui, folder, view = screen.gui, "Lesson: Where should the camera stand?", Results.view
    scene = SimpleNamespace(title="room", has_walk=False)
    monkeypatch.setattr(Results, "view", lambda self, step: scene if step == "scene" else view(self, step))
    gui.press("Go", "Next", folder=folder)
    assert f"{screen.panel._plan.numbers()['unmeasured']} of the rays meet" in gui.text(folder)
    gui.press("Your guess", "3", folder=folder)
    gui.press("Go", "Next", folder=folder)
    assert f"**{screen.panel._plan.numbers()['promise']} points**" in " ".join(gui.text(folder).split())
    gui.press("Go", "End", folder=folder)
    assert "No plan yet" in gui.text("Plan")
    screen.panel.on_action("Reset")


@pytest.mark.parametrize(
    ("setting", "leave"),
    [
        ("scheme.k=3", lambda screen: screen.use("")),
        ("scheme.k=3", lambda screen: screen.panel.on_action("Reset")),
        ("scheme.k=3", lambda screen: screen.gui.set("Preset", NETWORKS["greenhouse"].title)),
        ("loss.burst_packets=3", lambda screen: screen.gui.set("Lose packets (%)", 10.0)),
    ],
)
def test_a_setting_that_changes_nothing_is_named_until_it_counts_or_goes(screen, setting, leave):
    screen.refuse = "not yet"
    screen.use(setting)
    assert f"{setting.partition('=')[0]} changes nothing here: " in screen.gui.text()
    leave(screen)
    assert "changes nothing" not in screen.gui.text()
    screen.refuse = ""
    screen.panel.on_action("Reset")


def test_bursts_are_put_back_and_in_the_address_as_all_other_controls():
    ui = ui_of()
    setup = NetworkSetup(ui, lambda: None)
    setup.add_what_if("/what-if")
    setup.add_advanced()
    ui.gui.set("in bursts of (frames)", 20)
    setup.take_place("")
    assert ui.gui.find("in bursts of (frames)").value == 8
    assert setup.place() == ""
    ui.gui.set("Lose packets (%)", 10.0)
    ui.gui.set("in bursts of (frames)", 20)
    ui.gui.set(LEAVE_OUT, True)
    sent, place = setup.sent(), setup.place()
    setup.reset()
    setup.take_place(place)
    assert setup.sent() == sent
    assert sent.network.loss.burst_packets == 20.0
    assert sent.leave_out_seen


def test_a_wrong_key_names_the_nearest_and_keeps_what_was(screen):
    before = screen.panel.command
    with pytest.raises(InputError, match=r"try radio\.shadowing_db"):
        screen.use("radio.shadow_db=3")
    assert screen.panel.command == before


@pytest.mark.parametrize(("seed", "sentence"), [(7, "There is no memory left."), (8, "Cancelled.")])
def test_a_failed_or_cancelled_delivery_says_why_and_another_runs(screen, seed, sentence):
    screen.refuse = sentence
    screen.gui.set("Seed", seed)
    assert sentence in screen.gui.text()
    assert screen.names() == []
    screen.refuse = ""
    screen.gui.set("Seed", 0)
    assert "3 nodes sent" in screen.gui.text()


def test_vehicles_move_and_two_schemes_stand_beside_each_other(screen):
    gui, screen.refuse = screen.gui, "not yet"
    screen.panel.in_address["look"].take(text_of(Look(wire=True)))
    gui.set("Preset", NETWORKS["street-grid"].title)
    assert not gui.find("Cut away").seen, "vehicles are in no room"
    assert screen.panel.in_address["look"].place() == ""
    gui.set("Vehicles", 5)
    screen.refuse = ""
    screen.use("run.horizon_s=660")
    assert ORIGIN in gui.text()
    assert not gui.find("Suggest").seen, "vehicles are not planned"
    assert gui.find("Scheme").seen
    assert not gui.find("Coding").seen
    (run,) = screen.results.view("network")
    assert run.start_ns == 600_000_000_000
    start = screen.handle("vehicle").points.copy()
    screen.dock.seek(610_000_000_000)
    moved = np.linalg.norm(screen.handle("vehicle").points - start, axis=1)
    assert moved.min() > 0.0
    assert moved.max() <= 1.001 * 100.0 * ground_of([run]).scale
    screen.dock.seek(run.end_ns)
    cells = np.unique(run.roads.cell)
    seen, covered = (counts[cells] for counts in run.roads.counts(run.end_ns, cells.max() + 1))
    roads = screen.handle("roads").colors[:, 0]
    assert 0 < covered.sum() < seen.sum()
    assert (roads[covered == seen] == linear(np.array(COVERAGE_STOPS[-1]))).all()
    assert (roads[covered == 0] == linear(np.array(COVERAGE_STOPS[0]))).all()
    screen.dock.seek(run.start_ns)
    assert (screen.handle("roads").colors == linear(np.array(STREET))).mean() > 0.8
    assert "Roads, each way" in gui.text()
    assert screen.lanes[0].labels(0)[0].text == "vehicle 1"
    gui.set("Compare with", "PDC: by chance, as offered")
    assert len(screen.results.view("network")) == 2
    assert [lane.labels(0)[0].text for lane in screen.lanes] == [
        "BASELINE · vehicle 1",
        "PDC · vehicle 1",
    ]
    assert ">PDC: by chance, as offered</th>" in gui.text()
    assert re.search(
        r"PDC delivers \d+% of the images that .+ delivers, and keeps \d+% of the coverage", gui.text()
    )
    lines = screen.panel.command.splitlines()
    assert len(lines) == 2
    screen.refuse = "enough seen"
    screen.panel.on_action("Reset")
    assert gui.find("Preset").value == NETWORKS["office"].title
