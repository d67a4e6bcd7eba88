"""The plan in a lesson: what a stop shows, the numbers of its text, the pupil's ghost, and the way back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from app.lesson.reading import read_lesson
from app.screens.network.lesson import KIND, PLACING, NetworkLook
from app.screens.network.planning.lesson import JUDGED, NUMBERS, SETTINGS, PlanLook
from app.window.tables import UNKNOWN
from packetmesh.errors import InputError
from pipeline.planning.walls import DAMPING_DB
from tests.app.fakes import Impatient, ui_of
from tests.app.screens.network.planning.test_folder import Only, Screen, spec  # noqa: F401

pytestmark = pytest.mark.xdist_group("network plan")
BESIDE = PlanLook("beside", "node_01", 0.3)


@pytest.fixture
def screen(server, store, spec, tmp_path):  # noqa: F811
    return Screen(Only, ui_of(server.scene, kind=Impatient), store, tmp_path, steps=(), spec=spec)


@pytest.fixture
def plan(screen):
    return screen.panel.plan


def ghost_of(screen, row=1):
    return screen.drawn(f"/network/plan/{row}")


def test_what_is_missed_is_shown_without_a_ghost(screen, plan):
    plan.show_look(PlanLook("missed"))
    assert ghost_of(screen) is None
    assert len(screen.newly()) == len(plan._newest.targets_m) > 0
    numbers = plan.numbers()
    share = 100.0 * (1.0 - plan._newest.measured_share)
    assert numbers["unmeasured"] == f"{share:.1f} %"
    assert f"{share:.1f} % of the present cameras' rays" in screen.gui.text("Plan")
    assert numbers["promise"] == numbers["own"] == UNKNOWN
    assert plan.offers() == ()


def test_a_ghost_stands_beside_a_camera_and_the_numbers_are_those_of_the_folder(screen, plan):
    plan.show_look(BESIDE)
    camera = np.reshape(plan._newest.present["node_01"], (4, 4))
    (pose,) = screen.poses
    assert np.allclose(pose[:3, :3], camera[:3, :3])
    assert np.allclose(pose[:3, 3] - camera[:3, 3], 0.3 * camera[:3, 0]), "to its right"
    assert np.allclose(ghost_of(screen).position, pose[:3, 3])
    numbers, text = plan.numbers(), screen.gui.text("Plan")
    assert set(numbers) == set(NUMBERS)
    for name in ("promise", "overlap", "seconds_99", "image_energy"):
        assert f">{numbers[name]}<" in text, name
    assert "by hand" in text
    assert numbers["own"] == UNKNOWN, "the pupil has not moved it"


def test_the_promise_of_the_ghost_that_the_pupil_moved_is_kept_beside_the_suggestion(screen, plan):
    plan.show_look(BESIDE)
    screen.drag((0.0, 0.0, 0.2))
    own = plan.numbers()["own"]
    assert own == plan.numbers()["promise"]
    plan.show_look(PlanLook("suggest"))
    numbers = plan.numbers()
    assert numbers["own"] == own != numbers["promise"]
    assert numbers["own_overlap"].endswith(" %")
    screen.drag((0.0, 0.0, 0.1))
    assert plan.numbers()["own"] == own, "a ghost of the planner is not the pupil's"
    plan.give_back()
    assert plan.numbers()["own"] == UNKNOWN


def test_a_users_own_plan_is_back_after_the_lesson(screen, plan):
    screen.gui.set("On walls", False)
    screen.gui.set("Budget (J)", "50")
    screen.suggest()
    screen.drag((0.0, 0.0, 0.25))
    place, poses, text = plan.place(), screen.poses, screen.gui.text("Plan")
    for look in (PlanLook("none"), PlanLook("missed"), BESIDE, PlanLook("suggest", cameras=2)):
        plan.show_look(look)
    assert len(screen.poses) == 2
    assert plan.place() == "cameras=2", "a stop starts from the first values"
    plan.show_look(PlanLook())
    assert plan.place() == place
    assert np.allclose(screen.poses, poses)
    assert screen.gui.text("Plan") == text


def test_without_a_plan_before_there_is_none_after_and_reset_drops_what_was_put_aside(screen, plan):
    plan.show_look(PlanLook("suggest"))
    plan.give_back()
    assert "No plan yet" in screen.gui.text("Plan")
    assert ghost_of(screen) is None
    screen.suggest()
    plan.show_look(PlanLook("none"))
    plan.reset()
    plan.give_back()
    assert ghost_of(screen) is None


def test_a_stop_that_sets_no_plan_leaves_the_users(screen, plan):
    screen.suggest()
    poses = screen.poses
    plan.show_look(PlanLook())
    assert np.array_equal(screen.poses, poses)


def test_a_camera_that_is_not_there_is_named(plan):
    with pytest.raises(
        InputError, match=r"beside node_07, but the registered cameras here are node_00, node_01"
    ):
        plan.show_look(PlanLook("beside", "node_07", 0.3))


@pytest.mark.parametrize(
    ("name", "text", "look"),
    [
        ("plan", "none", PlanLook("none")),
        ("plan", "suggest", PlanLook("suggest")),
        ("plan", "beside node_02 30 cm", PlanLook("beside", "node_02", 0.3)),
        ("new-cameras", "3", PlanLook(cameras=3)),
        ("sensor", "kinect-v2", PlanLook(sensor="kinect-v2")),
        ("where", "walls, tripods", PlanLook(where=("walls", "tripods"))),
    ],
)
def test_a_setting_of_a_stop_is_of_its_plan(name, text, look):
    assert SETTINGS[name](NetworkLook(), text).plan == look


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("plan", "best", "try none, missed, suggest, or for example 'beside node_00 30 cm'"),
        ("plan", "beside node_00 201 cm", "at most 200 cm"),
        ("new-cameras", "0", "from 1 to 4"),
        ("new-cameras", "5", "from 1 to 4"),
        ("sensor", "eye", "try one of as-present, kinect-v1"),
        ("where", "walls, sky", "try one or more of walls, ceiling, furniture, tripods"),
    ],
)
def test_a_wrong_setting_says_what_to_try(name, text, sentence):
    with pytest.raises(ValueError, match=sentence):
        SETTINGS[name](NetworkLook(), text)


def test_the_lesson_cites_the_record_of_the_test_rooms_and_the_walls_of_the_planner():
    record = json.loads(Path("docs/results/planning.json").read_text())["numbers"]
    assert JUDGED["judged_rooms"] == f"{record['rooms']:.0f}"
    assert JUDGED["judged_cameras"] == f"{record['suggestions']:.0f}"
    assert JUDGED["judged_rank"] == f"{record['rank_correlation']:.2f}"
    assert JUDGED["judged_held"] == f"{100.0 * record['inside_interval']:.0f} %"
    assert f"(goal .{JUDGED['judged_goal'][2:]})" in Path("docs/SPEC.md").read_text()
    assert f"loses {DAMPING_DB['brick']:g} dB, as through brick" in PLACING.read_text()


def test_the_lesson_shows_the_misses_the_pupils_ghost_and_the_suggestion_in_this_order():
    stops = read_lesson(PLACING, KIND).stops
    assert [stop.look.plan.show for stop in stops] == ["missed", "beside", *4 * ["suggest"]]
    assert all(stop.opens == ("Plan",) for stop in stops)
