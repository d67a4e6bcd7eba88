"""The speed benchmark asks everyone the same question and knows the answer."""

import numpy as np
import pytest

from lab.benchmarks import Benchmark
from lab.benchmarks.registration import GATE_M, POINTS, speed_pair, thinned
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import rotation_angle_rad
from pipeline.registration import point_error_m, register


@pytest.fixture(scope="module")
def pair():
    return speed_pair()


def test_the_pair_has_exactly_the_points_and_the_motion_it_promises(pair):
    assert len(pair.source) == len(pair.target) == POINTS == 100_000
    assert np.degrees(rotation_angle_rad(pair.T_true[:3, :3])) == pytest.approx(6.0)
    assert np.linalg.norm(pair.T_true[:3, 3]) == pytest.approx(0.13, abs=0.005)


def test_ours_answers_it(pair):
    result = register(pair.source, pair.target, RegistrationConfig(gate_m=GATE_M))
    assert result.converged
    assert point_error_m(result.T_target_source, pair.T_true, pair.source.points_m) < 0.01


def test_thinned_clouds_are_the_points_that_ours_uses(pair):
    thin = thinned(pair)
    assert len(thin.source) == RegistrationConfig().max_points
    config = RegistrationConfig(gate_m=GATE_M)
    np.testing.assert_array_equal(
        register(thin.source, thin.target, config).T_target_source,
        register(pair.source, pair.target, config).T_target_source,
    )


def test_the_ratio_is_over_the_fastest_peer():
    record = Benchmark(2.0, {"slow": 8.0, "fast": 4.0}, 10).record()
    assert record["ratio"] == 0.5
    assert record["ratios"] == {"slow": 0.25, "fast": 0.5}
    assert Benchmark(2.0, {}, 10).record()["ratio"] is None
