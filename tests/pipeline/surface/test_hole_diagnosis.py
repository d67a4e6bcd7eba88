"""Causes of holes that were made on purpose, and what is said to close them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import Delaunay

from packetmesh.errors import InputError
from pipeline.kernels.geometry import look_at, rigid, rotation_exp
from pipeline.kernels.rays import Camera
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.hole_diagnosis import GROWTH, explain_hole
from pipeline.surface.holes import find_holes
from pipeline.surface.ray_parts import View
from pipeline.surface.rims import even_rims
from pipeline.types import CameraIntrinsics, PointCloud, PointSource
from tests.pipeline.surface.shapes import perforated_plane

SPACING_M = 0.01
SIDE_M = 0.4
DOWN = look_at(np.array([0.0, 0.0, 1.0]), np.zeros(3), up=np.array([0.0, 1.0, 0.0]))
CAMERA = Camera(CameraIntrinsics.pinhole(100.0, 100.0, 31.5, 31.5, 64, 64), DOWN)
"""Sees 64 cm of the plane, 1 cm a pixel."""
U, V = np.meshgrid(np.arange(64), np.arange(64))
EVERYWHERE = np.ones((64, 64), dtype=bool)
IN_DISC = np.hypot(U - 31.5, V - 31.5) < 8.0
"""Pixels of the disc of 8 cm, and some around it."""


def plane_with(hole_radius_m):
    return perforated_plane(SIDE_M, SPACING_M, hole_radius_m)


def rolled(cloud, radii_m=(SPACING_M,)):
    surface = reconstruct_surface(cloud, radii_m)
    return surface, find_holes(surface.vertices_m, surface.triangles)


def widest_circumradius_m(cloud):
    """Of the Delaunay triangles around the origin: the ball that rests on all of them, on a flat cloud."""
    xy = cloud.points_m[:, :2]
    a, b, c = xy[Delaunay(xy).simplices].swapaxes(0, 1)
    u, v = b - a, c - a
    cross = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    sides_m = [np.linalg.norm(side, axis=1) for side in (u, v, c - b)]
    near = np.linalg.norm((a + b + c) / 3.0, axis=1) < 0.15
    return np.max((np.prod(sides_m, axis=0) / (2.0 * np.abs(cross)))[near])


def normals_turned(cloud, radius_m, turn):
    normals = cloud.normals.copy()
    inside = np.linalg.norm(cloud.points_m[:, :2], axis=1) < radius_m
    normals[inside] = turn(normals[inside])
    return replace(cloud, normals=normals)


@pytest.mark.parametrize("hole_radius_m", [0.015, 0.025, 0.04])
def test_the_ball_that_closes_a_disc_is_the_circle_through_its_rim(hole_radius_m):
    """A flat cloud's ball closes a Delaunay triangle exactly if it is larger than its circumcircle.

    A grid with a disc of radius c left out has its nearest points about c from the middle, so this is
    c at least and at most c plus a grid's diagonal.
    """
    cloud = plane_with(hole_radius_m)
    surface, (hole, _) = rolled(cloud)
    explanation = explain_hole(hole, surface, cloud)
    needed_m = widest_circumradius_m(cloud)
    assert hole_radius_m * 0.95 < needed_m < hole_radius_m + np.sqrt(2.0) * SPACING_M
    assert explanation.reason == "gap"
    assert needed_m <= explanation.closing_radius_m < GROWTH * needed_m
    assert f"A ball of {1000 * explanation.closing_radius_m:.0f} mm radius closes it" in explanation.remedy
    assert (
        f"widest gap in the hole is {1000 * 2 * needed_m:.0f} mm" in explanation.sentence or needed_m > 0.05
    )
    assert "10 mm in radius, falls through all that are wider than 20 mm" in explanation.sentence
    assert np.isnan(explanation.sensor_share)


@pytest.mark.parametrize("hole_radius_m", [0.015, 0.025, 0.04])
def test_rolled_everywhere_that_ball_closes_the_hole_and_the_one_before_does_not(hole_radius_m):
    cloud = plane_with(hole_radius_m)
    surface, (hole, _) = rolled(cloud)
    radius_m = explain_hole(hole, surface, cloud).closing_radius_m
    for tried_m, left in ((radius_m, 0), (radius_m / GROWTH, 1)):
        assert sum(not hole.rim for hole in rolled(cloud, (SPACING_M, tried_m))[1]) == left


def test_the_cause_does_not_depend_on_where_the_cloud_lies():
    T = rigid(rotation_exp(np.array([0.4, -1.1, 2.0])), np.array([3.0, -2.0, 1.0]))
    cloud = plane_with(0.025)
    moved = cloud.transformed(T)
    here, there = (
        explain_hole(holes[0], surface, points)
        for points, (surface, holes) in ((points, rolled(points)) for points in (cloud, moved))
    )
    assert here.reason == there.reason == "gap"
    assert here.closing_radius_m == pytest.approx(there.closing_radius_m)


def test_a_wide_empty_disc_was_not_measured():
    cloud = plane_with(0.08)
    surface, (hole, _) = rolled(cloud)
    explanation = explain_hole(hole, surface, cloud)
    assert explanation.reason == "no points"
    assert explanation.sentence == (
        "A gap of 16 cm contains no point (17 times the point spacing of 9.6 mm): nothing was measured here."
    )
    assert widest_circumradius_m(cloud) <= explanation.closing_radius_m
    assert "Add a view" in explanation.remedy
    assert (
        f"{1000 * explanation.closing_radius_m:.0f} mm" in explanation.remedy
        or "cm radius" in explanation.remedy
    )


def test_a_patch_of_flipped_normals_is_named():
    cloud = normals_turned(plane_with(0.0), 0.05, lambda normals: -normals)
    surface, holes = rolled(cloud)
    explanation = explain_hole(holes[0], surface, cloud)
    assert explanation.reason == "normals"
    assert "100% more" in explanation.sentence
    assert "up to 10 mm" in explanation.sentence
    assert "smoothing passes" in explanation.remedy


def test_a_patch_of_normals_in_all_directions_is_named():
    rng = np.random.default_rng(1)

    def scattered(normals):
        wild = rng.normal(size=normals.shape)
        wild[:, 2] = -np.abs(wild[:, 2])
        return wild / np.linalg.norm(wild, axis=1, keepdims=True)

    cloud = normals_turned(plane_with(0.0), 0.05, scattered)
    surface, holes = rolled(cloud)
    assert explain_hole(holes[0], surface, cloud).reason == "normals"


def test_where_nothing_that_is_tried_helps_it_is_said_so():
    """A few turned points in the middle of a gap stop every ball, and agreement alone closes nothing."""
    cloud = normals_turned(plane_with(0.0), 0.05, lambda normals: -normals)
    distance_m = np.linalg.norm(cloud.points_m[:, :2], axis=1)
    cloud = cloud.select((distance_m > 0.05) | (distance_m < 0.006))
    surface, holes = rolled(cloud)
    explanation = explain_hole(holes[0], surface, cloud)
    assert (explanation.reason, explanation.closing_radius_m) == ("gap", None)
    assert explanation.remedy.startswith("No ball of up to 11 cm closed it, at best ")


def explained_disc(view, source=None, hole_radius_m=0.06):
    cloud = plane_with(hole_radius_m)
    if source is not None:
        cloud = replace(cloud, source=np.full(len(cloud), source, np.uint8))
    surface, (hole, _) = rolled(cloud)
    return explain_hole(hole, surface, cloud, [view])


def test_where_the_sensor_saw_nothing_the_network_is_asked():
    explanation = explained_disc(View(CAMERA, ~IN_DISC, EVERYWHERE), PointSource.SENSOR)
    assert explanation.reason == "no points"
    assert (explanation.sensor_share, explanation.inferred_share, explanation.unknown_share) == (
        0.0,
        1.0,
        0.0,
    )
    assert "the sensor measured 0%; for 100% only the network" in explanation.sentence
    assert explanation.remedy.startswith("Fuse")


def test_where_nobody_knows_another_view_is_asked_for():
    for inferred in (None, ~EVERYWHERE):
        explanation = explained_disc(View(CAMERA, ~IN_DISC, inferred), PointSource.SENSOR)
        assert explanation.reason == "no points"
        assert explanation.unknown_share == 1.0
        assert explanation.sentence.endswith("a depth, and 100% have no depth at all.")
        assert explanation.remedy.startswith("Add a view from another place. A ball of ")


def test_where_the_sensor_measured_it_is_a_gap():
    """However wide: the depth is known there, so a ball can be blamed."""
    explanation = explained_disc(View(CAMERA, EVERYWHERE, None))
    assert (explanation.reason, explanation.sensor_share) == ("gap", 1.0)


def test_after_fusion_the_networks_depth_counts_as_known():
    explanation = explained_disc(View(CAMERA, ~IN_DISC, EVERYWHERE), PointSource.INFERRED)
    assert (explanation.reason, explanation.inferred_share) == ("gap", 1.0)
    assert "Fuse" not in explanation.remedy


def test_half_of_the_pixels_decide():
    left = U < 31.5
    explanation = explained_disc(View(CAMERA, ~IN_DISC | (left & (U > 8)), None))
    assert explanation.sensor_share == pytest.approx(0.5, abs=0.1)
    shares = explanation.sensor_share, explanation.inferred_share, explanation.unknown_share
    assert sum(shares) == pytest.approx(1.0)


def test_a_hole_outside_every_image_is_named():
    aside = look_at(np.array([2.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]), up=np.array([0.0, 1.0, 0.0]))
    explanation = explained_disc(View(replace(CAMERA, T_world_camera=aside), EVERYWHERE, None))
    assert explanation.reason == "outside view"
    assert "100% of the hole is in no camera's image, and 0% is hidden" in explanation.sentence
    assert "camera" in explanation.remedy
    assert np.isnan(explanation.sensor_share)


def test_a_hole_behind_other_surface_is_hidden():
    """A sheet 20 cm over the plane casts its shadow on the hole."""
    plane = plane_with(0.03)
    sheet = PointCloud(
        plane_with(0.0).points_m * [0.5, 0.5, 1.0] + [0, 0, 0.2], normals=plane_with(0.0).normals
    )
    cloud = PointCloud.concatenate([PointCloud(plane.points_m, normals=plane.normals), sheet])
    surface, holes = rolled(cloud)
    explanation = explain_hole(holes[0], surface, cloud, [View(CAMERA, EVERYWHERE, None)])
    assert explanation.reason == "outside view"
    assert "0% of the hole is in no camera's image, and 100% is hidden" in explanation.sentence


def test_one_camera_that_sees_the_hole_is_enough():
    aside = look_at(np.array([2.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]), up=np.array([0.0, 1.0, 0.0]))
    cloud = plane_with(0.03)
    surface, (hole, _) = rolled(cloud)
    views = [View(replace(CAMERA, T_world_camera=aside), EVERYWHERE, None), View(CAMERA, EVERYWHERE, None)]
    assert explain_hole(hole, surface, cloud, views).reason == "gap"


def test_the_edge_of_the_cloud_has_no_points_beyond():
    cloud = plane_with(0.0)
    surface, (rim,) = rolled(cloud)
    explanation = explain_hole(rim, surface, cloud)
    assert rim.rim
    assert (explanation.reason, explanation.closing_radius_m) == ("no points", None)
    assert "The cloud ends here: beyond 100% of the rim's edges" in explanation.sentence


def test_an_edge_in_the_air_turns_to_a_side_that_no_camera_sees():
    """A table's top over a floor, seen from above: beyond its rim every image shows the floor."""
    plane = plane_with(0.0)
    top = PointCloud(plane.points_m * 0.5 + np.array([0.0, 0.0, 0.4]), normals=plane.normals)
    cloud = PointCloud.concatenate([top, PointCloud(2.0 * plane.points_m, normals=plane.normals)])
    surface, holes = rolled(cloud, (0.02,))
    rim = min((hole for hole in holes if hole.rim), key=lambda hole: hole.length_m)
    explanation = explain_hole(rim, surface, cloud, [View(CAMERA, EVERYWHERE, None)])
    assert rim.length_m == pytest.approx(0.8, rel=0.05)
    assert explanation.reason == "outside view"
    assert explanation.sentence.startswith("Beyond 100% of this rim a camera sees something farther away")
    assert "from the other side" in explanation.remedy


