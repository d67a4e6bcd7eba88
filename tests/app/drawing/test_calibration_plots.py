"""Every picture of a calibration has a title, says its units, and shows the numbers that it was given."""

import numpy as np
import pytest

from app.drawing import calibration_plots as plots
from pipeline.calibration.assess import assess
from pipeline.calibration.diagnosis import radial_curve, radial_residuals
from pipeline.calibration.estimate import calibrate, held_out
from tests.pipeline.calibration.test_trust import BOARD, SIZE, views


@pytest.fixture(scope="module")
def figures():
    given = views(0.2, 0)
    found = calibrate(given, SIZE)
    trust = assess(found, given, BOARD, 2.0, 0.005)
    return (
        found,
        trust,
        {
            "views": plots.views_figure(found.views, held_out(given, SIZE, 2), ["3"]),
            "distortion": plots.distortion_figure(radial_curve(found)),
            "residuals": plots.residuals_figure(found),
            "radius": plots.radial_residuals_figure(radial_residuals(found)),
            "uncertainty": plots.uncertainty_figure(trust.sd, SIZE),
            "difference": plots.difference_figure(trust.halves, SIZE),
            "verdict": plots.verdict_figure(trust.verdict, trust.sd, SIZE),
            "coverage": plots.coverage_figure(trust.coverage, SIZE, found.views),
            "next": plots.next_view_figure(trust.following, SIZE, found.views),
        },
    )


def test_each_says_what_it_shows_and_in_which_unit(figures):
    for name, figure in figures[2].items():
        assert figure.layout.title.text
        assert "px" in f"{figure.layout.xaxis.title.text} {figure.layout.yaxis.title.text}"
        if name in ("uncertainty", "difference", "verdict"):
            assert figure.data[0].colorbar.title.text == "mm"


def test_images_stand_upright_with_square_pixels(figures):
    for name in ("residuals", "uncertainty", "coverage", "next"):
        layout = figures[2][name].layout
        assert tuple(layout.yaxis.range) == (SIZE[1] - 0.5, -0.5)
        assert layout.yaxis.scaleanchor == "x"


def test_they_show_the_numbers(figures):
    found, trust, made = figures
    bars = made["views"].data[0]
    np.testing.assert_allclose(bars.y, [view.rms_px for view in found.views])
    assert len({bars.marker.color[3], bars.marker.color[4]}) == 2
    np.testing.assert_allclose(made["uncertainty"].data[0].z, 1000.0 * trust.sd.error_m)
    np.testing.assert_allclose(made["difference"].data[0].z, 1000.0 * trust.halves.map.error_m)
    assert np.nansum(made["coverage"].data[0].z) == sum(len(view.points_px) for view in found.views)


def test_arrows_point_from_the_prediction_to_what_was_seen(figures):
    found, _, made = figures
    times = float(made["residuals"].layout.title.text.split("drawn ")[1].split()[0])
    lines = np.column_stack([made["residuals"].data[1].x, made["residuals"].data[1].y]).reshape(-1, 3, 2)
    residuals_px = np.concatenate([view.residuals_px for view in found.views])
    np.testing.assert_allclose(lines[:, 1] - lines[:, 0], times * residuals_px, atol=1e-9)
    assert 5.0 < np.median(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)) < 30.0


def test_a_map_of_nothing_can_be_drawn(figures):
    _, trust, _ = figures
    from dataclasses import replace

    empty = replace(trust.sd, error_m=np.full_like(trust.sd.error_m, np.nan))
    assert plots.uncertainty_figure(empty, SIZE).data[0].zmax == 1.0
