"""The chance of a ray, where geometry says what it is."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.planning.chances import (
    APART_FADE_RAD,
    APART_RAD,
    DARK_APART_RAD,
    DARK_CHANCE,
    judge,
)
from pipeline.planning.sensors import FADE_SHARE, SENSORS
from tests.pipeline.planning.rooms import LENS, PLAIN, at, place, sheet, targets_at

EYE, AHEAD = (0.0, 0.0, 1.0), (0.0, 2.0, 1.0)
FAR_WALL = sheet((-3, 3, 0), (6, 0, 0), (0, 0, 2), 0.5)
"""Behind everything, so that there is a surface."""


def chance(
    points_m, normal=(0, -1, 0), sensor=PLAIN, pose=None, sheets=(FAR_WALL,), guessed=(), dark=0.0, apart=0.0
):
    seen = place(sheets, targets_at(points_m, normal, dark, apart), guessed_sheets=guessed)
    return judge(seen, at(EYE, AHEAD) if pose is None else pose, sensor).chance


def turned(angle_deg):
    """A normal that makes this angle with the way to the camera at EYE."""
    angle = np.radians(angle_deg)
    return np.sin(angle), -np.cos(angle), 0.0


def test_a_near_target_that_faces_the_camera_is_sure():
    assert chance([AHEAD]) == pytest.approx([1.0])


@pytest.mark.parametrize(
    "point",
    [
        (0.0, 4.6, 1.0),  # too far
        (0.0, 0.3, 1.0),  # too near
        (0.0, -2.0, 1.0),  # behind
        (1.7, 2.0, 1.0),  # to the right of the image, whose half is 0.8 of the distance
        (0.0, 2.0, 2.3),  # above it: 0.6 of the distance
    ],
)
def test_out_of_range_or_image_gains_nothing(point):
    assert chance([point], sheets=[sheet((-3, 9, 0), (6, 0, 0), (0, 0, 2), 0.5)]) == [0.0]


@pytest.mark.parametrize(("angle_deg", "share"), [(0.0, 1.0), (50.0, 1.0), (60.0, 0.8), (72.5424, 0.4)])
def test_the_chance_falls_with_the_cosine_of_the_angle_from_facing_to_askew(angle_deg, share):
    """Cosines of .5 and .3 lie .8 and .4 of the way from .1 to .6."""
    assert chance([AHEAD], turned(angle_deg)) == pytest.approx([share], abs=1e-4)


@pytest.mark.parametrize("angle_deg", [84.5, 89.0, 95.0, 180.0])
def test_a_grazing_view_and_one_from_behind_gain_nothing(angle_deg):
    assert chance([AHEAD], turned(angle_deg)) == [0.0]


def test_returns_fade_before_the_end_of_the_range():
    half_way_m = PLAIN.far_m * (1.0 - 0.5 * FADE_SHARE)
    behind = sheet((-3, 6, 0), (6, 0, 0), (0, 0, 2), 0.5)
    assert chance([(0.0, half_way_m, 1.0)], sheets=[behind]) == pytest.approx([0.5])


def test_behind_a_wall_nothing_is_gained_measured_or_guessed():
    wall = sheet((-1, 1, 0), (2, 0, 0), (0, 0, 2), 0.5)
    assert chance([AHEAD], sheets=[FAR_WALL, wall]) == [0.0]
    assert chance([AHEAD], guessed=[wall]) == [0.0]
    assert chance([(0.0, 0.9, 1.0)], sheets=[FAR_WALL, wall]) == pytest.approx([1.0])


def test_the_shadow_of_a_post_ends_where_similar_triangles_say():
    """A board half as far as the wall, from the axis 0.2 m to the right, hides the wall's first 0.4 m."""
    board = sheet((0, 1, 0), (0.2, 0, 0), (0, 0, 2), 0.5)
    x_m = np.arange(-0.6, 0.61, 0.05) + 0.025
    targets_m = np.stack([x_m, np.full(len(x_m), 2.0), np.ones(len(x_m))], axis=1)
    hidden = (x_m > 0.0) & (x_m < 0.4)
    assert np.array_equal(chance(targets_m, sheets=[FAR_WALL, board]) == 0.0, hidden)


