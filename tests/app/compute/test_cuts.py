"""Cuts: which points and which parts of a ray they keep."""

import numpy as np
import pytest

from app.compute.cuts import Box, Plane, Top, kept, kept_on_ray, planes_of


def test_what_is_above_a_height_behind_a_plane_or_outside_a_box_is_left_out():
    points_m = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.3], [0.9, 0.0, 0.1]])
    assert kept(Top(0.2), points_m).tolist() == [True, False, True]
    assert kept(Plane((0.5, 0.0, 0.0), (1.0, 0.0, 0.0)), points_m).tolist() == [False, False, True]
    box = Box((0.0, 0.0, 0.1), (2.0, 0.2, 0.2))
    assert kept(box, points_m).tolist() == [True, False, True]
    assert kept(Box(box.centre_m, box.size_m, inside=True), points_m).tolist() == [False, True, False]
    assert kept(Box(box.centre_m, box.size_m, 90.0), points_m).tolist() == [True, False, False]
    assert kept(None, points_m).all()


def test_a_box_turns_from_x_towards_y():
    box = Box((1.0, 1.0, 0.0), (2.0, 0.2, 0.2), 30.0)
    tip_m = np.array([1.0, 1.0, 0.0]) + 0.99 * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    assert kept(box, tip_m[None]).all()
    assert not kept(box, (tip_m * [1.0, -1.0, 1.0] + [0.0, 2.0, 0.0])[None]).any()
    for point_m, normal in planes_of(box):
        assert (np.array(box.centre_m) - point_m) @ normal > 0.0


RAY = np.array([0.0, -5.0, 0.5]), np.array([0.0, 2.0, 0.0])
CUBE_M = (1.0, 1.0, 1.0)
CUTS = {
    "none": (None, [(0.0, np.inf)]),
    "plane ahead": (Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0)), [(2.0, np.inf)]),
    "up to a plane": (Plane((0.0, -1.0, 0.0), (0.0, -1.0, 0.0)), [(0.0, 2.0)]),
    "above": (Top(0.4), []),
    "below": (Top(0.6), [(0.0, np.inf)]),
    "box": (Box((0.0, 1.0, 0.5), CUBE_M), [(2.75, 3.25)]),
    "box beside": (Box((3.0, 1.0, 0.5), CUBE_M), []),
    "box behind": (Box((0.0, -8.0, 0.5), CUBE_M), []),
    "in a box": (Box((0.0, -5.0, 0.5), CUBE_M), [(0.0, 0.25)]),
    "out of a box": (Box((0.0, -5.0, 0.5), CUBE_M, inside=True), [(0.25, np.inf)]),
    "through a box": (Box((0.0, 1.0, 0.5), CUBE_M, inside=True), [(0.0, 2.75), (3.25, np.inf)]),
    "past a box": (Box((3.0, 1.0, 0.5), CUBE_M, inside=True), [(0.0, np.inf)]),
}


@pytest.mark.parametrize(("cut", "parts"), CUTS.values(), ids=CUTS)
def test_the_kept_parts_of_a_ray_are_between_the_planes(cut, parts):
    found = kept_on_ray(cut, *RAY)
    assert found == pytest.approx(parts) if parts else found == []


@pytest.mark.parametrize("seed", range(20))
def test_points_of_a_ray_are_kept_just_if_they_are_in_a_kept_part(seed):
    rng = np.random.default_rng(seed)
    origin_m, direction = rng.normal(size=(2, 3))
    box = Box(tuple(rng.normal(size=3)), tuple(rng.uniform(0.5, 3.0, 3)), 30.0, bool(seed % 2))
    for cut in (box, Top(float(rng.normal())), Plane(tuple(rng.normal(size=3)), (0.0, 0.6, -0.8))):
        at = np.linspace(0.0, 5.0, 997)
        parts = kept_on_ray(cut, origin_m, direction)
        within = np.zeros(len(at), bool)
        for begin, end in parts:
            within |= (begin <= at) & (at <= end)
        assert np.array_equal(within, kept(cut, origin_m + at[:, None] * direction))
