"""The depth sensor's noise, steps and holes, on surfaces whose depth is known."""

from dataclasses import replace

import numpy as np
import pytest

from lab.worlds import box_room, render
from lab.worlds.render import View
from lab.worlds.sensor import SensorConfig, axial_sigma_m, projector_shadow, sense_depth
from pipeline.kernels.geometry import pixel_rays
from pipeline.types import CameraIntrinsics, FloatArray

CAMERA = CameraIntrinsics.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
CLEAN = SensorConfig(blob_share=0.0, border_px=(0.0, 0.0, 0.0, 0.0), mirror_deg=1e-6, flying_share=0.0)
FINE = replace(CLEAN, disparity_step_px=1e-6)


def _wall(z_m: float | FloatArray, albedo: float = 0.5, gloss: float = 0.0, tilt_rad: float = 0.0) -> View:
    """A view of surfaces that face the camera, or are tilted about its x axis."""
    shape = (CAMERA.height_px, CAMERA.width_px)
    normals = np.broadcast_to([0.0, np.sin(tilt_rad), -np.cos(tilt_rad)], (*shape, 3))
    depth = np.broadcast_to(np.asarray(z_m, np.float32), shape)
    flat = np.zeros((*shape, 3), np.uint8)
    return View(flat, depth, normals, np.full(shape, albedo), np.full(shape, gloss), np.eye(4))


def _sense(view: View, config: SensorConfig = CLEAN, seed: int = 0) -> FloatArray:
    return sense_depth(view, CAMERA, np.random.default_rng(seed), config).z_m


@pytest.mark.parametrize("z_m", [0.8, 1.5, 2.5, 3.5])
def test_noise_has_the_stated_spread_and_no_bias(z_m: float) -> None:
    error = _sense(_wall(z_m), FINE) - z_m
    error = error[np.isfinite(error)]
    sigma = axial_sigma_m(np.array(z_m))
    assert sigma == pytest.approx(0.0012 + 0.0019 * (z_m - 0.4) ** 2, rel=1e-12)
    assert len(error) > 300_000
    assert error.std() == pytest.approx(sigma, rel=0.01)
    assert abs(error.mean()) < 5.0 * sigma / np.sqrt(len(error)) + 1e-6


def test_disparity_comes_in_eighths_of_a_pixel() -> None:
    slope = np.linspace(0.6, 4.0, CAMERA.width_px, dtype=np.float32)[None]
    z_m = _sense(_wall(slope))
    eighths = 525.0 * 0.075 / z_m[np.isfinite(z_m)].astype(np.float64) * 8.0
    np.testing.assert_allclose(eighths, np.rint(eighths), atol=1e-4)


def test_steps_are_those_of_the_full_size_image_at_any_size() -> None:
    half = CameraIntrinsics.pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)
    full = _wall(2.0)
    view = View(
        *(getattr(full, n)[::2, ::2] for n in ("rgb", "z_m", "normals", "infrared", "gloss")), np.eye(4)
    )
    z_m = sense_depth(view, half, np.random.default_rng(0), CLEAN).z_m
    eighths = 525.0 * 0.075 / z_m[np.isfinite(z_m)].astype(np.float64) * 8.0
    np.testing.assert_allclose(eighths, np.rint(eighths), atol=1e-4)


def test_shadow_is_left_of_things_and_as_wide_as_the_difference_of_disparities() -> None:
    z_m = np.full((40, 640), 3.0)
    z_m[:, 300:400] = 1.0
    shadow = projector_shadow(z_m, 525.0 * 0.075, 1.0)
    width_px = 525.0 * 0.075 * (1.0 / 1.0 - 1.0 / 3.0)
    columns = np.flatnonzero(shadow.any(axis=0))
    assert columns.max() == 299
    assert len(columns) == pytest.approx(width_px, abs=1.0)
    assert np.all(np.diff(columns) == 1)
    assert np.all(shadow[:, columns])


