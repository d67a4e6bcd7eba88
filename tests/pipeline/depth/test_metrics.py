import math

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.depth import depth_errors


def test_a_hand_computed_map():
    truth_m = np.array([[1.0, 2.0], [4.0, np.nan]])
    errors = depth_errors(np.array([[1.0, 3.0], [2.0, 5.0]]), truth_m)
    assert errors.rmse_m == pytest.approx(math.sqrt((0 + 1 + 4) / 3))
    assert errors.abs_rel == pytest.approx((0 + 0.5 + 0.5) / 3)
    assert errors.sq_rel == pytest.approx((0 + 0.5 + 1.0) / 3)
    assert errors.rmse_log == pytest.approx(math.sqrt((math.log(1.5) ** 2 + math.log(2) ** 2) / 3))
    assert (errors.delta_1, errors.delta_2, errors.delta_3) == pytest.approx((1 / 3, 2 / 3, 2 / 3))
    mean = (math.log(1.5) - math.log(2)) / 3
    assert errors.silog == pytest.approx(math.sqrt(errors.rmse_log**2 - mean**2))


def test_a_perfect_map_has_no_error():
    z_m = np.random.default_rng(0).uniform(0.5, 5.0, (20, 30))
    errors = depth_errors(z_m, z_m)
    assert (errors.rmse_m, errors.rmse_log, errors.abs_rel, errors.sq_rel, errors.silog) == (0, 0, 0, 0, 0)
    assert (errors.delta_1, errors.delta_2, errors.delta_3) == (1, 1, 1)


def test_a_wrong_scale_alone_costs_exactly_itself_and_no_scale_invariant_error():
    truth_m = np.random.default_rng(0).uniform(0.5, 5.0, (20, 30))
    errors = depth_errors(1.3 * truth_m, truth_m)
    assert errors.abs_rel == pytest.approx(0.3)
    assert errors.rmse_log == pytest.approx(math.log(1.3))
    assert errors.silog == pytest.approx(0.0, abs=1e-12)
    assert (errors.delta_1, errors.delta_2) == (0, 1)


def test_ratio_errors_are_symmetric():
    rng = np.random.default_rng(0)
    a, b = rng.uniform(1.0, 5.0, (2, 20, 30))
    forward, backward = depth_errors(a, b), depth_errors(b, a)
    for name in ("rmse_m", "rmse_log", "delta_1", "delta_2", "delta_3", "silog"):
        assert getattr(forward, name) == pytest.approx(getattr(backward, name))


def test_depth_beyond_the_cap_or_nearer_than_ten_centimetres_does_not_count():
    truth_m = np.array([[2.0, 12.0]])
    assert depth_errors(np.array([[2.0, 1.0]]), truth_m).rmse_m == 0.0
    assert depth_errors(np.array([[2.0, 1.0]]), np.array([[2.0, 0.09]])).rmse_m == 0.0
    assert depth_errors(np.array([[2.0, 1.0]]), np.array([[2.0, 0.11]])).rmse_m > 0.6
    assert depth_errors(np.array([[2.0, 1.0]]), truth_m, cap_m=80.0).rmse_m > 7.0


@pytest.mark.parametrize(
    ("predicted", "truth", "words"),
    [
        (np.ones((2, 3)), np.ones((3, 2)), "same size"),
        (np.ones((2, 3)), np.full((2, 3), np.nan), "No pixel"),
        (-np.ones((2, 3)), np.ones((2, 3)), "No pixel"),
    ],
)
def test_what_cannot_be_compared_is_refused(predicted, truth, words):
    with pytest.raises(InputError, match=words):
        depth_errors(predicted, truth)
