"""Motions along a bare wall by its texture, whose true motion is known."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.kernels.geometry import inverse, pixel_rays, project, rigid, rotation_angle_rad, rotation_exp
from pipeline.registration import photometric
from pipeline.registration.photometric import held_by_color, open_motions, photograph
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame

CAMERA = CameraIntrinsics.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120)
DEPTH_IN_COLOR = rigid(rotation_exp(np.array([0.0, 0.02, 0.0])), np.array([0.025, 0.0, 0.0]))
INFORMATION = np.diag([1e5, 1e5, 0.1, 0.1, 0.1, 1e6])
"""Of a registration in front of a wall: it holds two turns and the distance."""
MOTIONS = open_motions(INFORMATION)


def painted(x_m, y_m):
    """Brightness of a wall z = 2 m in the first camera, 60 to 200."""
    waves = (
        np.sin(9.0 * x_m + 4.0 * y_m)
        + np.sin(13.0 * y_m - 5.0 * x_m)
        + np.sin(21.0 * x_m) * np.cos(17.0 * y_m)
    )
    return 130.0 + 23.0 * waves


def seen(T_wall_camera, paint=painted, gain=1.0, offset=0.0, seed=0):
    """A frame of the wall, 2 m from the origin of its world, from a colour camera's pose."""
    rays = pixel_rays(CAMERA)
    along = rays @ T_wall_camera[:3, :3].T
    z_m = (2.0 - T_wall_camera[2, 3]) / along[..., 2]
    points_m = along * z_m[..., None] + T_wall_camera[:3, 3]
    grey = gain * paint(points_m[..., 0], points_m[..., 1]) + offset
    grey = grey + np.random.default_rng(seed).normal(0.0, 1.5, grey.shape)
    rgb = np.repeat(np.clip(grey, 0.0, 255.0).astype(np.uint8)[..., None], 3, axis=2)
    return RgbdFrame("wall", rgb, DepthMap(z_m.astype(np.float32)), CAMERA, T_wall_camera)


def pair(T_color, paint=painted, **light):
    """Photographs of the source and the target, and the true T_target_source of the depth cameras."""
    source = photograph(seen(T_color, paint, seed=1, **light), DEPTH_IN_COLOR)
    target = photograph(seen(np.eye(4), paint), DEPTH_IN_COLOR)
    return source, target, inverse(DEPTH_IN_COLOR) @ T_color @ DEPTH_IN_COLOR


