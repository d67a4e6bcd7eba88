"""Views from named sides: where they stand, and that everything is in the picture and fills it."""

import numpy as np
import pytest

from app.drawing.directions import SIDES, ball_m, fitting, forward_of

FOV_RAD, ASPECT = 1.2, 1.6
NORTH = np.array([0.0, 2.0, -0.7])
"""Cameras that look north and a little down: they stand in the south, and east is on their right."""
BOX_M = np.array([[x, y, z] for x in (1.0, 5.0) for y in (-2.0, 1.0) for z in (0.0, 2.0)])


@pytest.mark.parametrize(
    ("side", "stand"),
    [("front", (0, -1, 0)), ("back", (0, 1, 0)), ("left", (-1, 0, 0)), ("right", (1, 0, 0))],
)
def test_a_side_is_where_somebody_before_the_cameras_would_say(side, stand):
    center_m, stand_m = fitting(BOX_M, forward_of(side, NORTH), FOV_RAD, ASPECT)
    np.testing.assert_allclose(center_m, BOX_M.mean(axis=0), atol=1e-9)
    towards = (stand_m - center_m) / np.linalg.norm(stand_m - center_m)
    np.testing.assert_allclose(towards, stand, atol=1e-9)


def test_from_above_the_front_is_at_the_lower_edge():
    forward = forward_of("above", NORTH)
    assert forward[2] == pytest.approx(-1.0, abs=1e-3)
    assert forward[1] > 0.0  # what is up in the picture lies in the north


def test_cameras_that_look_straight_down_have_a_front_too():
    assert np.linalg.norm(forward_of("front", np.array([0.0, 0.0, -1.0]))) == pytest.approx(1.0)


def in_picture(points_m, center_m, stand_m):
    """Where points are in the picture: -1 to 1 from edge to edge, (N, 2)."""
    forward = (center_m - stand_m) / np.linalg.norm(center_m - stand_m)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    apart_m = points_m - stand_m
    depth_m = apart_m @ forward
    assert np.all(depth_m > 0.0)
    half = np.tan(0.5 * FOV_RAD)
    up = np.cross(right, forward)
    return np.stack([apart_m @ right / (half * ASPECT), apart_m @ up / half], axis=1) / depth_m[:, None]


@pytest.mark.parametrize("side", SIDES)
def test_everything_is_in_the_picture_and_reaches_its_margin(side):
    place = fitting(BOX_M, forward_of(side, NORTH), FOV_RAD, ASPECT)
    assert np.abs(in_picture(BOX_M, *place)).max() == pytest.approx(0.9, abs=1e-6)


def test_a_single_wrong_point_does_not_shrink_the_rest():
    many_m = np.concatenate([np.tile(BOX_M, (100, 1)), [[500.0, 0.0, 0.0]]])
    front = forward_of("front", NORTH)
    for far, near in zip(
        fitting(many_m, front, FOV_RAD, ASPECT), fitting(BOX_M, front, FOV_RAD, ASPECT), strict=True
    ):
        np.testing.assert_allclose(far, near, atol=1e-6)


def test_a_single_point_is_looked_at_from_a_little_way_off():
    center_m, stand_m = fitting(BOX_M[:1], forward_of("left", NORTH), FOV_RAD, ASPECT)
    np.testing.assert_allclose(center_m, BOX_M[0])
    assert 0.01 < np.linalg.norm(stand_m - center_m) < 1.0


def test_the_ball_of_a_view_is_seen_whole_from_every_side():
    center_m, stand_m = np.array([1.0, 2.0, 3.0]), np.array([1.0, -4.0, 3.0])
    points_m = ball_m(center_m, stand_m, FOV_RAD, ASPECT)
    for side in SIDES:
        place = fitting(points_m, forward_of(side, NORTH), FOV_RAD, ASPECT)
        assert np.abs(in_picture(points_m, *place)).max() <= 0.9 + 1e-6
        assert np.linalg.norm(place[1] - place[0]) == pytest.approx(6.0, rel=0.1)
