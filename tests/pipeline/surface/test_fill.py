"""Filling holes: what the skin over a loop must be, and what must stay as it was."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.rays import triangle_areas_m2
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.fill import fill_holes, least_area, skin_points_m, without_seams
from pipeline.surface.holes import find_holes
from pipeline.surface.quality import measure_quality
from pipeline.types import PointCloud, SurfaceResult
from tests.pipeline.surface.shapes import grid_mesh, perforated_plane, sphere

HOLE_M = 0.08


def as_surface(vertices_m, triangles):
    quality = measure_quality(vertices_m, triangles, [], len(vertices_m) + 7)
    return SurfaceResult(vertices_m, triangles, None, (0.1,), quality=quality)


def euler(surface):
    return len(surface.vertices_m) - len(edges_and_faces(surface.triangles)[0]) + len(surface.triangles)


@pytest.fixture(scope="module")
def plane():
    return reconstruct_surface(perforated_plane(0.3, 0.0025, HOLE_M), (0.0025,))


def test_a_disc_is_filled_with_its_area(plane):
    filled = fill_holes(plane, 0.99)
    assert filled.holes == 1
    assert filled.area_m2 == pytest.approx(plane.quality.hole_area_m2)
    assert filled.area_m2 == pytest.approx(np.pi * HOLE_M**2, rel=0.05)
    assert euler(filled.surface) == euler(plane) + 1
    assert [hole.rim for hole in find_holes(filled.surface.vertices_m, filled.surface.triangles)] == [True]
    quality = filled.surface.quality
    assert (quality.hole_area_m2, quality.boundary_loops, quality.non_manifold_edges) == (0.0, 1, 0)
    assert quality.area_m2 == pytest.approx(plane.quality.area_m2 + filled.area_m2)
    assert quality.unused_points == plane.quality.unused_points
    assert np.isnan(quality.no_hit_ray_share)


def test_the_new_triangles_come_after_the_old_and_face_the_same_side(plane):
    filled = fill_holes(plane, 0.99)
    old = len(plane.triangles)
    np.testing.assert_array_equal(filled.surface.triangles[:old], plane.triangles)
    np.testing.assert_array_equal(filled.filled, np.arange(len(filled.surface.triangles)) >= old)
    a, b, c = plane.vertices_m[filled.surface.triangles].swapaxes(0, 1)
    assert np.all(np.cross(b - a, c - a)[:, 2] > 0.0)
    assert filled.surface.triangles.dtype == plane.triangles.dtype
    assert filled.surface.vertices_m is plane.vertices_m
    assert filled.surface.radii_m == plane.radii_m


@pytest.mark.parametrize(("share", "holes"), [(0.999, 0), (1.001, 1)])
def test_only_loops_up_to_the_length_are_filled(plane, share, holes):
    length_m = find_holes(plane.vertices_m, plane.triangles)[0].length_m
    assert fill_holes(plane, share * length_m).holes == holes


def test_a_cap_of_a_sphere_is_filled_facing_out():
    """Two caps are off: the wider one's loop is the rim, the other is filled."""
    cloud = sphere(2000, radius_m=0.2)
    surface = reconstruct_surface(
        cloud.select((cloud.points_m[:, 2] < 0.18) & (cloud.points_m[:, 0] < 0.195)), (0.015,)
    )
    filled = fill_holes(surface, 0.99)
    assert (filled.holes, euler(surface), euler(filled.surface)) == (1, 0, 1)
    (rim,) = find_holes(filled.surface.vertices_m, filled.surface.triangles)
    assert np.all(filled.surface.vertices_m[rim.loop, 2] > 0.15)
    a, b, c = filled.surface.vertices_m[filled.surface.triangles].swapaxes(0, 1)
    assert np.all(np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > 0.0)


def test_every_hole_raises_the_euler_number_by_one():
    missing = frozenset({(1, 1), (3, 1), (4, 1), (1, 4), (6, 6), (6, 5), (5, 6)})
    vertices_m, triangles = grid_mesh(8, 8, missing)
    surface = as_surface(0.05 * vertices_m, triangles)
    filled = fill_holes(surface, 1.0)
    assert filled.holes == 4
    assert euler(filled.surface) == euler(surface) + 4 == 1
    assert filled.area_m2 == pytest.approx(7 * 0.05**2)


def test_rims_and_islands_are_left_alone():
    everywhere = {(x, y) for x in range(4) for y in range(4)}
    vertices_m, triangles = grid_mesh(4, 4, frozenset(everywhere - {(0, 0), (1, 0), (1, 1), (2, 2)}))
    surface = as_surface(0.1 * vertices_m, triangles)
    assert surface.quality.hole_area_m2 == 0.0
    filled = fill_holes(surface, 10.0)
    assert (filled.holes, filled.area_m2, filled.filled.any()) == (0, 0.0, False)
    np.testing.assert_array_equal(filled.surface.triangles, triangles)


def test_a_skin_takes_no_edge_that_the_mesh_has_already():
    """A square hole whose one diagonal is an edge of a bridge above: the other diagonal is left."""
    vertices_m, triangles = grid_mesh(3, 3, frozenset({(1, 1)}))
    vertices_m = np.concatenate([0.1 * vertices_m, [[0.15, 0.15, 0.3]]])
    for bridge, taken in (((5, 10), {5, 10}), ((6, 9), {6, 9})):
        surface = as_surface(vertices_m, np.concatenate([triangles, [[*bridge, 16]]]).astype(np.int32))
        filled = fill_holes(surface, 0.5)
        assert filled.holes == 1
        assert filled.surface.quality.non_manifold_edges == 0
        shared = set(filled.surface.triangles[-1].tolist()) & set(filled.surface.triangles[-2].tolist())
        assert shared == {5, 6, 9, 10} - taken