def test_the_motions_that_surfaces_hold_are_left_out():
    assert MOTIONS.shape == (6, 3)
    np.testing.assert_allclose(MOTIONS.T @ MOTIONS, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(MOTIONS[[0, 1, 5]], 0.0, atol=1e-12)
    assert open_motions(np.diag([1e5, 1e5, 1e4, 1e4, 1e4, 1e6])).shape == (6, 0)


@pytest.mark.parametrize("light", [{}, {"gain": 0.8, "offset": 15.0}])
@pytest.mark.parametrize(
    ("turn_rad", "shift_m"), [((0.0, 0.0, 0.0), (0.04, 0.0, 0.0)), ((0.0, 0.0, -0.03), (-0.02, 0.03, 0.0))]
)
def test_a_slide_along_a_wall_is_found_in_any_light(turn_rad, shift_m, light):
    T_color = rigid(rotation_exp(np.array(turn_rad)), np.array(shift_m))
    source, target, true = pair(T_color, **light)
    found = held_by_color(
        source, target, np.eye(4), np.eye(6)[:, 2:5] if any(turn_rad) else np.eye(6)[:, 3:5]
    )
    assert found is not None
    apart = inverse(true) @ found[0]
    along_m = apart[:2, 3]  # the rest is what the surfaces must hold
    assert np.linalg.norm(along_m) < 0.002
    assert np.degrees(rotation_angle_rad(apart[:3, :3])) < 0.15


def test_a_glare_in_one_photograph_hardly_moves_the_wall():
    """Of a sixth of the image: its pixels differ by up to ten times the others' error, and weigh less."""
    T_color = rigid(np.eye(3), np.array([0.04, 0.0, 0.0]))
    rows, columns = np.mgrid[:120, :160]
    glare = 90.0 * np.exp(-((columns - 50.0) ** 2 + (rows - 60.0) ** 2) / (2.0 * 18.0**2))
    frame = seen(T_color, seed=1)
    rgb = np.clip(frame.rgb + glare[..., None], 0.0, 255.0).astype(np.uint8)
    source, target = (
        photograph(replace(frame, rgb=rgb), DEPTH_IN_COLOR),
        photograph(seen(np.eye(4)), DEPTH_IN_COLOR),
    )
    true = inverse(DEPTH_IN_COLOR) @ T_color @ DEPTH_IN_COLOR
    found = held_by_color(source, target, np.eye(4), np.eye(6)[:, 3:5])
    assert found is not None
    assert np.linalg.norm((inverse(true) @ found[0])[:2, 3]) < 0.001


def test_nothing_moves_along_the_motions_that_are_held():
    source, target, true = pair(rigid(np.eye(3), np.array([0.03, -0.02, 0.0])))
    found = held_by_color(
        source, target, true @ rigid(np.eye(3), np.array([0.0, 0.02, 0.0])), np.eye(6)[:, 4:5]
    )
    assert found is not None
    step = inverse(true) @ found[0]
    assert abs(step[1, 3]) < 0.001
    np.testing.assert_allclose(np.delete(step[:3, 3], 1), 0.0, atol=1e-9)
    np.testing.assert_allclose(step[:3, :3], np.eye(3), atol=1e-9)
    assert found[1][4, 4] > 1e3
    np.testing.assert_allclose(np.delete(found[1], 4, axis=0), 0.0, atol=1e-9)


def test_the_stated_error_is_about_the_real_one():
    start, apart, stated = np.eye(4), [], []
    for seed in range(12):
        T_color = rigid(np.eye(3), np.array([*np.random.default_rng(seed).uniform(-0.03, 0.03, 2), 0.0]))
        target = photograph(seen(np.eye(4), seed=100 + seed), np.eye(4))
        found = held_by_color(
            photograph(seen(T_color, seed=seed), np.eye(4)), target, start, np.eye(6)[:, 3:5]
        )
        assert found is not None
        apart.append((inverse(T_color) @ found[0])[:2, 3])
        stated.append(np.sqrt(np.diag(np.linalg.inv(found[1][3:5, 3:5]))))
    assert 0.2 < np.sqrt(np.mean(np.square(apart))) / np.mean(stated) < 1.5


def test_a_wall_without_texture_and_another_wall_decide_nothing():
    T_color = rigid(np.eye(3), np.array([0.03, 0.0, 0.0]))
    source, target, _ = pair(T_color, paint=lambda x_m, y_m: np.full_like(x_m, 120.0))
    assert held_by_color(source, target, np.eye(4), MOTIONS) is None
    other = photograph(seen(T_color, lambda x_m, y_m: painted(y_m + 3.0, -1.7 * x_m)), DEPTH_IN_COLOR)
    _, target, _ = pair(T_color)
    assert held_by_color(other, target, np.eye(4), MOTIONS) is None


def test_points_that_move_beyond_the_lens_are_left_out(monkeypatch):
    """A lens without an image right of x/z = 0.3, where the steps of the derivative leave it."""

    def of_a_lens(camera, points_m):
        pixels = project(camera, points_m)
        pixels[points_m[:, 0] > 0.3 * points_m[:, 2]] = np.nan
        return pixels

    monkeypatch.setattr(photometric, "project", of_a_lens)
    monkeypatch.setattr(photometric, "_TINY", 0.02)
    source, target, true = pair(rigid(np.eye(3), np.array([0.03, -0.02, 0.0])))
    T, _ = held_by_color(source, target, np.eye(4), np.eye(6)[:, 3:5])
    assert np.linalg.norm((inverse(true) @ T)[:2, 3]) < 0.002


def test_a_pose_far_from_the_start_is_not_believed(monkeypatch):
    source, target, _ = pair(rigid(np.eye(3), np.array([0.05, 0.0, 0.0])))
    assert held_by_color(source, target, np.eye(4), np.eye(6)[:, 3:5]) is not None
    monkeypatch.setattr(photometric, "FARTHEST_PX", 3.0)  # it is 3.3
    assert held_by_color(source, target, np.eye(4), np.eye(6)[:, 3:5]) is None
