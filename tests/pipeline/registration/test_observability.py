"""Shapes whose open motions are known."""

import numpy as np
import pytest

from pipeline.kernels.geometry import apply
from pipeline.registration.neighbourhood import pca_normals
from pipeline.registration.observability import open_motions, weakest_motion

RNG = np.random.default_rng(2)
A, B, C = RNG.uniform(-1.0, 1.0, (3, 2000))
ZERO = np.zeros_like(A)
BALL = RNG.normal(size=(2000, 3))
BALL /= np.linalg.norm(BALL, axis=1, keepdims=True)
PIPE = np.stack([np.cos(3 * A), np.sin(3 * A), B], axis=1)
FLOOR, WALL, FRONT = (np.stack(face, axis=1) for face in ((A, B, ZERO), (ZERO, A, B), (A, ZERO, B)))
X, Y, Z = np.eye(3)

SHAPES = {
    "plane": (
        FLOOR,
        np.tile(Z, (2000, 1)),
        "sliding in any direction perpendicular to z and turning about z",
    ),
    "corridor": (np.concatenate([FLOOR, WALL]), np.repeat([Z, X], 2000, axis=0), "sliding along y"),
    "sphere": (BALL, BALL, "turning about any axis"),
    "pipe": (PIPE, PIPE * [1, 1, 0], "sliding along z and turning about z"),
    "corner": (np.concatenate([FLOOR, WALL, FRONT]), np.repeat([Z, X, Y], 2000, axis=0), ""),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("shift_m", [0.0, 10.0])
def test_the_open_motions_of_a_shape_are_named(name, shift_m):
    points_m, normals, says = SHAPES[name]
    assert open_motions(points_m + shift_m, normals) == says
    assert open_motions(1000.0 * points_m, normals) == says


def test_half_a_pipe_turns_about_its_axis_wherever_its_points_are():
    half = PIPE[:, 0] > 0
    assert open_motions(PIPE[half], (PIPE * [1, 1, 0])[half]) == "sliding along z and turning about z"


def test_a_plane_with_noise_is_still_a_plane():
    points_m = FLOOR + RNG.normal(scale=0.001, size=FLOOR.shape)
    assert (
        open_motions(points_m, pca_normals(points_m + 2.0 * Z))
        == "sliding in any direction perpendicular to z and turning about z"
    )


def test_an_oblique_direction_is_given_by_its_coordinates():
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    points_m, normals, _ = SHAPES["corridor"]
    assert open_motions(points_m @ turn.T, normals @ turn.T) == "sliding along (-0.60, 0.80, 0.00)"


@pytest.mark.parametrize("length_m", [0.05, -0.05])
def test_the_weakest_motion_of_a_corridor_leads_along_it(length_m):
    points_m, normals, _ = SHAPES["corridor"]
    moved_m = apply(weakest_motion(points_m + 10.0, normals, length_m), points_m + 10.0) - points_m - 10.0
    np.testing.assert_allclose(np.abs(moved_m), np.tile([0.0, 0.05, 0.0], (4000, 1)), atol=1e-9)
    assert abs(moved_m.sum()) == pytest.approx(0.05 * 4000)  # all to one side


def test_the_weakest_motion_of_a_ball_turns_it_on_the_spot():
    moved_m = apply(weakest_motion(BALL + 5.0, BALL, 0.05), BALL + 5.0)
    np.testing.assert_allclose(np.linalg.norm(moved_m - 5.0, axis=1), 1.0, atol=1e-3)
    apart_m = np.linalg.norm(moved_m - BALL - 5.0, axis=1)
    assert np.sqrt(np.mean(apart_m**2)) == pytest.approx(0.05 * np.sqrt(2 / 3), rel=0.02)