def test_where_no_skin_is_left_the_hole_stays():
    vertices_m, triangles = grid_mesh(3, 3, frozenset({(1, 1)}))
    vertices_m = np.concatenate([0.1 * vertices_m, [[0.15, 0.15, 0.3], [0.15, 0.15, -0.3]]])
    bridges = [[5, 10, 16], [6, 9, 17]]
    surface = as_surface(vertices_m, np.concatenate([triangles, bridges]).astype(np.int32))
    filled = fill_holes(surface, 0.5)
    assert (filled.holes, len(filled.surface.triangles)) == (0, len(surface.triangles))


def test_a_real_roll_stays_manifold():
    """Noise makes holes of all shapes, many of which touch each other."""
    rng = np.random.default_rng(5)
    points_m = np.column_stack([rng.uniform(-0.5, 0.5, (3000, 2)), rng.normal(0.0, 0.01, 3000)])
    cloud = PointCloud(points_m, normals=np.tile([0.0, 0.0, 1.0], (3000, 1)))
    surface = reconstruct_surface(cloud, (0.02,))
    inside = [h for h in find_holes(surface.vertices_m, surface.triangles) if not (h.rim or h.island)]
    filled = fill_holes(surface, 1.0)
    assert 0.98 * len(inside) <= filled.holes <= len(inside) < 200
    directed = filled.surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    assert filled.surface.quality.non_manifold_edges == 0
    assert euler(filled.surface) == euler(surface) + filled.holes


def brute_force_m2(corners_m):
    """Least area over all triangulations, by definition."""
    if len(corners_m) < 3:
        return 0.0
    return min(
        brute_force_m2(corners_m[: k + 1])
        + brute_force_m2(corners_m[k:])
        + 0.5 * np.linalg.norm(np.cross(corners_m[k] - corners_m[0], corners_m[-1] - corners_m[0]))
        for k in range(1, len(corners_m) - 1)
    )


@pytest.mark.parametrize("count", [3, 4, 5, 7, 9])
def test_the_skin_has_the_least_area_of_all_triangulations(count):
    for seed in range(5):
        corners_m = np.random.default_rng(seed).normal(size=(count, 3))
        triangles = least_area(corners_m)
        assert triangles.shape == (count - 2, 3)
        area_m2 = triangle_areas_m2(corners_m, triangles).sum()
        assert area_m2 == pytest.approx(brute_force_m2(corners_m), rel=1e-4)
        edges, faces = edges_and_faces(triangles)
        sides = {frozenset((k, (k + 1) % count)) for k in range(count)}
        assert {frozenset(edge) for edge in edges[faces == 1].tolist()} == sides


def test_a_flat_star_is_covered_once():
    """Not convex: a fan from one corner would cover parts of it twice."""
    angle = np.linspace(0.0, 2 * np.pi, 14, endpoint=False)
    radius = np.where(np.arange(14) % 2, 0.4, 1.0)
    corners_m = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(14)])
    following_m = np.roll(corners_m, -1, axis=0)
    area_m2 = 0.5 * np.sum(np.cross(corners_m, following_m)[:, 2])
    assert triangle_areas_m2(corners_m, least_area(corners_m)).sum() == pytest.approx(area_m2)


@pytest.mark.parametrize("count", [60, 300])
def test_points_on_a_flat_skin_are_spread_by_area(count):
    """A loop of few corners has the skin of least area, one of many a fan."""
    angle = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    points_m = skin_points_m(np.column_stack([np.cos(angle), np.sin(angle), np.full(count, 2.0)]), 4000)
    distance_m = np.linalg.norm(points_m[:4000, :2], axis=1)
    np.testing.assert_allclose(points_m[:, 2], 2.0)
    for share in (0.25, 0.5, 0.75):
        assert np.mean(distance_m < np.sqrt(share)) == pytest.approx(share, abs=0.03)


def test_the_middle_of_a_triangle_that_contains_it_is_among_its_points():
    right_m = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    wide_m = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [2.0, 0.5, 0.0]])
    np.testing.assert_allclose(skin_points_m(right_m, 10)[10:], [[2.0, 1.5, 0.0]])
    assert len(skin_points_m(wide_m, 10)) == 10


def test_a_loop_without_area_has_only_its_corners():
    line_m = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    np.testing.assert_array_equal(skin_points_m(line_m, 10), line_m)


@pytest.mark.parametrize("longest_m", [0.0, -1.0, float("nan")])
def test_a_length_that_is_not_positive_gets_its_sentence(plane, longest_m):
    with pytest.raises(InputError, match=r"longest hole to fill is .* m; try a positive length"):
        fill_holes(plane, longest_m)


def test_a_picture_has_its_small_holes_closed_and_its_numbers_as_they_were(plane):
    assert len(without_seams(plane).triangles) == len(plane.triangles)  # 50 cm around
    small = reconstruct_surface(perforated_plane(0.3, 0.0025, 0.02), (0.0025,))
    closed = without_seams(small)
    assert [hole.rim for hole in find_holes(closed.vertices_m, closed.triangles)] == [True]
    assert closed.quality == small.quality
    np.testing.assert_array_equal(closed.triangles[: len(small.triangles)], small.triangles)
