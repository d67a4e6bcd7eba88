"""A camera that cannot exist is not returned, and one that can is."""

import re
from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import ReconstructionError
from pipeline.calibration.estimate import best_fit, calibrate, check_possible
from tests.pipeline.calibration.test_trust import SIZE, views

FOUND = calibrate(views(0.2, 0), SIZE)


def with_matrix(fx=600.0, fy=604.0, cx=318.0, cy=243.0):
    return replace(FOUND, matrix=np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]))


@pytest.mark.parametrize(
    ("found", "says"),
    [
        (with_matrix(fx=-47.8), "has focal lengths of -47.8 and 604 px, which must be positive"),
        (with_matrix(fy=-604.0), "has focal lengths of 600 and -604 px, which must be positive"),
        (with_matrix(fy=16429.0), "600 px along rows and 16429 px along columns, which must be alike"),
        (with_matrix(fx=863.0), "must be alike"),
        (with_matrix(cx=-3.0), "principal point at -3, 243, outside the image of 640 x 480 px"),
        (with_matrix(cy=480.0), "principal point at 318, 480, outside the image"),
        (with_matrix(cx=np.nan), "principal point"),
    ],
)
def test_an_impossible_camera_is_refused_with_what_is_wrong(found, says):
    with pytest.raises(ReconstructionError, match=re.escape(says)):
        check_possible(found)


@pytest.mark.parametrize("found", [FOUND, with_matrix(fx=840.0), with_matrix(cx=0.0, cy=479.0)])
def test_a_possible_camera_is_not(found):
    check_possible(found)


def test_an_error_over_5_px_is_no_camera_and_just_below_it_is():
    rng = np.random.default_rng(0)
    exact = views(0.0, 0)
    off_px = [rng.normal(0.0, 1.0, view.points_px.shape) for view in exact]
    for rms_px, refused in ((5.5, True), (4.5, False)):
        scale = rms_px / 2.0**0.5
        noisy = [
            replace(view, points_px=view.points_px + scale * off)
            for view, off in zip(exact, off_px, strict=True)
        ]
        found = best_fit(noisy, SIZE)
        assert (found.rms_px > 5.0) is refused
        if refused:
            with pytest.raises(
                ReconstructionError, match=r"misses the points by 5\.\d+ px \(RMS\), more than 5 px"
            ):
                check_possible(found)
        else:
            check_possible(found)
