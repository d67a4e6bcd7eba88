"""What cameras see of planes: closed forms."""

import numpy as np
import pytest

from pipeline.kernels.geometry import look_at, pixel_rays, rigid, rotation_exp
from pipeline.kernels.rays import Camera, hit_depth
from pipeline.surface.quality import measure_quality
from pipeline.types import CameraIntrinsics
from tests.pipeline.surface.shapes import rectangle

CAMERA = CameraIntrinsics.pinhole(100.0, 100.0, 79.5, 59.5, 160, 120)
DISTORTED = CameraIntrinsics(CAMERA.matrix, np.array([0.18, -0.32, 0.001, -0.002, 0.05]), 160, 120)
DOWN = look_at(np.array([0.0, 0.0, 2.0]), np.zeros(3), up=np.array([0.0, 1.0, 0.0]))


@pytest.mark.parametrize("camera", [CAMERA, DISTORTED])
@pytest.mark.parametrize("tilt_rad", [0.0, 0.4])
def test_the_depth_of_a_plane_is_exact(camera, tilt_rad):
    """Depth is z, so n . (o + z R d) = c gives it for every pixel, distorted or not."""
    T = rigid(rotation_exp(np.array([tilt_rad, 0.1, 0.0])), np.zeros(3)) @ DOWN
    vertices_m, triangles = rectangle((-50, 50), (-50, 50))
    expected_m = -T[2, 3] / (pixel_rays(camera) @ T[2, :3])
    np.testing.assert_allclose(hit_depth(vertices_m, triangles, camera, T).z_m, expected_m, atol=1e-5)


def test_rays_that_miss_are_unknown():
    vertices_m, triangles = rectangle((-50, 50), (-50, 50))
    up = look_at(np.array([0.0, 0.0, 2.0]), np.array([0.0, 1.0, 3.0]))
    assert hit_depth(vertices_m, triangles, CAMERA, up).coverage == 0.0
    assert hit_depth(vertices_m, triangles[:0], CAMERA, DOWN).coverage == 0.0


def test_the_nearest_surface_is_seen():
    low, high = rectangle((-50, 50), (-50, 50)), rectangle((-50, 50), (-50, 50), z_m=0.5)
    both = np.concatenate([low[0], high[0]]), np.concatenate([low[1], high[1] + 4])
    np.testing.assert_allclose(hit_depth(*both, CAMERA, DOWN).z_m, 1.5, atol=1e-6)


@pytest.mark.parametrize("edge_px", [0.5, 40.0, 79.5, 120.25, 200.0])
def test_the_no_hit_share_of_a_half_plane_is_the_share_of_columns(edge_px):
    """The plane covers x < x_edge; the camera's u axis is x, and pixel u is missed if u > edge."""
    edge_m = (edge_px - CAMERA.cx_px) / CAMERA.fx_px * 2.0
    vertices_m, triangles = rectangle((-50, edge_m), (-50, 50))
    quality = measure_quality(vertices_m, triangles, [Camera(CAMERA, DOWN)], 4)
    assert quality.no_hit_ray_share == pytest.approx(np.mean(np.arange(160) > edge_px))


def test_the_no_hit_share_counts_the_rays_of_all_cameras():
    small = CameraIntrinsics.pinhole(50.0, 50.0, 39.5, 29.5, 80, 60)
    up = look_at(np.array([0.0, 0.0, 2.0]), np.array([0.0, 1.0, 3.0]))
    vertices_m, triangles = rectangle((-50, 50), (-50, 50))
    quality = measure_quality(vertices_m, triangles, [Camera(CAMERA, DOWN), Camera(small, up)], 4)
    assert quality.no_hit_ray_share == pytest.approx(0.2)


def test_without_cameras_the_share_is_unknown():
    assert np.isnan(measure_quality(*rectangle((0, 1), (0, 1)), [], 4).no_hit_ray_share)