def test_what_the_projector_does_not_see_has_no_depth():
    """The board stands between the target and the projector, 7.5 cm to the right of the camera."""
    board = sheet((0.03, 1, 0.9), (0.1, 0, 0), (0, 0, 0.2), 0.1)
    two_eyes = replace(PLAIN, baseline_m=SENSORS["kinect-v1"].baseline_m)
    assert chance([AHEAD], sheets=[FAR_WALL, board]) == pytest.approx([1.0])
    assert chance([AHEAD], sheets=[FAR_WALL, board], sensor=two_eyes) == [0.0]
    left = at(EYE, AHEAD) @ np.diag([-1.0, -1.0, 1.0, 1.0])  # half a turn about the view: it is on the left
    assert chance([AHEAD], sheets=[FAR_WALL, board], sensor=two_eyes, pose=left) == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("gain", "share"), [(0.4, 0.0), (0.5, 0.0), ((0.5 * 3.0) ** 0.5, 0.5), (3.0, 1.0), (9.0, 1.0)]
)
def test_a_dark_surface_needs_more_light_than_was_too_little(gain, share):
    """Light falls with the square of the distance; 2 m and facing return 1/4."""
    assert chance([AHEAD], dark=0.25 / gain) == pytest.approx([DARK_CHANCE * share], abs=1e-5)


@pytest.mark.parametrize(
    ("dark", "apart_rad", "share"),
    [
        (0.25 / 3.0, DARK_APART_RAD, DARK_CHANCE * np.exp(-1.0)),
        (0.25 / 3.0, 2.0 * DARK_APART_RAD, DARK_CHANCE * np.exp(-2.0)),
        (0.0, APART_RAD, 1.0),
        (0.0, APART_RAD + APART_FADE_RAD, np.exp(-1.0)),
    ],
)
def test_the_middle_of_a_large_hole_in_a_depth_image_is_seldom_measured(dark, apart_rad, share):
    assert chance([AHEAD], dark=dark, apart=apart_rad) == pytest.approx([share], abs=1e-5)


def test_overlap_is_the_common_part_of_two_images_of_a_wall():
    """The image of a wall 2 m away is 3.2 m wide; a camera 0.8 m aside shares three quarters of it."""
    wall = sheet((-9, 2, -9), (18, 0, 0), (0, 0, 18), 3.0)
    first = at((0, 0, 0), (0, 1, 0))
    seen = place([wall], targets_at([(0, 2, 0)], (0, -1, 0)), cameras=[first])
    for aside_m, share in ((0.0, 1.0), (0.8, 0.75), (1.6, 0.5), (3.3, 0.0)):
        pose = at((aside_m, 0, 0), (aside_m, 1, 0))
        assert judge(seen, pose, PLAIN).overlap_share == pytest.approx(share, abs=1.5 / 48)


def test_overlap_counts_the_best_present_camera_and_measured_surface_alone():
    wall = sheet((-9, 2, -9), (18, 0, 0), (0, 0, 18), 3.0)
    cameras = [at((x_m, 0, 0), (x_m, 1, 0)) for x_m in (-1.6, 0.8)]
    seen = place([wall], targets_at([(0, 2, 0)], (0, -1, 0)), cameras=cameras)
    assert judge(seen, at((0, 0, 0), (0, 1, 0)), PLAIN).overlap_share == pytest.approx(0.75, abs=1.5 / 48)
    guessed = place([FAR_WALL], seen.targets, cameras=cameras, guessed_sheets=[wall])
    only_far = place([FAR_WALL], seen.targets, cameras=cameras)
    pose = at((0, 0, 1), (0, 1, 1))
    assert judge(guessed, pose, PLAIN).overlap_share == judge(only_far, pose, PLAIN).overlap_share


def test_the_same_pose_has_the_same_chances_twice_and_the_lens_is_the_sensors():
    points_m = np.random.default_rng(0).uniform((-2, 0.5, 0), (2, 4, 2), (200, 3))
    seen = place([FAR_WALL], targets_at(points_m, (0, -1, 0)))
    first, again = (judge(seen, at(EYE, AHEAD), PLAIN).chance for _ in range(2))
    assert np.array_equal(first, again)
    assert 0 < (first > 0).sum() < 200
    narrow = replace(PLAIN, intrinsics=replace(LENS, matrix=np.diag([3.0, 3.0, 1.0]) @ LENS.matrix))
    assert (judge(seen, at(EYE, AHEAD), narrow).chance > 0).sum() < (first > 0).sum()
