"""Where points are, what is left there, and how the lens bends."""

import numpy as np
import pytest

from pipeline.calibration.diagnosis import coverage, radial_curve, radial_residuals
from pipeline.calibration.estimate import calibrate
from tests.pipeline.calibration.test_trust import SIZE, views


def test_every_point_is_counted_in_its_cell():
    found = calibrate(views(0.2, 0), SIZE)
    told = coverage(found.views, SIZE)
    assert told.counts.sum() == sum(len(view.points_px) for view in found.views)
    assert (told.columns_px[0], told.columns_px[-1]) == (-0.5, SIZE[0] - 0.5)
    one = coverage(found.views[:1], SIZE)
    assert 0.0 < one.share < told.share <= 1.0
    x, y = found.views[0].points_px[0]
    column, row = np.searchsorted(told.columns_px, x) - 1, np.searchsorted(told.rows_px, y) - 1
    assert one.counts[row, column] >= 1


def test_the_curve_is_the_distortion_within_its_band():
    found = calibrate(views(0.2, 0), SIZE)
    told = radial_curve(found)
    r = np.tan(np.radians(told.angle_deg))
    true_px = 600.0 * r * (-0.12 * r**2 + 0.05 * r**4)
    seen = told.radius_px <= told.seen_to_px
    assert (
        np.abs(told.moved_px - true_px)[seen] <= 4.0 * told.sd_px[seen] + 0.01 * np.abs(true_px[seen])
    ).all()
    assert (np.diff(told.sd_px[told.radius_px > 250.0]) > 0.0).all()
    assert told.radius_px[-1] == pytest.approx(np.hypot(318.5, 243.5), abs=5.0)


def test_a_fisheye_is_drawn_against_a_lens_without_distortion_of_its_own_kind():
    given = views(0.05, 0, 16)
    found = calibrate(given, SIZE, "fisheye")
    told = radial_curve(found)
    assert abs(told.moved_px[1]) < 0.01
    assert np.isfinite(told.sd_px).all()


def test_a_lens_of_the_wrong_kind_leaves_a_wave_along_the_radius():
    given = views(0.05, 0, 16, [-0.3, 0.3, 0.0, 0.0, -2.0])
    wrong, right = (radial_residuals(calibrate(given, SIZE, lens)) for lens in ("thesis", "brown"))
    scores = [np.nanmax(np.abs(told.mean_px / told.sd_of_mean_px)) for told in (wrong, right)]
    assert scores[0] > 5.0
    assert scores[1] < 4.0
