"""Holes as a person counts them."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.kernels.rays import Camera
from pipeline.surface.gaps import LARGE_M2, gaps_of
from pipeline.types import CameraIntrinsics, DepthMap

CAMERA = Camera(CameraIntrinsics.pinhole(100.0, 100.0, 39.5, 29.5, 80, 60), np.eye(4))
"""At 2 m one of its pixels is 2 cm wide: 4 cm²."""


def seen(*holes):
    """A wall 2 m away with holes, each as slices of rows and columns."""
    z_m = np.full((60, 80), 2.0, np.float32)
    for hole in holes:
        z_m[hole] = np.nan
    return DepthMap(z_m)


def test_a_whole_wall_has_none():
    found = gaps_of([seen()], [CAMERA])
    assert (found.count, found.large, found.area_m2) == (0, 0, 0.0)


def test_every_patch_counts_whatever_its_size_and_its_area_is_that_of_its_pixels():
    found = gaps_of([seen(np.s_[10:20, 10:30], np.s_[40:41, 40:41])], [CAMERA])
    assert (found.count, found.large) == (2, 1)
    assert found.area_m2 == pytest.approx(201 * 0.02**2)
    assert 200 * 0.02**2 > LARGE_M2 > 0.02**2


def test_a_hole_that_two_cameras_see_counts_twice():
    one = seen(np.s_[10:20, 10:30])
    found = gaps_of([one, one], [CAMERA, CAMERA])
    assert (found.count, found.area_m2) == (2, pytest.approx(400 * 0.02**2))


def test_filling_the_middle_of_a_hole_leaves_more_holes_of_less_area():
    before = gaps_of([seen(np.s_[10:40, 10:40])], [CAMERA])
    seam = [np.s_[10:40, 10:11], np.s_[10:40, 39:40], np.s_[10:11, 12:38], np.s_[39:40, 12:38]]
    after = gaps_of([seen(*seam)], [CAMERA])
    assert (before.count, after.count) == (1, 4)
    assert after.area_m2 < 0.2 * before.area_m2


def test_where_nothing_is_seen_nothing_can_be_counted():
    found = gaps_of([DepthMap(np.full((60, 80), np.nan, np.float32))], [CAMERA])
    assert (found.count, found.area_m2) == (0, 0.0)
