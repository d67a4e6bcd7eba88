"""Depth against analytic planes and spheres; light, shade and determinism of the photographs."""

from dataclasses import fields, replace

import numpy as np
import pytest

from lab.worlds.primitives import box, sphere
from lab.worlds.render import Renderer, render
from lab.worlds.scene import Light, Material, Part, Scene
from lab.worlds.textures import solid
from pipeline.kernels.geometry import look_at, pixel_rays, rigid, scaled
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics(
    np.array([[262.5, 0.0, 150.0], [0.0, 260.0, 125.0], [0.0, 0.0, 1.0]]),
    np.array([0.1, -0.05, 0.002, -0.001, 0.0]),
    320,
    240,
)
SMALL = CameraIntrinsics.pinhole(65.6, 65.6, 39.5, 29.5, 80, 60)
EYE = look_at((0.3, -2.0, 1.2), (0.0, 0.5, 0.0))
GREY = Material(solid((0.5, 0.5, 0.5)))
LAMP = Light(np.array([-1.5, 0.0, 2.0]), np.full(3, 4.0), 0.1)


def _scene(*parts: Part, lights: tuple[Light, ...] = (LAMP,)) -> Scene:
    return Scene("test", parts, lights, np.full(3, 0.2), (EYE,), SMALL)


def _floor(material: Material = GREY) -> Part:
    return Part(*box((40.0, 40.0, 0.2)), material, rigid(np.eye(3), np.array([0.0, 0.0, -0.1])))


def _block(material: Material = GREY) -> Part:
    return Part(*box((0.3, 0.3, 1.0)), material, rigid(np.eye(3), np.array([0.0, 0.3, 0.5])))


def test_depth_of_a_plane_is_exact_through_a_distorted_lens() -> None:
    z_m = Renderer(_scene(_floor())).depth(CAMERA, EYE)
    directions = pixel_rays(CAMERA) @ EYE[:3, :3].T
    expected = np.where(directions[..., 2] < 0.0, -EYE[2, 3] / directions[..., 2], np.inf)
    near = expected < 8.0
    assert near.mean() > 0.5
    assert z_m[near] == pytest.approx(expected[near], rel=1e-5)


def test_depth_of_a_sphere_lies_within_its_facets() -> None:
    radius, segments = 0.5, 256
    T = rigid(np.eye(3), np.array([0.0, 0.0, 0.4]))
    z_m = Renderer(_scene(Part(*sphere(radius, segments), GREY, T, smooth=True))).depth(CAMERA, EYE)
    d = pixel_rays(CAMERA) @ EYE[:3, :3].T
    o = EYE[:3, 3] - T[:3, 3]
    a, b, c = (d * d).sum(-1), (d * o).sum(-1), o @ o - radius**2
    root = b * b - a * c
    solid_hit = root > 0.02 * b * b
    expected = (-b - np.sqrt(np.maximum(root, 0.0))) / a
    sagitta_m = radius * (1.0 - np.cos(np.pi / segments)) * 2.0
    assert np.all(np.isnan(z_m[root < 0.0]))
    assert np.all(np.isfinite(z_m[solid_hit]))
    deviation = z_m[solid_hit] - expected[solid_hit]
    assert deviation.min() > -1e-5
    assert deviation.max() < 8.0 * sagitta_m


def test_view_depth_and_normals_belong_to_the_pixel_centres() -> None:
    scene = _scene(_floor(), _block())
    view = render(scene, SMALL, EYE, "photo", np.random.default_rng(0))
    assert view.rgb.shape == (60, 80, 3)
    assert view.rgb.dtype == np.uint8
    assert view.z_m.dtype == np.float32
    np.testing.assert_array_equal(view.z_m, Renderer(scene).depth(SMALL, EYE))
    seen = np.isfinite(view.z_m)
    assert np.linalg.norm(view.normals[seen], axis=1) == pytest.approx(1.0, abs=1e-5)
    towards = np.einsum("hwk,hwk->hw", view.normals, pixel_rays(SMALL) @ EYE[:3, :3].T)
    assert np.all(towards[seen] < 0.0)


@pytest.mark.parametrize("quality", ["fast", "photo"])
def test_same_seed_same_bits_and_another_seed_another_grain(quality: str) -> None:
    scene = _scene(_floor(), _block())
    first, again, other = (render(scene, SMALL, EYE, quality, np.random.default_rng(s)) for s in (1, 1, 2))
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(again, field.name))
    assert np.any(first.rgb != other.rgb)
    np.testing.assert_array_equal(first.z_m, other.z_m)


def test_thread_count_does_not_change_the_picture() -> None:
    scene = _scene(_floor(), _block())
    one, all_ = (Renderer(scene, t).view(SMALL, EYE, "fast", np.random.default_rng(0)) for t in (1, 0))
    np.testing.assert_array_equal(one.rgb, all_.rgb)


def test_shadow_falls_away_from_the_lamp() -> None:
    """The lamp hangs at -x; a block at the middle shades the floor at +x only."""
    view = render(_scene(_floor(), _block()), CAMERA, EYE, "photo", np.random.default_rng(0))
    points = pixel_rays(CAMERA) * view.z_m[..., None] @ EYE[:3, :3].T + EYE[:3, 3]
    floor = (np.abs(points[..., 2]) < 1e-3) & (np.abs(points[..., 1] - 0.3) < 0.1)
    light = view.rgb.mean(axis=-1)
    lit = light[floor & (np.abs(points[..., 0] + 0.6) < 0.2)].mean()
    shaded = light[floor & (np.abs(points[..., 0] - 0.35) < 0.1)].mean()
    assert shaded < 0.7 * lit


def test_parts_that_glow_do_not_shade() -> None:
    glass = replace(GREY, emission=0.01)
    shaded, glowing = (
        render(_scene(_floor(), _block(m)), CAMERA, EYE, "fast", np.random.default_rng(0))
        for m in (GREY, glass)
    )
    points = pixel_rays(CAMERA) * shaded.z_m[..., None] @ EYE[:3, :3].T + EYE[:3, 3]
    behind = (np.abs(points[..., 2]) < 1e-3) & (np.abs(points[..., :2] - [0.35, 0.3]) < 0.1).all(axis=-1)
    assert glowing.rgb[behind].mean() > 1.3 * shaded.rgb[behind].mean()


def test_reflectance_maps_come_from_the_materials() -> None:
    shiny = Material(solid((0.2, 0.2, 0.2)), gloss=0.8, infrared=0.5)
    view = render(_scene(_floor(), _block(shiny)), SMALL, EYE, "fast", np.random.default_rng(0))
    on_block = view.gloss > 0.5
    assert on_block.mean() > 0.02
    assert view.gloss[on_block] == pytest.approx(0.8)
    assert view.infrared[on_block] == pytest.approx(0.1, abs=1e-6)
    assert view.infrared[~on_block & np.isfinite(view.z_m)] == pytest.approx(0.5, abs=1e-6)


def test_scaled_camera_sees_the_same_directions() -> None:
    half = scaled(CAMERA, 0.5)
    full_corners = pixel_rays(replace(CAMERA, distortion=np.zeros(5)))
    centre_of_four = 0.25 * (
        full_corners[::2, ::2] + full_corners[1::2, ::2] + full_corners[::2, 1::2] + full_corners[1::2, 1::2]
    )
    np.testing.assert_allclose(pixel_rays(replace(half, distortion=np.zeros(5))), centre_of_four, atol=1e-12)
