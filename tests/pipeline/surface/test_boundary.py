"""Boundaries of meshes drawn by hand."""

import numpy as np
import pytest

from pipeline.surface.boundary import boundary_loops, edges_and_faces, loop_measures
from pipeline.surface.quality import measure_quality
from tests.pipeline.surface.shapes import grid_mesh, rectangle


def cycle(loop):
    """A loop from its smallest vertex on, in its own direction."""
    return tuple(np.roll(loop, -int(np.argmin(loop))).tolist())


def test_edges_are_counted_with_their_faces():
    edges, faces = edges_and_faces(np.array([[0, 1, 2], [2, 1, 3], [1, 2, 4]]))
    assert dict(zip(map(tuple, edges.tolist()), faces.tolist(), strict=True)) == {
        (0, 1): 1, (0, 2): 1, (1, 2): 3, (1, 3): 1, (2, 3): 1, (1, 4): 1, (2, 4): 1,
    }  # fmt: skip


def test_a_rectangle_has_one_loop_in_its_own_direction():
    _, triangles = rectangle((0, 1), (0, 1))
    assert [cycle(loop) for loop in boundary_loops(triangles)] == [(0, 1, 2, 3)]


def test_a_hole_is_walked_the_other_way_round():
    _, triangles = grid_mesh(3, 3, frozenset({(1, 1)}))
    loops = {cycle(loop) for loop in boundary_loops(triangles)}
    assert loops == {(0, 1, 2, 3, 7, 11, 15, 14, 13, 12, 8, 4), (5, 9, 10, 6)}


def test_holes_that_touch_in_a_vertex_are_parted_there():
    """Two diagonal squares missing: one component of the boundary, but two simple loops."""
    vertices_m, triangles = grid_mesh(4, 4, frozenset({(1, 1), (2, 2)}))
    loops = boundary_loops(triangles)
    assert sorted(map(len, loops)) == [4, 4, 16]
    assert all(len(set(loop.tolist())) == len(loop) for loop in loops)
    quality = measure_quality(0.1 * vertices_m, triangles, [], len(vertices_m))
    assert quality.boundary_loops == 2
    assert quality.hole_area_m2 == pytest.approx(0.02)
    assert quality.boundary_length_m == pytest.approx(2.4)


@pytest.mark.parametrize("missing", [{(1, 1)}, {(1, 1), (2, 1)}, {(1, 1), (1, 2), (2, 1), (3, 3)}])
def test_loops_use_every_boundary_edge_once(missing):
    vertices_m, triangles = grid_mesh(5, 5, frozenset(missing))
    edges, faces = edges_and_faces(triangles)
    walked = [
        tuple(sorted(step))
        for loop in boundary_loops(triangles)
        for step in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
    ]
    assert sorted(walked) == sorted(map(tuple, edges[faces == 1].tolist()))
    quality = measure_quality(0.05 * vertices_m, triangles, [], len(vertices_m))
    assert quality.hole_area_m2 == pytest.approx(0.05**2 * len(missing))
    assert quality.area_m2 == pytest.approx(0.05**2 * (25 - len(missing)))


def test_a_loop_of_a_metre_or_more_is_no_hole():
    vertices_m, triangles = grid_mesh(3, 3, frozenset({(1, 1)}))
    small, large = (measure_quality(s * vertices_m, triangles, [], 16).hole_area_m2 for s in (0.249, 0.25))
    assert small == pytest.approx(0.249**2)
    assert large == 0.0


def test_every_component_has_an_outer_loop_that_is_no_hole():
    vertices_m, triangles = grid_mesh(3, 3, frozenset({(1, 1)}))
    two_m = np.concatenate([0.1 * vertices_m, 0.05 * vertices_m + 2.0])
    quality = measure_quality(two_m, np.concatenate([triangles, triangles + 16]), [], 40)
    assert (quality.components, quality.boundary_loops, quality.unused_points) == (2, 4, 8)
    assert quality.hole_area_m2 == pytest.approx(0.1**2 + 0.05**2)


def test_three_triangles_on_an_edge_are_not_manifold():
    vertices_m = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]])
    triangles = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    quality = measure_quality(vertices_m, triangles, [], 5)
    assert quality.non_manifold_edges == 1
    assert set(np.concatenate(boundary_loops(triangles)).tolist()) == {0, 1, 2, 3, 4}


def test_the_area_of_a_loop_that_is_not_convex_is_exact():
    """An L of three unit squares."""
    corners_m = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    lengths_m, areas_m2 = loop_measures(
        np.column_stack([corners_m, np.zeros(6)]), [np.arange(6), np.arange(3)]
    )
    np.testing.assert_allclose(lengths_m, [8.0, 3.0 + np.sqrt(5.0)])
    np.testing.assert_allclose(areas_m2, [3.0, 1.0])


def test_without_triangles_there_is_no_boundary():
    assert boundary_loops(np.empty((0, 3), np.int32)) == []
