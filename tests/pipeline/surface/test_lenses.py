"""Meshes seen through every lens: textures, shares of rays and gaps."""

import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, look_at, pixel_rays
from pipeline.kernels.rays import Camera, hit_depth
from pipeline.registration.visibility import hidden_from
from pipeline.surface.pictures import MISSED, mesh_picture
from pipeline.surface.quality import measure_quality
from pipeline.surface.ray_parts import View, ray_parts
from pipeline.surface.texture import photographed
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud, Surface
from tests.pipeline.lenses import KIND, by_opencv, camera
from tests.pipeline.surface.shapes import rectangle

POSE = look_at((0.2, -1.5, 1.1), (0.0, 0.0, 1.0))
STEPS = np.linspace(0.0, 1.0, 21)


def wall():
    """A wall at y = 0 of 2 x 400 triangles, 1.6 m wide and 1.2 m high."""
    places = np.stack(np.meshgrid(STEPS, STEPS, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices_m = np.column_stack([1.6 * places[:, 0] - 0.8, np.zeros(len(places)), 0.4 + 1.2 * places[:, 1]])
    first = (np.arange(20)[:, None] * 21 + np.arange(20)).reshape(-1)
    a, b, c, d = first, first + 21, first + 22, first + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Surface(vertices_m, triangles.astype(np.int32))


def painting(points_m):
    """(..., 3) colours of the wall: they change slowly and repeat nowhere."""
    x, z = points_m[..., 0] + 1.0, points_m[..., 2]
    return np.clip(np.stack([40 + 80 * x, 60 + 60 * z, 220 - 50 * x * z], axis=-1), 0, 255).astype(np.uint8)


def photograph(intrinsics):
    """The wall's plane, whose points are found by rays, as ``tests/pipeline/kernels/test_lens.py`` checks."""
    rays = pixel_rays(intrinsics) @ POSE[:3, :3].T
    return painting(POSE[:3, 3] + rays * (-POSE[1, 3] / rays[..., 1])[..., None])


@pytest.mark.parametrize("kind", KIND)
def test_a_vertex_has_the_pixel_that_opencv_gives_it_and_its_colour(kind):
    texture = photographed(wall(), [Camera(camera(kind), POSE)], [(photograph(camera(kind)), None)])
    pixels = by_opencv(camera(kind), apply(inverse(POSE), wall().vertices_m))
    height, width = texture.image.shape[:2]
    np.testing.assert_allclose(texture.uv[0] * (width, height), pixels + 0.5, atol=1e-3)
    seen = np.unique(wall().triangles[texture.camera == 0])
    assert len(seen) > 300
    column, row = np.rint(pixels[seen]).astype(int).T
    np.testing.assert_allclose(
        texture.image[row, column].astype(float), painting(wall().vertices_m[seen]), atol=4.0
    )


def half_sphere():
    """A fisheye in whose corners there are no rays: 90 degrees are 100 pixels from the middle."""
    focal_px = 100.0 / (0.5 * np.pi)
    matrix = np.array([[focal_px, 0.0, 159.5], [0.0, focal_px, 119.5], [0.0, 0.0, 1.0]])
    return CameraIntrinsics(matrix, np.zeros(4), 320, 240, fisheye=True)


DOWN = look_at(np.array([0.0, 0.0, 2.0]), np.zeros(3), up=np.array([0.0, 1.0, 0.0]))
FLOOR = rectangle((-5e4, 5e4), (-5e4, 5e4))


def test_pixels_without_a_ray_are_no_holes():
    """A floor without end fills the half sphere below the camera; then all that has a ray is seen."""
    seen = Camera(half_sphere(), DOWN)
    quality = measure_quality(*FLOOR, [seen], 4, source=np.ones(4, np.uint8))
    assert quality.no_hit_ray_share < 0.001
    assert quality.guessed_ray_share > 0.999
    assert quality.gaps is not None
    assert quality.gaps.large == 0
    depth = hit_depth(*FLOOR, half_sphere(), DOWN)
    np.testing.assert_allclose(depth.z_m[depth.valid], 2.0, rtol=1e-4)
    share = 100.0**2 * np.pi / (320 * 240)
    assert depth.coverage == pytest.approx(share, abs=0.002)


def test_half_a_floor_is_half_of_the_rays_of_a_fisheye():
    half = rectangle((-5e4, 0.0), (-5e4, 5e4))
    quality = measure_quality(*half, [Camera(half_sphere(), DOWN)], 4)
    assert quality.no_hit_ray_share == pytest.approx(0.5, abs=0.005)
    surface = Surface(*half)
    parts = ray_parts(surface, [View(Camera(half_sphere(), DOWN), np.ones((240, 320), bool), None)])
    values = [getattr(parts, name) for name in parts.__dataclass_fields__]
    assert values[0] == pytest.approx(0.5, abs=0.005)
    assert sum(values) == pytest.approx(1.0)


def test_a_picture_shows_nothing_where_there_are_no_rays():
    picture = mesh_picture(Surface(*FLOOR), Camera(half_sphere(), DOWN))
    assert (picture[0, 0] == MISSED).all()
    assert (picture[120, 160] != MISSED).any()


@pytest.mark.parametrize("kind", KIND)
def test_a_point_on_what_a_camera_measured_is_not_hidden_from_it(kind):
    surface = wall()
    depth = hit_depth(surface.vertices_m, surface.triangles, camera(kind), POSE)
    cloud = PointCloud(surface.vertices_m * 0.9 + (0.0, 0.0, 0.1))
    pixels = by_opencv(camera(kind), apply(inverse(POSE), cloud.points_m))
    inside = np.all((pixels > 1) & (pixels < (318, 238)), axis=1)
    hidden = hidden_from(cloud, inverse(POSE), camera(kind), depth)
    assert not hidden[inside].any()
    behind = PointCloud(cloud.points_m + np.array([0.0, 0.5, 0.0]))
    assert hidden_from(behind, inverse(POSE), camera(kind), depth).all()


def test_points_beyond_the_range_of_a_lens_are_hidden_and_have_no_texture():
    """With k1 = -1 / 3 the lens folds at a radius of 1; the wall's ends are beyond it."""
    pinhole = CameraIntrinsics.pinhole(150.0, 150.0, 159.5, 119.5, 320, 240)
    folding = CameraIntrinsics(pinhole.matrix, np.array([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0]), 320, 240)
    near = look_at((0.0, -0.6, 1.0), (0.0, 0.0, 1.0))
    own_m = apply(inverse(near), wall().vertices_m)
    beyond = np.hypot(own_m[:, 0], own_m[:, 1]) > own_m[:, 2]
    assert 0.1 < beyond.mean() < 0.9
    depth = DepthMap(np.full((240, 320), 0.6, np.float32))
    assert hidden_from(PointCloud(wall().vertices_m), inverse(near), folding, depth)[beyond].all()
    texture = photographed(wall(), [Camera(folding, near)], [(np.zeros((240, 320, 3), np.uint8), None)])
    outside = beyond[wall().triangles].any(axis=1)
    assert (texture.camera[outside] == -1).all()
    assert (texture.camera[~outside] == 0).any()
