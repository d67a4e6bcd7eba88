"""Answers are right within 1.5 degrees and 5 cm, and shares have Wilson's interval."""

import numpy as np
import pytest

from lab.places.colmap import with_measured_scale
from lab.places.judging import PlacesTask, judged, pose_errors, wilson
from lab.places.pairs import HELD_OUT, PlacesPair
from pipeline.kernels.geometry import apply, rigid, rotation_exp

T_TRUE = rigid(rotation_exp(np.array([0.3, -0.2, 0.5])), np.array([1.0, 2.0, 3.0]))
TASK = PlacesTask("program", HELD_OUT, 7, 0.25)


def off(deg, shift_m):
    """The true pose with an error about its source's z axis and along the target's x axis."""
    error = rigid(rotation_exp(np.radians([0.0, 0.0, deg])), np.zeros(3))
    return rigid(np.eye(3), np.array([shift_m, 0.0, 0.0])) @ T_TRUE @ error


def row(T, T_true=T_TRUE):
    return judged(TASK, PlacesPair(None, None, T_true, 0.26, 12), T, "sure", 0.5)


def test_errors_are_the_angle_and_the_distance_of_the_cameras():
    turn_deg, shift_m = pose_errors(off(40.0, -0.3), T_TRUE)
    assert turn_deg == pytest.approx(40.0)
    assert shift_m == pytest.approx(0.3)
    assert pose_errors(None, T_TRUE) == pose_errors(T_TRUE, None) == (None, None)


@pytest.mark.parametrize(
    ("deg", "shift_m", "right"), [(1.4, 0.049, True), (1.6, 0.0, False), (0.0, 0.051, False)]
)
def test_both_errors_have_to_be_small(deg, shift_m, right):
    found = row(off(deg, shift_m))
    assert found["right"] is right
    assert (found["overlap"], found["overlap_share"], found["verdict"]) == (0.25, 0.26, "sure")


def test_no_answer_and_any_answer_on_different_rooms_are_not_right():
    assert row(None)["right"] is False
    assert row(T_TRUE, None)["right"] is False


@pytest.mark.parametrize(
    ("count", "of", "interval"),
    [(0, 10, (0.0, 0.2775)), (5, 10, (0.2366, 0.7634)), (10, 10, (0.7225, 1.0)), (0, 0, (0.0, 1.0))],
)
def test_intervals_are_those_of_wilson(count, of, interval):
    assert wilson(count, of) == pytest.approx(interval, abs=1e-4)


def test_a_pose_without_a_length_gets_the_median_of_the_depths():
    """One of five matches is wrong and one has no depth."""
    source_m = np.random.default_rng(0).normal((0.0, 0.0, 3.0), 1.0, (5, 3))
    target_m = apply(T_TRUE, source_m)
    target_m[0] += 5.0
    target_m[1] = np.nan
    unit = T_TRUE.copy()
    unit[:3, 3] /= np.linalg.norm(unit[:3, 3])
    assert np.allclose(with_measured_scale(unit, source_m, target_m), T_TRUE)
    assert with_measured_scale(unit, source_m, np.full((5, 3), np.nan)) is None
