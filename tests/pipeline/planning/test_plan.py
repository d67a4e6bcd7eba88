"""Plans: what they promise, what they may not choose, and that they are the same again."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.planning.calls import plan
from pipeline.planning.chances import judge
from pipeline.planning.plan import (
    BY_HAND,
    LEAST_OVERLAP,
    PlanConfig,
    bright_only,
    moved_plan,
    plan_of,
)
from pipeline.planning.promise import promise
from pipeline.planning.seen import without_dark
from pipeline.planning.sensors import SENSORS, sensor_named
from tests.pipeline.planning.rooms import targets_at


def planned(office, count=3, barred=(), judged=None):
    config = PlanConfig(cameras=count)
    return plan_of(office.seen, judged or office.judged, office.sensor, config, barred)


def row_of(office, camera):
    poses = [one.T_world_camera for one in office.judged.candidates]
    return next(row for row, pose in enumerate(poses) if pose is camera.T_world_camera)


def test_a_plan_promises_less_and_less_and_all_that_its_cameras_promise(office):
    found = planned(office)
    gains = [camera.promise.gain_share for camera in found.cameras]
    assert len(gains) == 3
    assert gains == sorted(gains, reverse=True)
    assert found.total.gain_share == pytest.approx(sum(gains))
    assert 0.0 < found.total.gain_share < 1.0 - found.measured_share
    low, high = found.total.ci95_share
    assert 0.0 <= low < found.total.gain_share < high
    assert 0.5 <= found.at_least_of_best <= 1.0, "greedy with one camera at a place"
    places_m = [tuple(camera.T_world_camera[:3, 3].round(3)) for camera in found.cameras]
    assert len(set(places_m)) == len(places_m)


def test_one_camera_is_the_best_one(office):
    found, sums = planned(office, 1), office.judged.chance.sum(axis=1)
    assert row_of(office, found.cameras[0]) == np.argmax(np.where(office.judged.allowed, sums, 0.0))
    assert found.at_least_of_best == pytest.approx(1.0, abs=1e-6)


def test_each_camera_shares_enough_with_a_present_one(office):
    judged = office.judged
    assert np.array_equal(judged.allowed, judged.overlap_shares >= LEAST_OVERLAP)
    some = judged.overlap_shares >= np.median(judged.overlap_shares)
    for camera in planned(office, 5, judged=replace(judged, allowed=some)).cameras:
        assert camera.overlap_share >= np.median(judged.overlap_shares)


def test_a_barred_camera_is_replaced_by_another_one(office):
    first = row_of(office, planned(office, 1).cameras[0])
    other = planned(office, 1, barred=[first])
    assert row_of(office, other.cameras[0]) != first
    assert other.total.gain_share <= planned(office, 1).total.gain_share


def test_where_none_overlaps_or_none_adds_anything_the_plan_is_a_sentence(office):
    judged = office.judged
    apart = replace(judged, allowed=np.zeros_like(judged.allowed))
    with pytest.raises(InputError, match="shows enough of what a present camera measures"):
        planned(office, judged=apart)
    idle = replace(judged, chance=0 * judged.chance)
    with pytest.raises(InputError, match="would measure anything that is missing"):
        planned(office, judged=idle)


def test_a_whole_plan_is_the_same_again(office):
    config = PlanConfig(cameras=2, where=("tripods",))
    first, again = (plan(office.done, config) for _ in range(2))
    for one, other in zip(first.plan.cameras, again.plan.cameras, strict=True):
        assert np.array_equal(one.T_world_camera, other.T_world_camera)
        assert one.promise == other.promise
    assert first.delivery.cameras == again.delivery.cameras


def test_the_interval_is_wider_where_what_is_promised_is_dark():
    bright, dark = (targets_at(np.ones((40, 3)), (0, 0, 1), dark_return=of) for of in (0.0, 0.1))
    chance = np.full(40, 0.5)
    known, doubtful = promise(chance, bright), promise(chance, dark)
    assert known.gain_share == doubtful.gain_share > 0.0
    assert doubtful.ci95_share[1] > known.ci95_share[1]
    assert (known.dark_share, doubtful.dark_share) == (0.0, doubtful.gain_share)
    mixed = replace(bright, dark_return=np.repeat([0.0, 0.1], [30, 10]))
    assert promise(chance, mixed).dark_share == pytest.approx(0.25 * known.gain_share)
    assert promise(0 * chance, bright).gain_share == promise(0 * chance, bright).ci95_share[0] == 0.0
    assert promise(chance, bright).gain_share == pytest.approx(2.0 * promise(0.5 * chance, bright).gain_share)


def test_dark_surface_is_left_out_of_all_targets(office):
    targets, bright = office.seen.targets, without_dark(office.seen).targets
    lit = targets.dark_return == 0.0
    assert 0 < lit.sum() < len(lit), "the office has dark screens"
    assert np.array_equal(bright.points_m, targets.points_m[lit])
    assert not bright.dark_return.any()
    assert bright.share == targets.share
    chance = np.linspace(0.0, 1.0, len(lit))
    both, known = promise(chance, targets), promise(chance[lit], bright)
    assert known.gain_share == pytest.approx(both.gain_share - both.dark_share)


@pytest.mark.parametrize("count", [1, 2])
def test_a_plan_without_dark_surface_keeps_the_bright_part_of_the_other(office, count):
    every = plan_of(office.seen, office.judged, office.sensor, PlanConfig(cameras=count))
    judged, config = bright_only(office.judged, office.seen), PlanConfig(cameras=count, dark_surface=False)
    bright = plan_of(without_dark(office.seen), judged, office.sensor, config)
    assert bright.total.dark_share == 0.0
    assert bright.total.gain_share >= every.total.gain_share - every.total.dark_share - 1e-9


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"cameras": 0}, "cameras is 0; try at least 1"),
        ({"cameras": 21}, "plan at most 20"),
        ({"sensor": "camera"}, "no sensor 'camera'; try one of as-present, kinect-v1"),
        ({"where": ("roof",)}, "No camera can stand on 'roof'; try one of walls"),
        ({"where": ()}, "No camera may stand anywhere"),
    ],
)
def test_what_cannot_be_planned_is_one_sentence(changes, says):
    with pytest.raises(InputError, match=says):
        PlanConfig(**changes)


def test_the_present_sensor_has_the_rigs_lens(office):
    assert sensor_named("as-present", office.rig).intrinsics == office.rig.frames[0].intrinsics
    for name, sensor in SENSORS.items():
        assert sensor_named(name, office.rig) is sensor
        assert sensor.near_m < sensor.far_m


def test_a_plan_moved_nowhere_is_the_same_and_a_moved_camera_promises_what_it_sees_there(office):
    before = planned(office, 2)
    poses = [camera.T_world_camera for camera in before.cameras]
    judged = [judge(office.seen, pose, office.sensor) for pose in poses]
    same = moved_plan(office.seen, before, poses, judged)
    for one, other in zip(before.cameras, same.cameras, strict=True):
        assert other.where == one.where
        assert other.promise.gain_share == pytest.approx(one.promise.gain_share, rel=1e-6)
    assert same.total.gain_share == pytest.approx(before.total.gain_share, rel=1e-6)
    away = poses[0] @ rigid(rotation_exp(np.array([0.0, np.pi, 0.0])), np.zeros(3))  # it turns its back
    behind = judge(office.seen, away, office.sensor)
    moved = moved_plan(office.seen, before, [away, poses[1]], [behind, judged[1]])
    assert [camera.where for camera in moved.cameras] == [BY_HAND, before.cameras[1].where]
    assert moved.cameras[0].promise == promise(behind.chance, office.seen.targets)
    alone = promise(judged[1].chance * (1.0 - behind.chance), office.seen.targets)
    assert moved.cameras[1].promise.gain_share == pytest.approx(alone.gain_share)
    assert moved.total.gain_share < before.total.gain_share
    ratio = moved.total.gain_share / before.total.gain_share
    assert moved.at_least_of_best == pytest.approx(ratio * before.at_least_of_best)
