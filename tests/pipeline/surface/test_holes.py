"""Boundary loops one by one, on meshes drawn by hand."""

import numpy as np
import pytest

from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.holes import beyond_m, find_holes, half_edges, is_closed
from pipeline.surface.quality import measure_quality
from tests.pipeline.surface.shapes import grid_mesh, perforated_plane, rectangle


def closed_by(missing, refilled):
    """Whether a 5 x 5 grid's hole of ``missing`` squares is closed once ``refilled`` ones are there again."""
    vertices_m, triangles = grid_mesh(5, 5, frozenset(missing))
    hole = find_holes(0.05 * vertices_m, triangles)[0]
    _, more = grid_mesh(5, 5, frozenset(missing - refilled))
    old = {tuple(triangle) for triangle in triangles.tolist()}
    added = np.array([tuple(triangle) not in old for triangle in more.tolist()])
    return is_closed(more, added, np.stack([hole.loop, np.roll(hole.loop, -1)], axis=1))


def test_a_hole_is_known_in_all_its_measures():
    vertices_m, triangles = grid_mesh(4, 3, frozenset({(1, 1), (2, 1)}))
    hole, rim = find_holes(0.1 * vertices_m, triangles)
    assert set(hole.loop.tolist()) == {6, 7, 8, 11, 12, 13}
    assert (hole.rim, hole.island, rim.rim, rim.island) == (False, False, True, False)
    assert (hole.length_m, hole.area_m2) == (pytest.approx(0.6), pytest.approx(0.02))
    assert (rim.length_m, rim.area_m2) == (pytest.approx(1.4), pytest.approx(0.12))
    np.testing.assert_allclose(hole.center_m, [0.2, 0.15, 0.0], atol=1e-12)
    np.testing.assert_allclose(rim.center_m, [0.2, 0.15, 0.0], atol=1e-12)


def test_the_center_does_not_depend_on_how_finely_the_loop_is_divided():
    vertices_m, triangles = rectangle((0.0, 1.0), (0.0, 1.0))
    divided_m = np.concatenate([vertices_m, [[0.25, 0.0, 0.0], [0.5, 0.0, 0.0]]])
    triangles = np.array([[0, 4, 3], [4, 5, 3], [5, 1, 2], [5, 2, 3]], np.int32)
    np.testing.assert_allclose(find_holes(divided_m, triangles)[0].center_m, [0.5, 0.5, 0.0], atol=1e-12)


def test_holes_come_first_and_the_largest_of_each_kind_before_the_others():
    vertices_m, triangles = grid_mesh(9, 5, frozenset({(1, 1), (3, 1), (4, 1), (6, 1), (6, 2), (7, 1)}))
    small_m, small = grid_mesh(2, 2)
    vertices_m, triangles = (
        np.concatenate([vertices_m, small_m + 50]),
        np.concatenate([triangles, small + 60]),
    )
    holes = find_holes(0.05 * vertices_m, triangles)
    assert [hole.rim for hole in holes] == [False, False, False, True, True]
    np.testing.assert_allclose([hole.area_m2 / 0.05**2 for hole in holes[:3]], [3, 2, 1])
    np.testing.assert_allclose([hole.length_m / 0.05 for hole in holes[3:]], [28, 8])


@pytest.mark.parametrize(("scale", "rims"), [(0.0624, 1), (0.0626, 2)])
def test_a_loop_of_a_metre_or_more_is_a_rim(scale, rims):
    vertices_m, triangles = grid_mesh(6, 6, frozenset((x, y) for x in range(1, 5) for y in range(1, 5)))
    assert sum(hole.rim for hole in find_holes(scale * vertices_m, triangles)) == rims


