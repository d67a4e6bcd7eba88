"""The folder *Plan* with a small room and no browser: plans, dragged ghosts, files, and taking a camera."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute import jobs
from app.compute.seen_places import place_of
from app.compute.state import Sent, Spec
from app.screens.network.planning.controls import PlanControls
from app.screens.network.planning.folder import PlanFolder
from app.screens.network.planning.planned import sending_of
from app.window.panel import Panel
from network_sim.presets import PRESETS
from packetmesh.errors import InputError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.io.rigs import load_rig, save_rig
from pipeline.kernels.geometry import aim_deg, rigid
from pipeline.sources import RigFolder
from tests.app.fakes import Bench, Impatient, ui_of
from tests.pipeline.delivery.small import CONFIG, small_rig

pytestmark = pytest.mark.xdist_group("network plan")


class Only(Panel):
    """A screen of this folder alone."""

    title = "Network"
    drawn_below = "/network"

    def build(self):
        self.sent = Sent(PRESETS["office"], "raw", 4)
        self.plan = PlanFolder(self.session, "/network/plan", lambda: self.sent, lambda: "office")

    def on_spec(self, spec):
        self.plan.on_spec(spec)


class Screen(Bench):
    """A screen that computes at once."""

    def suggest(self):
        self.gui.press("Suggest")
        return self.gui.text("Plan")

    @property
    def poses(self):
        return [np.reshape(pose, (4, 4)) for pose in self.panel.plan._where]

    def drag(self, by_m, phases=("update", "end")):
        """Drag the handle of the chosen ghost and let it go."""
        (name,) = (one for one in self.ui.scene.names("/network/plan") if "/handle-" in one)
        handle = self.drawn(name)
        handle.position = np.array(handle.position) + by_m
        for phase in phases:
            for heard in handle._impl_aux.update_cb:
                heard(SimpleNamespace(phase=phase))

    def newly(self):
        points = self.drawn("/network/plan/seen").points
        return points[points[:, 2] > -100.0]


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigs") / "small room"
    save_rig(folder, small_rig(nodes=2, scene="box-on-table"))
    return Spec(RigFolder(str(folder)), config=CONFIG, sent=Sent(PRESETS["office"], "raw", 4))


@pytest.fixture
def screen(server, store, spec, tmp_path):
    return Screen(Only, ui_of(server.scene, kind=Impatient), store, tmp_path, steps=(), spec=spec)


def test_a_plan_has_its_table_its_ghosts_and_what_they_newly_see(screen):
    screen.gui.set("New cameras", 2)
    text = screen.suggest()
    assert "The 2 new cameras together promise" in text
    for word in ("Height", "tripod", "Promise, points", "Energy", "99 % after"):
        assert word in text
    names = screen.ui.scene.names("/network/plan")
    assert {"/network/plan/1", "/network/plan/2", "/network/plan/handle-1"} <= set(names)
    for row, pose in enumerate(screen.poses, 1):
        assert np.allclose(screen.drawn(f"/network/plan/{row}").position, pose[:3, 3])
    assert 0 < len(screen.newly()) <= len(screen.panel.plan._plan.targets_m)
    (picture,) = screen.gui.all("image", "Plan")
    assert picture.image.shape[2] == 3
    assert not screen.notices


def test_the_walls_have_the_material_that_was_chosen(screen):
    screen.suggest()
    brick = screen.panel.plan._plan
    screen.gui.set("Walls of", "Plaster")
    screen.suggest()
    radio = sending_of(drain(place_of(screen.store, screen.spec)), screen.panel.plan._plan.request)[1]
    assert (brick.request.walls, radio.walls) == ("brick", "plaster")


def test_dark_surface_is_named_and_can_be_left_out(screen):
    text, plan = screen.suggest(), screen.panel.plan._plan
    assert "Of it on dark surface" in text
    assert plan.dark.any(), "the small room's screen"
    screen.gui.set("Dark surface counts", False)
    assert "is left out of this plan" not in text
    assert "is left out of this plan" in screen.suggest()
    without = screen.panel.plan._plan
    assert not without.dark.any()
    assert len(without.targets_m) == (~plan.dark).sum()
    assert without.ghosts.total.dark_share == 0.0
    assert "may stay without depth" not in screen.gui.text("Plan")
    screen.drag((0.0, 0.0, 0.1))
    assert screen.panel.plan._ghosts.total.dark_share == 0.0, "a dragged ghost counts the same"


def test_a_dragged_ghost_promises_what_it_sees_there_and_its_image_is_sent_from_there(screen):
    screen.suggest()
    pose, seen = screen.poses[0], screen.newly()
    screen.drag((0.0, 0.0, 0.3), phases=("update",))
    during = screen.gui.text("Plan")
    assert "by hand" in during
    assert during.count("…") == 3, "times and energy are awaited until it is let go"
    assert "still those of the place before" in during
    assert np.allclose(screen.poses[0], rigid(pose[:3, :3], pose[:3, 3] + (0.0, 0.0, 0.3)), atol=1e-6)
    assert len(screen.newly()) != len(seen) or not np.allclose(screen.newly(), seen)
    screen.drag((0.0, 0.0, 50.0))
    far = screen.gui.text("Plan")
    assert "promises 0.0 (0.0 to 1.3) points" in far
    assert "registration may not find its pose" in far
    assert "No present camera sees that there is free space" in far
    assert not len(screen.newly())
    assert "…" not in far


def test_a_ghost_is_moved_by_numbers_as_by_hand(screen):
    assert not screen.gui.find("Place (m)").seen
    screen.suggest()
    pose = screen.poses[0]
    place, aim = screen.gui.find("Place (m)"), screen.gui.find("Pan, tilt (°)")
    height = float(re.search(r"Height.*?([\d.]+) m", screen.gui.text("Plan"), re.DOTALL)[1])
    assert place.value == pytest.approx((*pose[:2, 3], height), abs=0.006)
    assert aim.value == pytest.approx(aim_deg(pose), abs=0.06)
    x_m, y_m, height_m = place.value
    screen.gui.set("Place (m)", (x_m, y_m, height_m + 0.3))
    there = rigid(pose[:3, :3], (x_m, y_m, pose[2, 3] + 0.3))
    assert np.allclose(screen.poses[0], there, atol=0.006)
    (name,) = (one for one in screen.ui.scene.names("/network/plan") if "/handle-" in one)
    for drawn in (screen.drawn(name), screen.drawn("/network/plan/1")):
        assert np.allclose(drawn.position, screen.poses[0][:3, 3])
    text = screen.gui.text("Plan")
    assert "by hand" in text
    assert "…" not in text, "its image is sent from there"
    screen.gui.set("Pan, tilt (°)", (40.0, -20.0))
    assert aim_deg(screen.poses[0]) == pytest.approx((40.0, -20.0))
    screen.drag((0.2, 0.0, 0.0))
    assert place.value == pytest.approx((x_m + 0.2, y_m, height_m + 0.3), abs=0.011)


def test_an_answer_of_a_plan_that_is_gone_changes_nothing(screen):
    screen.suggest()
    old = screen.panel.plan._plan
    screen.panel.plan.forget()
    screen.panel.plan._moved(old, 0, np.eye(4), True)
    assert "No plan yet" in screen.gui.text("Plan")
    assert screen.ui.scene.names("/network/plan") == []


@pytest.mark.parametrize(
    ("label", "value", "sentence"),
    [
        ("Budget (J)", "0.001", "No camera meets budget and deadline"),
        ("Deadline (s)", "0.001", "No camera meets budget and deadline"),
    ],
)
def test_where_no_camera_meets_a_limit_a_sentence_says_what_it_needs(screen, label, value, sentence):
    screen.gui.set(label, value)
    text = screen.suggest()
    assert f"No plan</b>: {sentence}" in text or f"**No plan**: {sentence}" in text
    assert re.search(r"needs [\d.]+ s and [\d.]+ J", text)
    assert screen.ui.scene.names("/network/plan") == []


def test_where_nothing_is_allowed_or_nothing_reaches_or_nobody_is_there_a_sentence_says_so(screen):
    for label in ("On walls", "On the ceiling", "On furniture", "On tripods"):
        screen.gui.set(label, False)
    assert "No camera may stand anywhere" in screen.suggest()
    screen.gui.set("On tripods", True)
    screen.panel.sent = replace(
        screen.panel.sent,
        network=with_settings(PRESETS["office"], ["radio.range_m=1", "radio.sense_range_m=1"]),
    )
    assert "The radio does not carry a new camera" in screen.suggest()
    screen.panel.sent = Sent(PRESETS["office"], "raw", 4, down=("node_00", "node_01"))
    assert "All registered cameras are switched off, so nothing can be planned; switch on node_00" in (
        screen.suggest()
    )
    screen.gui.set("Budget (J)", "much")
    with pytest.raises(InputError, match="'much'; try a number above 0"):
        screen.gui.press("Suggest")


def test_another_surface_drops_the_plan_and_another_network_sends_the_images_again(screen):
    screen.suggest()
    before, poses = screen.gui.text("Plan"), screen.poses
    slow = replace(screen.spec.sent, network=PRESETS["thesis-link"])
    screen.want(replace(screen.spec, sent=slow))
    after = screen.gui.text("Plan")
    assert np.array_equal(poses, screen.poses)
    assert seconds(after) > 10.0 * seconds(before)
    screen.want(replace(screen.spec, config=with_settings(CONFIG, ["surface.max_points=2000"])))
    assert "No plan yet" in screen.gui.text("Plan")
    assert screen.panel.plan.offers() == ()


def seconds(text):
    return float(re.search(r"99 % after ([\d.]+) s", text)[1])


def test_the_files_are_those_of_the_command_with_the_ghosts_where_they_are(screen):
    screen.suggest()
    screen.drag((0.0, 0.0, 0.25))
    (offers,) = screen.panel.plan.offers()
    contents = {
        offer.file: drain(jobs.run(offer.job, screen.store, screen.spec, *offer.arguments))
        for offer in offers.files
    }
    assert contents["floor_plan.svg"].startswith(b"<svg")
    assert b"by hand" in contents["floor_plan.svg"]
    assert contents["floor_plan.pdf"].startswith(b"%PDF")
    record = json.loads(contents["plan.json"])
    assert np.allclose(record["cameras"][0]["T_world_camera"], screen.poses[0])
    assert record["cameras"][0]["where"] == "by hand"
    assert record["network"]["preset"] == "office"


def test_a_camera_that_is_taken_stands_in_a_larger_rig_and_its_promise_is_beside_its_gain(screen):
    assert "is not one of them" in screen.suggest()
    assert not screen.gui.find("Take it").seen
    first = screen.spec.source
    screen.panel.plan._taking._rooms[first] = "box-on-table", 0
    screen.suggest()
    pose = screen.poses[0]
    screen.gui.press("Take it")
    assert screen.spec.source != first
    rig = load_rig(screen.spec.source.path)
    assert len(rig.frames) == 3
    assert np.allclose(rig.frames[2].T_world_camera, pose)
    assert np.allclose(rig.truth.T_world_camera[2], pose)
    near = np.abs(rig.frames[2].depth.z_m - rig.truth.depth[2].z_m) < 0.05
    assert near.sum() > 0.8 * rig.frames[2].depth.valid.sum(), "its depth is that of the room from there"
    text = screen.gui.text("Plan")
    promised, real = re.search(
        r"Promised ([\d.]+) \(.*\) points(?:, .* depth)?, really (-?[\d.]+)\*", text
    ).groups()
    assert 0.0 < float(promised) < 20.0
    assert abs(float(real)) < 20.0
    assert "No plan yet" in text
    screen.suggest()
    assert screen.gui.find("Take it").seen, "the larger rig is of a demo room, too"
    screen.want(replace(screen.spec, source=first))
    assert "Promised" not in screen.gui.text("Plan")


def test_a_camera_that_cannot_be_taken_is_explained_and_one_at_a_time_is_taken(screen):
    taking = screen.panel.plan._taking
    taking._rooms[screen.spec.source] = "box-on-table", 0
    screen.gui.set("Sensor", "Kinect v2")
    assert "know only how a Kinect v1 measures depth" in screen.suggest()
    assert not screen.gui.find("Take it").seen
    screen.gui.set("Sensor", "Kinect v1")
    assert "*Take it* is not offered" not in screen.suggest()
    answers = []
    screen.side_job = lambda *_, on_end: answers.append(on_end)
    screen.gui.press("Take it")
    screen.drag((0.0, 0.0, 0.1))
    assert not screen.gui.find("Take it").seen
    answers.pop()(None)
    assert screen.gui.find("Take it").seen
    assert "The camera was not added" in screen.gui.text("Plan")
    screen.gui.press("Take it")
    screen.want(replace(screen.spec, config=with_settings(CONFIG, ["surface.max_points=2000"])))
    before = screen.spec
    answers.pop()(SimpleNamespace(source=RigFolder("elsewhere")))
    assert screen.spec == before, "the settings have changed since"


def test_the_controls_are_in_the_address_and_wrong_values_are_named():
    ui = ui_of()
    controls = PlanControls(ui)
    assert controls.place() == ""
    ui.gui.set("New cameras", 3)
    ui.gui.set("On walls", False)
    ui.gui.set("Sensor", "Kinect v2")
    ui.gui.set("Walls of", "Concrete")
    ui.gui.set("Dark surface counts", False)
    ui.gui.set("Deadline (s)", "2.5")
    sent = Sent(PRESETS["office"])
    place, request = controls.place(), controls.request(sent)
    assert place == "cameras=3;walls=false;dark=false;sensor=kinect-v2;material=concrete;deadline=2.5"
    assert (request.walls, request.dark_surface) == ("concrete", False)
    controls.take("")
    assert controls.place() == ""
    controls.take(place)
    assert controls.request(sent) == request
    for wrong, word in (
        ("cameras=9", "cameras=9"),
        ("deadline=-1", "-1"),
        ("colour=red", "colour"),
        ("material=straw", "straw"),
    ):
        with pytest.raises(InputError, match=word):
            controls.take(wrong)
    assert controls.place() == ""
