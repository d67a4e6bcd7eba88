"""A tilted plane through every lens: its depth image gives points of the plane."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.acquisition import back_project, without_rayless
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame
from tests.pipeline.lenses import KIND, by_opencv, camera

NORMAL, AWAY_M = np.array([0.2, -0.1, 1.0]) / np.linalg.norm([0.2, -0.1, 1.0]), 1.5
PIXELS = np.stack(np.meshgrid(np.arange(320.0), np.arange(240.0)), axis=-1)


def plane_depth(intrinsics):
    """(H, W) depth of the plane NORMAL . x = AWAY_M, by OpenCV's rays; NaN behind the camera."""
    how = PIXELS.reshape(-1, 1, 2), intrinsics.matrix, intrinsics.distortion
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    undistort = cv2.fisheye.undistortPoints if intrinsics.fisheye else cv2.undistortPoints
    flat = undistort(*how, criteria=until).reshape(-1, 2)
    z_m = AWAY_M / np.column_stack([flat, np.ones(len(flat))]).dot(NORMAL)
    return np.where(z_m > 0.0, z_m, np.nan).reshape(240, 320).astype(np.float32)


def frame_of(intrinsics, z_m):
    rgb = np.random.default_rng(0).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    return RgbdFrame("node_00", rgb, DepthMap(z_m), intrinsics, np.eye(4))


@pytest.mark.parametrize("kind", KIND)
def test_the_points_are_on_the_plane_and_at_their_pixels(kind):
    frame = frame_of(camera(kind), plane_depth(camera(kind)))
    cloud = back_project(frame)
    near = cloud.points_m[:, 2] < 4.0
    assert near.sum() > 0.5 * 320 * 240
    np.testing.assert_allclose(cloud.points_m[near] @ NORMAL, AWAY_M, atol=1e-5)
    np.testing.assert_allclose(by_opencv(camera(kind), cloud.points_m), cloud.pixels, rtol=0, atol=1e-6)
    u, v = cloud.pixels.T
    np.testing.assert_array_equal(cloud.colors, frame.rgb[v, u])


def wide():
    """A fisheye that sees 90 degrees from its axis at 100 pixels from the middle of its image."""
    focal_px = 100.0 / (0.5 * np.pi)
    matrix = np.array([[focal_px, 0.0, 159.5], [0.0, focal_px, 119.5], [0.0, 0.0, 1.0]])
    return CameraIntrinsics(matrix, np.zeros(4), 320, 240, fisheye=True)


def test_pixels_at_90_degrees_or_more_give_no_point():
    frame = frame_of(wide(), np.full((240, 320), 0.5, np.float32))
    cloud = back_project(frame)
    inside = np.hypot(*(PIXELS - (159.5, 119.5)).reshape(-1, 2).T) < 100.0
    assert len(cloud) == inside.sum()
    assert np.isfinite(cloud.points_m).all()
    np.testing.assert_array_equal(np.flatnonzero(inside), cloud.pixels @ (1, 320))


def test_depth_at_pixels_without_a_ray_is_unknown():
    frame = frame_of(wide(), np.full((240, 320), 0.5, np.float32))
    known = without_rayless(frame)
    inside = np.hypot(*np.moveaxis(PIXELS - (159.5, 119.5), -1, 0)) < 100.0
    np.testing.assert_array_equal(known.depth.valid, inside)
    assert without_rayless(known) is known
    other_size = replace(frame, depth=DepthMap(np.ones((24, 32), np.float32)))
    assert without_rayless(other_size) is other_size


def test_depth_only_where_there_are_no_rays_is_a_sentence():
    z_m = np.full((240, 320), np.nan, np.float32)
    z_m[:10, :10] = 1.0
    with pytest.raises(InputError, match="no valid pixel"):
        back_project(frame_of(wide(), z_m))