def test_a_thin_pole_does_not_shade_what_the_projector_sees_beside_it() -> None:
    """Disparities 39.4 and 13.1: the 4-pixel pole hides columns 273.75 to 277.75 and not those next to it."""
    z_m = np.full((4, 640), 3.0)
    z_m[:, 300:304] = 1.0
    columns = np.flatnonzero(projector_shadow(z_m, 525.0 * 0.075, 1.0).all(axis=0))
    assert 2 <= len(columns) <= 5
    assert columns.min() >= 273
    assert columns.max() <= 278


def test_nothing_is_reported_beyond_the_range() -> None:
    slope = np.linspace(0.2, 6.0, CAMERA.width_px, dtype=np.float32)[None]
    z_m = _sense(_wall(slope), SensorConfig())
    seen = z_m[np.isfinite(z_m)]
    assert seen.min() >= 0.4
    assert seen.max() <= 4.5


def test_no_light_returns_from_black_mirrors_and_steep_surfaces() -> None:
    covered = {
        "plain": np.isfinite(_sense(_wall(1.5))).mean(),
        "black": np.isfinite(_sense(_wall(1.5, albedo=0.001))).mean(),
        "mirror": np.isfinite(_sense(_wall(1.5, gloss=0.97))).mean(),
        "steep": np.isfinite(_sense(_wall(1.5, tilt_rad=np.radians(88.0))))[240].mean(),
    }
    assert covered["plain"] > 0.999
    assert max(covered["black"], covered["mirror"], covered["steep"]) < 0.02


def test_shiny_surfaces_blind_the_camera_where_they_look_straight_back() -> None:
    seen = np.isfinite(_sense(_wall(1.5, gloss=0.6), replace(CLEAN, mirror_deg=9.0)))
    angle_deg = np.degrees(np.arccos(1.0 / np.linalg.norm(pixel_rays(CAMERA), axis=-1)))
    assert seen[angle_deg < 3.0].mean() < 0.6
    assert seen[angle_deg > 25.0].mean() > 0.99


def test_losses_rise_with_the_angle() -> None:
    shares = [np.isfinite(_sense(_wall(1.0, tilt_rad=np.radians(a))))[240].mean() for a in (60, 74, 80, 87)]
    assert shares[0] > 0.99
    assert np.all(np.diff(shares) < 0.0)


def test_losses_come_in_blobs() -> None:
    """Neighbours of lost pixels are lost far oftener than by chance."""
    lost = np.isnan(_sense(_wall(2.0), replace(CLEAN, blob_share=0.1)))
    assert lost.mean() == pytest.approx(0.1, abs=0.04)
    assert lost[:, 1:][lost[:, :-1]].mean() > 0.6


def test_margins_and_missing_surfaces_are_holes() -> None:
    depth = np.full((480, 640), 2.0)
    depth[200:220, 300:340] = np.nan
    z_m = _sense(_wall(depth), replace(CLEAN, border_px=(8.0, 6.0, 16.0, 4.0)))
    assert np.all(np.isnan(z_m[200:220, 300:340]))
    margins = np.ones(z_m.shape, bool)
    margins[6:-4, 8:-16] = False
    assert np.all(np.isnan(z_m[margins]))
    assert np.isfinite(z_m[6:-4, 8:-16]).mean() > 0.98


def test_same_seed_same_bits_and_another_seed_other_holes() -> None:
    view = _wall(2.0)
    first, again, other = (_sense(view, SensorConfig(), s) for s in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert np.any(np.isnan(first) != np.isnan(other))


def test_a_room_has_as_many_holes_as_a_real_kinect_sees() -> None:
    shares = []
    for seed in range(4):
        scene, rng = box_room(seed), np.random.default_rng(seed)
        view = render(scene, scene.intrinsics, scene.cameras[0], "fast", rng)
        sensed = sense_depth(view, scene.intrinsics, rng)
        shares.append(1.0 - sensed.coverage)
        error = np.abs(sensed.z_m - view.z_m)[sensed.valid]
        assert np.median(error / axial_sigma_m(view.z_m[sensed.valid])) < 1.5
    assert 0.08 < np.median(shares) < 0.25