@pytest.mark.parametrize("scale", [0.01, 0.05])
def test_the_areas_of_all_that_are_no_rim_make_the_hole_area(scale):
    missing = frozenset((x, y) for x, y in np.random.default_rng(3).integers(0, 12, (40, 2)).tolist())
    vertices_m, triangles = grid_mesh(12, 12, missing)
    used, corners = np.unique(triangles, return_inverse=True)
    vertices_m, triangles = scale * vertices_m[used], corners.reshape(-1, 3)
    holes = find_holes(vertices_m, triangles)
    expected_m2 = measure_quality(vertices_m, triangles, [], len(vertices_m)).hole_area_m2
    assert sum(hole.area_m2 for hole in holes if not hole.rim) == pytest.approx(expected_m2)
    assert sum(len(hole.loop) for hole in holes) == len({e for hole in holes for e in zip(
        hole.loop.tolist(), np.roll(hole.loop, -1).tolist(), strict=True)})  # fmt: skip


def test_a_piece_that_hangs_on_by_a_point_is_an_island():
    """Two diagonal squares: both loops run around triangles, but only the longer one is its part's rim."""
    vertices_m, triangles = grid_mesh(4, 4, frozenset({(x, y) for x in range(4) for y in range(4)} - {
        (0, 0), (0, 1), (1, 0), (1, 1), (2, 2)
    }))  # fmt: skip
    rim, island = find_holes(0.1 * vertices_m, triangles)
    assert (island.rim, island.island, rim.rim, rim.island) == (False, True, True, False)
    assert island.area_m2 == pytest.approx(0.01)


def test_the_hole_of_a_rolled_plane_is_no_island():
    surface = reconstruct_surface(perforated_plane(0.3, 0.01, 0.05), (0.01,))
    hole, _ = find_holes(surface.vertices_m, surface.triangles)
    assert (hole.rim, hole.island) == (False, False)
    distance_m = np.linalg.norm(surface.vertices_m[hole.loop], axis=1)
    assert np.all((distance_m > 0.05) & (distance_m < 0.07))
    np.testing.assert_allclose(hole.center_m, 0.0, atol=0.003)


def test_without_triangles_there_is_no_hole():
    assert find_holes(np.empty((0, 3)), np.empty((0, 3), np.int32)) == ()


def test_half_edges_are_found_in_their_direction_only():
    triangles = np.array([[0, 1, 2], [2, 1, 3]])
    edges = np.array([[0, 1], [1, 2], [2, 0], [2, 1], [1, 3], [3, 2], [1, 0], [0, 3], [9, 0]])
    assert half_edges(triangles, edges).tolist() == [0, 1, 2, 3, 4, 5, -1, -1, -1]
    assert half_edges(triangles[:0], edges).tolist() == 9 * [-1]


def test_beyond_an_edge_is_outside_its_triangle():
    vertices_m, triangles = rectangle((0.0, 2.0), (0.0, 1.0), z_m=0.5)
    beyond = beyond_m(vertices_m, triangles, np.array([[0, 1], [1, 2], [2, 3], [3, 0]]), 0.1)
    np.testing.assert_allclose(
        beyond, [[1, -0.1, 0.5], [2.1, 0.5, 0.5], [1, 1.1, 0.5], [-0.1, 0.5, 0.5]], atol=1e-12
    )


@pytest.mark.parametrize(
    ("refilled", "closed"),
    [
        ({(x, y) for x in (1, 2, 3) for y in (1, 2, 3)}, True),
        ({(x, y) for x in (1, 2, 3) for y in (1, 2)}, False),
        ({(x, y) for x in (1, 2, 3) for y in (1, 2, 3)} - {(2, 2)}, False),
        (set(), False),
    ],
)
def test_a_loop_is_closed_if_nothing_of_it_remains(refilled, closed):
    """Also not closed: all edges of the loop have two triangles, but the middle is still empty."""
    assert closed_by({(x, y) for x in (1, 2, 3) for y in (1, 2, 3)}, refilled) is closed


def test_another_hole_does_not_keep_a_loop_open():
    missing = {(0, 0), (3, 3)}
    vertices_m, triangles = grid_mesh(5, 5, frozenset(missing))
    hole = find_holes(0.1 * vertices_m, triangles)[0]
    _, more = grid_mesh(5, 5, frozenset({(0, 0)}))
    old = {tuple(triangle) for triangle in triangles.tolist()}
    added = np.array([tuple(triangle) not in old for triangle in more.tolist()])
    assert is_closed(more, added, np.stack([hole.loop, np.roll(hole.loop, -1)], axis=1))
