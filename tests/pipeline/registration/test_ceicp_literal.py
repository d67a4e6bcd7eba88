"""The thesis's own formula, its unit, and what the unit does to it (SPEC 4.3)."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse
from pipeline.registration import point_error_m, register
from pipeline.registration.ceicp_literal import CeicpLiteral, density_information
from pipeline.registration.residual import DegenerateError
from pipeline.types import PointCloud
from tests.pipeline.registration.pairs import pairs_at

LITERAL = RegistrationConfig("ceicp-literal", "point")


def test_weights_follow_the_formula_in_the_unit():
    distances_m = np.array([0.0, 0.004, 0.01, 0.03, 0.5])
    kept = CeicpLiteral(0.3, "mm").weigh(pairs_at(distances_m))
    d = 1000.0 * distances_m[:4]
    sigma = np.std(d, ddof=1)
    f = np.exp(-((d - d.mean()) ** 2) / (2 * sigma**2)) / (sigma * np.sqrt(2 * np.pi))
    w = -f * np.log(f)
    assert kept.rows.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(kept.weights, w / w.sum(), rtol=1e-12)
    assert kept.sigma_m == pytest.approx(sigma / 1000.0)


def test_a_perfect_pair_weighs_less_than_one_at_the_mean():
    """Resolution 7: f is centred on the mean distance, not on zero."""
    weights, _ = density_information(np.array([0.0, 10.0, 20.0]))
    assert weights[0] == pytest.approx(weights[2])
    assert weights[0] < weights[1]


def test_a_pair_too_far_to_have_any_density_weighs_nothing():
    near_m = 0.005 + 5e-4 * np.random.default_rng(0).normal(size=3000)
    kept = CeicpLiteral(0.4, "mm").weigh(pairs_at(np.append(near_m, 0.3)))
    assert kept.weights[-1] == 0.0
    assert kept.weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("sigma", "positive"), [(0.398, False), (0.400, True)])
def test_weights_turn_negative_below_0_399_units(sigma, positive):
    weights, fitted = density_information(5.0 + _with_deviation(sigma))
    assert fitted == pytest.approx(sigma)
    assert (weights >= 0.0).all() == positive


def _with_deviation(sigma):
    """Numbers around zero with this sample standard deviation, one of them at the density's peak."""
    values = np.linspace(-1.0, 1.0, 101)
    return sigma * values / np.std(values, ddof=1)


def test_metres_are_refused_with_the_reason(halves):
    source, target, _ = halves
    with pytest.raises(InputError, match=r"cannot weigh in metres.*f is a density.*try unit=mm\.$"):
        register(source, target, replace(LITERAL, unit="m"))


def test_millimetres_work(halves):
    source, target, T = halves
    result = register(source, target, LITERAL)
    assert result.converged
    assert point_error_m(result.T_target_source, T, source.points_m) < 0.006
    assert point_error_m(np.eye(4), T, source.points_m) > 0.03


def test_millimetres_end_where_the_density_exceeds_one(corner, motion):
    """Identical clouds draw nearer than 0.4 mm, where log f changes sign: the last good pose stays."""
    result = register(corner.transformed(inverse(motion)), corner, LITERAL)
    assert result.stop_reason.startswith("degenerate: the distances' standard deviation")
    assert "below 0.399 mm" in result.stop_reason
    assert point_error_m(result.T_target_source, motion, corner.points_m) < 0.002
    with pytest.raises(DegenerateError, match="f is a density"):
        CeicpLiteral(0.3, "mm").weigh(pairs_at(np.zeros(10)))


@pytest.mark.parametrize("method", ["ceicp-literal", "ceicp-n", "ceicp-a", "ceicp-r"])
def test_only_the_literal_answer_depends_on_the_unit(halves, method):
    """Both clouds and T_d times 1000, the program's numbers taken for millimetres."""
    source, target, _ = halves
    config = RegistrationConfig(method, "point", max_iterations=10)
    result = register(source, target, config)
    scaled = register(
        PointCloud(1000.0 * source.points_m),
        PointCloud(1000.0 * target.points_m),
        replace(config, gate_m=1000.0 * config.gate_m),
    )
    difference = np.abs(scaled.T_target_source[:3, :3] - result.T_target_source[:3, :3]).max()
    if method == "ceicp-literal":
        assert difference > 1e-5
    else:
        assert difference < 1e-9
