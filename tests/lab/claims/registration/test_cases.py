"""Every condition is what its name says, and the same every time."""

import numpy as np
import pytest

from lab.claims.registration.cases import CONDITIONS, Condition, make_case, wrong_start
from pipeline.kernels.geometry import apply, inverse
from pipeline.registration import point_error_m, rotation_error_rad

ROOM = 2000


@pytest.mark.parametrize("name", ["easy", "nodes-fused", "overlap-30"])
def test_a_case_repeats(name):
    first, again = (make_case(CONDITIONS[name], ROOM) for _ in range(2))
    np.testing.assert_array_equal(first.source.points_m, again.source.points_m)
    np.testing.assert_array_equal(first.target.points_m, again.target.points_m)
    np.testing.assert_array_equal(first.T_init, again.T_init)


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=list(CONDITIONS))
def test_the_start_is_as_far_off_as_the_condition_says(condition):
    case = make_case(condition, ROOM)
    assert np.degrees(rotation_error_rad(case.T_init, case.T_true)) == pytest.approx(condition.start_deg)
    center_m = case.source.points_m.mean(axis=0, keepdims=True)
    shift_m = np.linalg.norm(apply(case.T_init - case.T_true, center_m))
    assert shift_m == pytest.approx(condition.start_m)


@pytest.mark.parametrize("name", [name for name in CONDITIONS if name.startswith("overlap")])
def test_the_overlap_series_has_its_overlap(name):
    assert make_case(CONDITIONS[name], ROOM).overlap == pytest.approx(CONDITIONS[name].overlap, abs=0.03)


def test_holes_are_three_times_as_large():
    pixels = 320 * 240
    easy, holed = (make_case(CONDITIONS[name], ROOM) for name in ("easy", "holes-x3"))
    assert pixels - len(holed.target) == pytest.approx(3 * (pixels - len(easy.target)), rel=0.01)
    assert len(holed.source) == len(easy.source) == pixels


def test_bias_bends_the_complete_cloud_only():
    easy, biased = (make_case(CONDITIONS[name], ROOM) for name in ("easy", "bias-6"))
    np.testing.assert_array_equal(easy.target.points_m, biased.target.points_m)
    relative = np.log(biased.source.points_m[:, 2] / easy.source.points_m[:, 2])
    assert relative.std() == pytest.approx(0.06, rel=1e-6)


def test_a_complete_cloud_without_bias_lies_on_the_sensor_cloud():
    case = make_case(CONDITIONS["easy"], ROOM)
    assert case.overlap > 0.85
    np.testing.assert_array_equal(case.T_true, np.eye(4))


def test_outliers_are_a_fifth_of_the_sensor_cloud():
    easy, worse = (make_case(CONDITIONS[name], ROOM) for name in ("easy", "outliers-20"))
    assert np.mean(np.any(easy.target.points_m != worse.target.points_m, axis=1)) == pytest.approx(
        0.2, abs=1e-4
    )


def test_two_nodes_meet_at_the_true_pose_and_not_at_the_start():
    case = make_case(CONDITIONS["nodes-sensor"], ROOM)
    start_m = point_error_m(case.T_init, case.T_true, case.source.points_m)
    assert 0.5 < case.overlap < 0.9
    assert 0.06 < start_m < 0.2


def test_a_gate_is_as_wide_as_the_start_needs():
    assert Condition("a", "a", "sensor").gate_m == 0.3
    assert Condition("a", "a", "sensor", start_m=0.3).gate_m == 0.6


def test_thinning_takes_random_points_of_both_clouds():
    case = make_case(CONDITIONS["nodes-sensor"], ROOM)
    thin = case.thinned(500)
    assert len(thin.source) == len(thin.target) == 500
    whole = set(map(bytes, case.source.points_m))
    assert all(bytes(point) in whole for point in thin.source.points_m)


def test_wrong_starts_point_every_way():
    rng = np.random.default_rng(0)
    points_m = rng.normal(size=(50, 3))
    T_true = inverse(wrong_start(np.eye(4), points_m, 20.0, 1.0, rng))
    shifts_m = np.array(
        [
            apply(wrong_start(T_true, points_m, 0.0, 0.5, rng) - T_true, points_m).mean(axis=0)
            for _ in range(200)
        ]
    )
    np.testing.assert_allclose(np.linalg.norm(shifts_m, axis=1), 0.5)
    assert np.linalg.norm(shifts_m.mean(axis=0)) < 0.1
