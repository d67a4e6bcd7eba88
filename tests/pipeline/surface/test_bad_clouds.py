"""What the ball makes of clouds that nobody would wish for: a mesh, or one sentence."""

import numpy as np
import pytest

from packetmesh.errors import InputError, PacketMeshError, ReconstructionError
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.boundary import edges_and_faces
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import perforated_plane, sphere

UP = np.array([0.0, 0.0, 1.0])


def facing_up(points_m) -> PointCloud:
    points_m = np.asarray(points_m, dtype=float)
    return PointCloud(points_m, normals=np.tile(UP, (len(points_m), 1)))


def test_three_points_make_one_triangle():
    surface = reconstruct_surface(facing_up([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), (1.0,))
    assert sorted(surface.triangles[0]) == [0, 1, 2]
    assert len(surface.triangles) == 1


@pytest.mark.parametrize("side", [5, 20])
def test_an_exact_flat_grid_becomes_flat_and_whole(side):
    xy = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) * 0.1
    surface = reconstruct_surface(facing_up(np.column_stack([xy, np.zeros(len(xy))])), (0.1,))
    assert len(surface.triangles) == 2 * (side - 1) ** 2
    assert surface.quality.area_m2 == pytest.approx((0.1 * (side - 1)) ** 2)
    assert surface.quality.boundary_loops == 1


def test_repeated_points_change_nothing():
    once = sphere(800)
    often = PointCloud.concatenate([once, once, once.select(np.arange(0, 800, 3))])
    first, second = (reconstruct_surface(cloud, (0.2,)) for cloud in (once, often))
    np.testing.assert_array_equal(first.vertices_m, second.vertices_m)
    np.testing.assert_array_equal(first.triangles, second.triangles)
    assert second.quality.unused_points == len(often) - len(once)


@pytest.mark.parametrize("radius_m", [5.0, 1000.0])
def test_a_ball_larger_than_the_cloud_makes_its_hull(radius_m):
    surface = reconstruct_surface(sphere(500), (radius_m,))
    edges, faces = edges_and_faces(surface.triangles)
    assert np.all(faces == 2)
    assert len(surface.vertices_m) - len(edges) + len(surface.triangles) == 2
    assert surface.quality.area_m2 == pytest.approx(4 * np.pi, rel=0.02)


def test_points_without_a_normal_stay_out():
    plane = perforated_plane(0.4, 0.02, 0.0)
    normals = plane.normals.copy()
    normals[::7] = 0.0
    surface = reconstruct_surface(PointCloud(plane.points_m, normals=normals), (0.04,))
    without = {tuple(point) for point in plane.points_m[::7]}
    assert not without & {tuple(vertex) for vertex in surface.vertices_m}
    assert len(surface.triangles) > 300


LINE = np.outer(np.arange(50.0), [0.1, 0.2, 0.3])
NOTHING = {
    "one place": (facing_up(np.ones((9, 3))), 0.1),
    "a line": (facing_up(LINE), 0.5),
    "zero normals": (PointCloud(sphere(300).points_m, normals=np.zeros((300, 3))), 0.3),
    "NaN normals": (PointCloud(sphere(300).points_m, normals=np.full((300, 3), np.nan)), 0.3),
    "too small a ball": (sphere(300), 0.01),
}


@pytest.mark.parametrize("case", NOTHING)
def test_no_surface_is_one_sentence_with_a_positive_radius_to_try(case):
    cloud, radius_m = NOTHING[case]
    with pytest.raises(ReconstructionError, match=r"; try (a radius of|at least) \d*\.?\d*[1-9]") as error:
        reconstruct_surface(cloud, (radius_m,))
    assert "\n" not in str(error.value)
    assert "nan" not in str(error.value)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_point_that_is_not_finite_is_refused(value):
    points_m = sphere(100).points_m.copy()
    points_m[17, 1] = value
    with pytest.raises(InputError, match="not finite; remove such points"):
        reconstruct_surface(PointCloud(points_m, normals=sphere(100).normals), (0.4,))


@pytest.mark.parametrize("radius_m", [0.0, -0.1, float("nan"), float("inf")])
def test_a_radius_that_is_none_is_refused_beside_good_ones(radius_m):
    with pytest.raises(PacketMeshError, match="radi"):
        reconstruct_surface(sphere(100), (0.3, radius_m))


def test_a_cloud_far_from_the_origin_is_meshed_alike():
    here, there = (
        reconstruct_surface(PointCloud(sphere(800).points_m + away, normals=sphere(800).normals), (0.2,))
        for away in (0.0, 5e5)
    )
    assert len(here.triangles) == len(there.triangles) == 2 * 800 - 4