def test_a_crack_around_a_disc_is_a_gap_from_both_sides():
    """The plane's hole has an island in it, and that has a rim; the same balls bridge the crack."""
    cloud = plane_with(0.0)
    distance_m = np.linalg.norm(cloud.points_m[:, :2], axis=1)
    cloud = cloud.select((distance_m < 0.03) | (distance_m > 0.06))
    surface, (hole, _, disc) = rolled(cloud)
    assert (hole.rim, disc.rim) == (False, True)
    needed_m = widest_circumradius_m(cloud)
    outer, inner = (explain_hole(loop, surface, cloud) for loop in (hole, disc))
    assert needed_m <= outer.closing_radius_m < GROWTH * needed_m
    assert 0.015 < inner.closing_radius_m < GROWTH * needed_m
    assert outer.reason == inner.reason == "gap"
    assert "goes on beyond most of this rim" in inner.remedy


def test_an_island_is_explained_as_a_piece():
    """The loop of a piece that touches the rest in one point."""
    cloud = plane_with(0.0)
    surface, (rim,) = rolled(cloud)
    explanation = explain_hole(replace(rim, rim=False, island=True), surface, cloud)
    assert explanation.sentence.startswith("This loop runs around a piece")


def test_repeated_points_do_not_matter():
    cloud = plane_with(0.025)
    once, twice = (
        explain_hole(rolled(points)[1][0], rolled(points)[0], points)
        for points in (cloud, PointCloud.concatenate([cloud, cloud]))
    )
    assert (once.reason, once.closing_radius_m) == (twice.reason, twice.closing_radius_m)


