"""The radius that a surface needs, where it is known, and what a ball of that radius leaves open."""

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree

from packetmesh.errors import InputError
from pipeline.surface.advice import NEIGHBOURS, closed_fans, needed_radii_m, suggest_radii
from pipeline.surface.normals import estimate_normals
from pipeline.surface.pivoting import roll
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import grid_mesh, perforated_plane, sphere

SQUARE, HEXAGONAL = np.sqrt(0.5), np.sqrt(1.0 / 3.0)
"""Circumradius of the triangles of a grid, in spacings."""


def plane(xy):
    """Points in z = 0 that are seen from above."""
    flat = np.zeros(len(xy))
    return PointCloud(np.column_stack([xy, flat]), normals=np.column_stack([flat, flat, flat + 1.0]))


def square_grid(side, spacing_m):
    return plane(spacing_m * np.stack(np.meshgrid(*[np.arange(side)] * 2), axis=-1).reshape(-1, 2))


def hexagonal_grid(side, spacing_m):
    column, row = np.meshgrid(np.arange(side), np.arange(side))
    return plane(spacing_m * np.column_stack([(column + row % 2 / 2).ravel(), row.ravel() * np.sqrt(0.75)]))


def random_plane(count=6000, seed=0):
    return plane(np.random.default_rng(seed).random((count, 2)))


def every(cloud):
    return np.arange(len(cloud))


@pytest.mark.parametrize(("grid", "factor"), [(square_grid, SQUARE), (hexagonal_grid, HEXAGONAL)])
@pytest.mark.parametrize("spacing_m", [0.003, 0.02, 7.0])
def test_a_grid_needs_the_circumradius_of_its_triangles(grid, factor, spacing_m):
    cloud = grid(20, spacing_m)
    needed_m = needed_radii_m(cloud, every(cloud)).reshape(20, 20)
    np.testing.assert_allclose(needed_m[1:-1, 1:-1], factor * spacing_m, rtol=1e-9)
    rim = np.ones((20, 20), dtype=bool)
    rim[1:-1, 1:-1] = False
    assert np.all(needed_m[[0, -1]] == np.inf)
    assert grid is hexagonal_grid or np.all(needed_m[rim] == np.inf)


@pytest.mark.parametrize(("grid", "factor"), [(square_grid, SQUARE), (hexagonal_grid, HEXAGONAL)])
def test_the_advice_for_a_grid_closes_all_of_it_and_a_thousandth_less_nothing(grid, factor):
    """The sides of the hexagonal grid are notched, which its widest ball closes too."""
    cloud = grid(30, 0.02)
    for one in suggest_radii(cloud)[:2]:
        assert one.radius_m == pytest.approx(factor * 0.02, rel=2e-6)
        triangles = roll(cloud.points_m, cloud.normals, (one.radius_m,)).triangles
        assert closed_fans(triangles, len(cloud)).reshape(30, 30)[1:-1, 1:-1].all()
        short = roll(cloud.points_m, cloud.normals, (0.999 * one.radius_m,))
        assert len(short.triangles) == 0


def test_the_advice_for_a_square_grid_is_one_radius_for_all_of_it():
    advice = suggest_radii(square_grid(30, 0.02))
    assert [one.name for one in advice] == ["finest", "even", "widest"]
    assert len({one.radius_m for one in advice}) == 1
    for one in advice:
        assert one.share == 1.0
        assert one.sentence == "Wide enough for 100% of the surface; rolled, it closes 100%."


def test_the_walk_around_the_hull_finds_what_a_delaunay_triangulation_says():
    cloud = random_plane(1500)
    needed_m = needed_radii_m(cloud, every(cloud))
    distances_m, found = cKDTree(cloud.points_m).query(cloud.points_m, k=NEIGHBOURS + 1)
    for row, near in enumerate(found):
        expected_m = delaunay_radius_m(cloud.points_m[near, :2])
        if 2 * expected_m > distances_m[row, -1]:
            expected_m = np.inf
        assert needed_m[row] == pytest.approx(expected_m, rel=1e-6)


def delaunay_radius_m(xy):
    """Largest circumradius of the triangles at the first point; infinite on the hull."""
    mesh = Delaunay(xy)
    if 0 in mesh.convex_hull:
        return np.inf
    a, b, c = xy[mesh.simplices[np.any(mesh.simplices == 0, axis=1)]].swapaxes(0, 1)
    sides = [np.linalg.norm(end - start, axis=1) for start, end in ((a, b), (b, c), (c, a))]
    doubled_area = np.abs(np.linalg.det(np.stack([b - a, c - a], axis=1)))
    return (sides[0] * sides[1] * sides[2] / (2 * doubled_area)).max()


