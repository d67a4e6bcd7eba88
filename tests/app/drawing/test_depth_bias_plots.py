"""Pictures of a depth sensor's bias: titles, units, and the numbers that were found."""

import numpy as np
import pytest

from app.drawing.depth_bias_plots import (
    bias_curve,
    bias_figure,
    bias_map_figure,
    depth_bias_figures,
    noise_figure,
)
from pipeline.calibration.depth_bias import fit_depth
from pipeline.io.depth_correction import DepthCorrection
from tests.pipeline.calibration.depth_views import SIZE, quick_samples

LINEAR = DepthCorrection(SIZE, 0.03, 1.01)


@pytest.fixture(scope="module")
def fit():
    return fit_depth(quick_samples(LINEAR, seed=0))


def test_the_curve_runs_through_the_measured_views_and_tells_its_interval_in_millimetres(fit):
    figure = bias_figure(bias_curve(fit, to_m=4.0))
    assert "mm" in figure.layout.yaxis.title.text
    assert "m" in figure.layout.xaxis.title.text
    band, curve, before, after, *noise = figure.data
    expected_mm = -1000.0 * (0.03 + 0.01 * np.array(curve.x))
    half_mm = np.array(band.y)[: len(curve.x)] - np.array(curve.y)
    assert (np.abs(np.array(curve.y) - expected_mm) <= 1.6 * np.abs(half_mm) + 0.1).all()
    assert np.mean(np.abs(after.y)) < 0.1 * np.mean(np.abs(before.y))
    law_mm = 1000.0 * fit.correction.noise.sd_m(np.array(curve.x), np.ones(len(curve.x)))
    np.testing.assert_allclose([line.y for line in noise], np.outer((-1.96, 1.96), law_mm))
    assert "no views" in [note.text for note in figure.layout.annotations]


def test_the_noise_is_drawn_with_its_points(fit):
    figure = noise_figure(fit)
    assert "mm" in figure.layout.yaxis.title.text
    points, straight, tilted = figure.data
    assert len(points.x) == len(fit.noise_points.sd_m)
    assert (np.array(tilted.y) > np.array(straight.y)).all()


def test_the_map_stands_upright_and_is_white_where_the_sensor_is_right(fit):
    figure = bias_map_figure(fit, at_m=1.0)
    assert tuple(figure.layout.yaxis.range) == (SIZE[1] - 0.5, -0.5)
    shown = figure.data[0]
    assert shown.zmin == -shown.zmax
    true_m = fit.correction.corrected_m(np.array([1.0]), np.array([[0, 0]]))[0]
    assert shown.z[0][0] == pytest.approx(1000.0 * (1.0 - true_m))
    assert set(depth_bias_figures(fit)) == {"bias", "noise"}