@pytest.mark.parametrize("hole_radius_m", [0.025, 0.04])
def test_a_hole_with_an_even_rim_has_the_same_cause(hole_radius_m):
    """Its vertices have left the points of the cloud, and some of its edges no ball made."""
    cloud = plane_with(hole_radius_m)
    surface, (hole, _) = rolled(cloud)
    even = even_rims(surface, np.full(len(surface.vertices_m), SPACING_M))
    assert even.moved_m.max() > 0.1 * SPACING_M
    (even_hole, _) = find_holes(even.surface.vertices_m, even.surface.triangles)
    expected, found = explain_hole(hole, surface, cloud), explain_hole(even_hole, even.surface, cloud)
    assert (found.reason, found.closing_radius_m) == (expected.reason, expected.closing_radius_m)


def test_another_cloud_gets_its_sentence():
    cloud = plane_with(0.025)
    surface, (hole, _) = rolled(cloud)
    other = replace(cloud, points_m=cloud.points_m + 0.001)
    with pytest.raises(InputError, match="take the cloud that the ball rolled over"):
        explain_hole(hole, surface, other)
    for changed, points in ((replace(surface, radii_m=()), cloud), (surface, replace(cloud, normals=None))):
        with pytest.raises(InputError, match="take a surface that a ball made"):
            explain_hole(hole, changed, points)
