"""What cameras know of a surface: vertices are moved onto the measurements, and their noise is honest."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.acquisition.back_project import depth_sigma_m
from pipeline.measuring.views import View, known_by
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise, RgbdFrame
from tests.pipeline.measuring.scenes import joined, sheet

CAMERA = CameraIntrinsics.pinhole(260.0, 260.0, 159.5, 119.5, 320, 240)
SPACING_M = 0.03


def view(node=0, z_m=2.0, T=None, noise=None, guessed_m=None, confidence=None):
    """A camera that measured z_m everywhere, or guessed."""
    unknown = np.full((240, 320), np.nan, np.float32)
    depth_m = np.full((240, 320), z_m, np.float32) if np.isscalar(z_m) else z_m
    frame = RgbdFrame(
        "node", np.zeros((240, 320, 3), np.uint8), DepthMap(depth_m), CAMERA, np.eye(4), noise=noise
    )
    guess = (unknown if guessed_m is None else guessed_m, unknown if confidence is None else confidence)
    return View(frame, np.eye(4) if T is None else T, depth_m, *guess, node)


def wall(z_m=2.0):
    return sheet(40, 30, SPACING_M, (-0.6, 0.45, z_m), (1, 0, 0), (0, -1, 0))


def known(mesh, views, guessed=None, smoothed=True):
    guessed = np.zeros(len(mesh[0]), bool) if guessed is None else guessed
    return known_by(mesh[0], mesh[1], guessed, views, SPACING_M, smoothed)


def test_a_surface_that_lies_off_the_measurements_is_moved_onto_them():
    found = known(wall(2.02), [view()])
    assert found.vertices_m[:, 2] == pytest.approx(2.0, abs=0.001)
    away_m = found.vertices_m / found.ranges_m[:, None]
    assert found.rays == pytest.approx(away_m, abs=1e-3)
    assert np.all(found.nodes == 0)


def test_what_noise_explains_does_not_move_the_surface():
    noise = DepthNoise(0.05, 0.0, 1.0, 0.0)
    found = known(wall(2.003), [view(noise=noise)])
    assert found.vertices_m[:, 2] == pytest.approx(2.003)


def test_the_noise_is_the_sensors_after_averaging():
    mesh = wall()
    pixels = (SPACING_M * 260.0 / 2.0) ** 2
    for smoothed, vertices in ((True, 10.0), (False, 1.0)):
        found = known(mesh, [view()], smoothed=smoothed)
        expected_m = depth_sigma_m(2.0) / np.sqrt(pixels * vertices) * found.ranges_m / 2.0
        assert found.sigma_m == pytest.approx(expected_m, rel=0.05)


def test_steps_without_noise_leave_their_twelfth_and_noise_averages_them_away():
    levels = np.float32(2.0) + np.float32(0.04) * np.random.default_rng(0).integers(-1, 2, (240, 320))
    flat = np.full((240, 320), 2.0, np.float32)
    fine, coarse = (DepthNoise(sd_m, 0.0, 1.0, 0.0) for sd_m in (0.0004, 0.03))
    sigmas = []
    for noise in (fine, coarse):
        one = view(z_m=levels, noise=noise)
        sigmas.append(np.median(known(wall(), [replace(one, measured_m=flat)]).sigma_m))
    assert sigmas[0] == pytest.approx(0.04 / np.sqrt(12.0), rel=0.1)
    assert sigmas[1] < 0.5 * sigmas[0]


def test_a_bump_that_the_surface_lacks_is_noise_around_it():
    z_m = np.full((240, 320), 2.0, np.float32)
    z_m[116:124, 156:164] = 1.97
    found = known(wall(), [view(z_m=z_m)])
    middle = np.argmin(np.linalg.norm(found.vertices_m - [0.0, 0.0, 2.0], axis=1))
    far = np.argmin(np.linalg.norm(found.vertices_m - [0.5, 0.3, 2.0], axis=1))
    assert found.sigma_m[middle] > 5.0 * found.sigma_m[far]


def test_nodes_that_share_a_vertex_are_none_alone():
    aside = np.eye(4)
    aside[0, 3] = 1.2
    found = known(wall(), [view(0), view(1, T=aside)])
    x_m = found.vertices_m[:, 0]
    assert np.all(found.nodes[x_m < -0.15] == 0)
    assert np.all(found.nodes[x_m > 0.15] == -1)
    assert found.rays[x_m < -0.15, 2] == pytest.approx(2.0 / found.ranges_m[x_m < -0.15], abs=1e-3)


def test_a_guess_has_the_confidence_of_its_pixel_and_stays_where_it_is():
    unknown = np.full((240, 320), np.nan, np.float32)
    guessed_m, confidence = np.full((240, 320), 2.02, np.float32), np.full((240, 320), 0.7, np.float32)
    mesh = wall(2.02)
    found = known(
        mesh, [view(3, unknown, guessed_m=guessed_m, confidence=confidence)], np.ones(len(mesh[0]), bool)
    )
    assert found.confidence == pytest.approx(0.7)
    assert np.all(found.nodes == 3)
    assert found.vertices_m == pytest.approx(mesh[0])


def test_what_is_hidden_is_not_measured():
    front, back = wall(2.0), wall(3.0)
    found = known(joined(front, back), [view()])
    rows = np.arange(len(front[0]), 2 * len(front[0]))
    hidden = rows[np.all(np.abs(found.vertices_m[rows, :2]) < 0.4, axis=1)]
    assert np.all(found.nodes[hidden] == -1)
    assert found.sigma_m[hidden].min() > 0.01
