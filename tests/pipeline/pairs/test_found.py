"""The answer on a pair and the verdict on it: bad fits, mirrored and scaled clouds, strays, start poses."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.pairs.found import find_place, judged, moved_away, settled_answer
from pipeline.pairs.register import Answer, Pair, config_for
from pipeline.registration import point_error_m
from pipeline.types import PointCloud
from tests.pipeline.pairs.rooms import room

T_TRUE = rigid(rotation_exp(np.radians(3.0) * np.array([0.6, -0.48, 0.64])), [0.03, -0.02, 0.03])
COUNT = 600
SOURCE_M, TARGET_M = apply(inverse(T_TRUE), room(1, COUNT)), room(2, COUNT)


def placed(source_m, target_m, gate_m=None, T_init=None, start="given", with_scale=False):
    config = config_for(("ceicp-a",), None, gate_m, start, with_scale)
    T_start = np.eye(4) if T_init is None else T_init
    return find_place(Pair(PointCloud(source_m), PointCloud(target_m), T_start), config, gate_m)


def answer_of(source_m, target_m, method="ceicp-a", **settings) -> Answer:
    return settled_answer(method, placed(source_m, target_m, **settings))


@pytest.fixture(scope="module")
def place():
    return placed(SOURCE_M, TARGET_M)


def test_a_good_fit_is_sure(place):
    answer = settled_answer("ceicp-a", place)
    assert answer.verdict.text == "sure"
    assert answer.way == "given"
    assert answer.draws == 4
    assert answer.spread_m < 0.01
    assert point_error_m(answer.T_target_source, T_TRUE, SOURCE_M) < 0.01


@pytest.mark.parametrize("way", [{"start": "global"}, {"gate_m": 0.3}])
def test_other_ways_end_at_the_same_place(way):
    answer = answer_of(SOURCE_M, TARGET_M, **way)
    assert answer.verdict.text == "sure"
    assert answer.way == ("surfaces" if way == {"start": "global"} else "given")
    assert point_error_m(answer.T_target_source, T_TRUE, SOURCE_M) < 0.01


@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_source_is_named(axis):
    answer = answer_of(SOURCE_M * np.where(np.arange(3) == axis, -1.0, 1.0), TARGET_M)
    assert answer.verdict.word == "doubtful"
    assert f"one cloud is mirrored, since with {'xyz'[axis]} negated the source fits" in answer.verdict.text


def test_a_scaled_source_is_named_with_a_factor_that_works():
    """The factor brings the source to the target's size."""
    answer = answer_of(1.06 * SOURCE_M, TARGET_M)
    assert answer.verdict.word == "doubtful"
    factor = float(re.search(r"the source fits if scaled by (\S+);", answer.verdict.text)[1])
    assert factor == pytest.approx(1 / 1.06, rel=0.005)
    assert f"try --scale, or multiply its metres per unit by {factor:.4g}" in answer.verdict.text
    assert answer_of(factor * 1.06 * SOURCE_M, TARGET_M).verdict.text == "sure"


def test_clouds_that_do_not_fit_are_not_sure_and_not_called_mirrored():
    rng = np.random.default_rng(3)
    answer = answer_of(rng.uniform(0.0, 2.0, (4000, 3)), TARGET_M)
    assert answer.verdict.word != "sure"
    assert "shared points lie on the other cloud's surface" in answer.verdict.text
    assert "mirrored" not in answer.verdict.text
    assert "scaled" not in answer.verdict.text


@pytest.mark.parametrize("which", ["source", "target"])
def test_a_tenth_of_strays_at_a_kilometre_changes_nothing(which):
    points_m = {"source": SOURCE_M.copy(), "target": TARGET_M.copy()}
    points_m[which][::10] += 1000.0 * np.random.default_rng(4).normal(size=points_m[which][::10].shape)
    answer = answer_of(points_m["source"], points_m["target"])
    assert answer.verdict.text == "sure"
    assert answer.spread_m < 0.01
    assert point_error_m(answer.T_target_source, T_TRUE, SOURCE_M) < 0.01


def test_an_answer_elsewhere_is_not_sure_however_well_it_fits(place):
    """No other draws of the points have been tried there."""
    found = place.found
    near = rigid(np.eye(3), [0.1, 0.0, 0.0]) @ found.candidate.T_target_source
    elsewhere = replace(place, found=replace(found, candidate=replace(found.candidate, T_target_source=near)))
    answer = judged(Answer("icp", T_TRUE, 1, "converged", 0.0), elsewhere)
    assert answer.verdict.word == "doubtful"
    assert "the search for the pose ended 10 cm away" in answer.verdict.text
    assert answer.draws == 1
    assert judged(Answer("icp", T_TRUE, 1, "converged", 0.0), place).verdict.text == "sure"


def test_an_answer_without_a_pose_has_no_verdict(place):
    nothing = Answer("icp", None, 0, "failed: no pairs", float("nan"))
    assert judged(nothing, place) is nothing


def test_it_is_said_where_to_an_answer_has_gone(place):
    """Turned about a vertical axis through the middle of the cloud, and one metre up."""
    center_m = SOURCE_M.mean(axis=0)
    turn = rotation_exp(np.radians(30.0) * np.array([0.0, 0.0, 1.0]))
    start = T_TRUE @ rigid(turn, center_m - turn @ center_m)
    text = moved_away(place.pair, start, T_TRUE)
    assert "30 degrees from the start pose of --init" in text
    away = rigid(np.eye(3), [0.0, 0.0, 1.5]) @ T_TRUE
    assert "The answer is 1.5 m and 0 degrees" in moved_away(place.pair, away, T_TRUE)
    assert moved_away(place.pair, T_TRUE, rigid(np.eye(3), [0.01, 0.0, 0.0]) @ T_TRUE) == ""


def test_a_given_start_at_the_place_is_kept_at_low_overlap():
    """A quarter of the room in common."""
    source_m, target_m = room(1, 1500), room(2, 1500)
    source_m, target_m = source_m[source_m[:, 0] < 2.4], target_m[target_m[:, 0] > 1.4]
    answer = answer_of(apply(inverse(T_TRUE), source_m), target_m, T_init=T_TRUE)
    assert point_error_m(answer.T_target_source, T_TRUE, SOURCE_M) < 0.02
