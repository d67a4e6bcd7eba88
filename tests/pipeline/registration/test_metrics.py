import numpy as np
import pytest

from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.registration import average_hausdorff_m, point_error_m, rotation_error_rad


def test_point_error_of_a_shift_is_its_length():
    points_m = np.random.default_rng(0).normal(size=(50, 3))
    shift = rigid(np.eye(3), [0.03, 0.0, -0.04])
    assert point_error_m(shift, np.eye(4), points_m) == pytest.approx(0.05)


def test_point_error_of_a_rotation_about_the_axis_of_a_circle():
    angles = np.linspace(0, 2 * np.pi, 60)
    circle_m = 2.0 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    turn = rigid(rotation_exp(np.array([0.0, 0.0, 0.1])), np.zeros(3))
    assert point_error_m(turn, np.eye(4), circle_m) == pytest.approx(2 * 2.0 * np.sin(0.05))


@pytest.mark.parametrize("angle_rad", [0.0, 1e-7, 0.5, 3.1])
def test_rotation_error_is_the_angle_between(angle_rad):
    base = rigid(rotation_exp(np.array([0.3, 0.2, -0.9])), [1.0, 2.0, 3.0])
    turned = rigid(rotation_exp(angle_rad * np.array([0.6, 0.0, 0.8])), np.zeros(3)) @ base
    assert rotation_error_rad(turned, base) == pytest.approx(angle_rad, abs=1e-12)


def test_average_hausdorff_equals_brute_force_and_is_symmetric():
    rng = np.random.default_rng(1)
    a_m, b_m = rng.normal(size=(40, 3)), rng.normal(size=(70, 3))
    gaps_m = np.linalg.norm(a_m[:, None] - b_m[None], axis=2)
    expected_m = 0.5 * (gaps_m.min(axis=1).mean() + gaps_m.min(axis=0).mean())
    assert average_hausdorff_m(a_m, b_m) == pytest.approx(expected_m)
    assert average_hausdorff_m(b_m, a_m) == average_hausdorff_m(a_m, b_m)
    assert average_hausdorff_m(a_m, a_m) == 0.0