def test_on_a_random_plane_the_needed_radius_foretells_every_closed_point():
    """In a plane nothing is hidden, so wide enough is also enough."""
    cloud = random_plane()
    needed_m = needed_radii_m(cloud, every(cloud))
    inner = np.isfinite(needed_m)
    assert inner.mean() > 0.85
    for one, level in zip(suggest_radii(cloud), (0.5, 0.9, 0.99), strict=True):
        closed = closed_fans(roll(cloud.points_m, cloud.normals, (one.radius_m,)).triangles, len(cloud))
        assert np.mean((closed == (needed_m <= one.radius_m))[inner]) > 0.995
        assert closed[inner].mean() == pytest.approx(level, abs=0.03)
        assert one.share == pytest.approx(level, abs=0.01)


def test_a_sphere_closes_as_the_advice_says():
    cloud = sphere(5000)
    needed_m = needed_radii_m(cloud, every(cloud))
    assert np.all(np.isfinite(needed_m))
    for one in suggest_radii(cloud):
        closed = closed_fans(roll(cloud.points_m, cloud.normals, (one.radius_m,)).triangles, len(cloud))
        assert closed.mean() == pytest.approx(np.mean(needed_m <= one.radius_m), abs=0.02)


def test_the_advice_turns_moves_and_scales_with_the_cloud():
    cloud = random_plane(2000)
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    moved = PointCloud(
        40.0 * cloud.points_m @ turn.T + np.array([5.0, -3.0, 8.0]), normals=cloud.normals @ turn.T
    )
    np.testing.assert_allclose(
        needed_radii_m(moved, every(moved)), 40.0 * needed_radii_m(cloud, every(cloud)), rtol=1e-6
    )


def test_points_of_another_sheet_do_not_count():
    """A second plane just behind the first, seen from the other side."""
    front = square_grid(20, 0.02)
    back = PointCloud(front.points_m + np.array([0.007, 0.003, -0.001]), normals=-front.normals)
    both = PointCloud.concatenate([front, back])
    inner = np.arange(400).reshape(20, 20)[3:-3, 3:-3].ravel()
    np.testing.assert_allclose(needed_radii_m(both, inner), SQUARE * 0.02, rtol=1e-9)


def test_points_at_a_gap_wider_than_their_neighbourhood_are_a_border():
    cloud = perforated_plane(0.6, 0.01, 0.1)
    needed_m = needed_radii_m(cloud, every(cloud))
    from_middle_m = np.linalg.norm(cloud.points_m, axis=1)
    assert np.all(needed_m[from_middle_m < 0.104] == np.inf)
    assert np.all(needed_m[(from_middle_m > 0.13) & (np.abs(cloud.points_m).max(axis=1) < 0.27)] < 0.0085)


def test_repeated_points_change_nothing():
    once = square_grid(12, 0.02)
    twice = PointCloud(np.repeat(once.points_m, 2, axis=0), normals=np.repeat(once.normals, 2, axis=0))
    inner = np.arange(144).reshape(12, 12)[3:-3, 3:-3].ravel()
    np.testing.assert_allclose(needed_radii_m(twice, 2 * inner), SQUARE * 0.02, rtol=1e-9)


def test_doubled_layers_leave_points_unreached_and_the_advice_says_so():
    rng = np.random.default_rng(0)
    flat = rng.random((8000, 2))
    cloud = PointCloud(np.column_stack([flat, rng.normal(0.0, 0.02, 8000)]))
    widest = suggest_radii(estimate_normals(cloud, np.array([0.5, 0.5, 9.0])))[-1]
    assert widest.share < 0.8
    assert "does not reach every point" in widest.sentence


@pytest.mark.parametrize("shape", ["line", "one place"])
def test_without_neighbours_all_around_there_is_no_advice(shape):
    x = np.arange(50.0) if shape == "line" else np.zeros(50)
    assert suggest_radii(plane(np.column_stack([x, 0 * x]))) == ()


@pytest.mark.parametrize("count", [0, 1, 3])
def test_too_few_points_get_their_sentence(count):
    with pytest.raises(InputError, match=f"at least 4 points to be read from, not {count}"):
        suggest_radii(plane(np.zeros((count, 2))))


def test_a_cloud_without_normals_gets_its_sentence():
    with pytest.raises(InputError, match="needs normals"):
        suggest_radii(PointCloud(np.eye(4, 3)))


def test_a_fan_is_closed_where_triangles_surround_the_point():
    closed = closed_fans(grid_mesh(4, 4)[1], 30)
    inner = np.zeros((5, 5), dtype=bool)
    inner[1:-1, 1:-1] = True
    np.testing.assert_array_equal(closed, np.append(inner.ravel(), np.zeros(5, dtype=bool)))
    assert not closed_fans(np.empty((0, 3), np.int32), 3).any()
