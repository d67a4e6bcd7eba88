"""Ball pivoting on clouds whose surface is known, and what must hold for every triangle it makes."""

import numpy as np
import pytest

from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import drain
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.surface.ball_pivoting import iterate_ball, reconstruct_surface, roll_ball
from pipeline.surface.boundary import boundary_loops, edges_and_faces
from pipeline.surface.radii import spacing
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import perforated_plane, sphere

HOLE_M = 0.08


@pytest.fixture(scope="module")
def fine_plane():
    return reconstruct_surface(perforated_plane(0.3, 0.0025, HOLE_M), (0.0025,))


@pytest.mark.parametrize("factors", [(1.0,), (1.0, 2.0), (3.0,)])
def test_a_sphere_becomes_closed(factors):
    cloud = sphere(5000, radius_m=0.7)
    r_F_m, _ = spacing(cloud.points_m)
    surface = reconstruct_surface(cloud, [factor * r_F_m for factor in factors])
    edges, faces = edges_and_faces(surface.triangles)
    quality = surface.quality
    assert len(surface.vertices_m) - len(edges) + len(surface.triangles) == 2
    assert np.all(faces == 2)
    assert boundary_loops(surface.triangles) == []
    assert (quality.boundary_loops, quality.boundary_length_m, quality.hole_area_m2) == (0, 0.0, 0.0)
    assert (quality.components, quality.non_manifold_edges, quality.unused_points) == (1, 0, 0)
    assert quality.area_m2 == pytest.approx(4 * np.pi * 0.7**2, rel=0.002)


def test_triangles_are_counter_clockwise_from_outside():
    surface = reconstruct_surface(sphere(500), (0.3,))
    a, b, c = surface.vertices_m[surface.triangles].swapaxes(0, 1)
    assert np.all(np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > 0)


def test_a_disc_left_out_of_a_plane_is_the_only_hole(fine_plane):
    outer_and_inner = boundary_loops(fine_plane.triangles)
    assert len(outer_and_inner) == 2
    assert fine_plane.quality.boundary_loops == 2
    assert fine_plane.quality.hole_area_m2 == pytest.approx(np.pi * HOLE_M**2, rel=0.05)
    assert fine_plane.quality.area_m2 + fine_plane.quality.hole_area_m2 == pytest.approx(0.09, rel=0.005)
    inner = min(outer_and_inner, key=len)
    distance_m = np.linalg.norm(fine_plane.vertices_m[inner], axis=1)
    assert np.all((distance_m > HOLE_M) & (distance_m < HOLE_M + 2 * 0.0025))


def test_a_larger_ball_closes_the_hole():
    cloud = perforated_plane(0.3, 0.01, 0.03)
    small, large = (reconstruct_surface(cloud, (radius_m,)).quality for radius_m in (0.01, 0.045))
    assert (small.boundary_loops, large.boundary_loops) == (2, 1)
    assert small.hole_area_m2 > np.pi * 0.03**2
    assert large.hole_area_m2 == 0.0
    assert large.area_m2 == pytest.approx(0.09, rel=0.01)


def test_a_ball_smaller_than_half_the_spacing_falls_through():
    with pytest.raises(ReconstructionError) as error:
        reconstruct_surface(perforated_plane(0.3, 0.01, 0.0), (0.001, 0.004))
    assert str(error.value).startswith("The ball radius 0.004 m is smaller than half the point spacing 0.009")
    assert "falls through; try at least 0.009" in str(error.value)


def test_a_ball_that_touches_no_three_points_says_so():
    cloud = PointCloud(np.eye(3), normals=np.array([[0, 0, 1.0], [0, 0, -1.0], [0, 0, 1.0]]))
    with pytest.raises(
        ReconstructionError, match=r"No ball of radius 1 m rests on three points.*; try a radius of 2 m"
    ):
        reconstruct_surface(cloud, (1.0,))


@pytest.fixture(scope="module")
def bumpy() -> PointCloud:
    """600 random points on a wavy sheet."""
    xy = np.random.default_rng(4).uniform(-0.5, 0.5, (600, 2))
    x, y = 6 * xy[:, 0], 5 * xy[:, 1]
    z = 0.1 * np.sin(x) * np.cos(y)
    normals = np.column_stack([-0.6 * np.cos(x) * np.cos(y), 0.5 * np.sin(x) * np.sin(y), np.ones(600)])
    return PointCloud(
        np.column_stack([xy, z]), normals=normals / np.linalg.norm(normals, axis=1, keepdims=True)
    )


def test_every_vertex_is_used_and_an_input_point_with_its_colour():
    cloud = perforated_plane(0.2, 0.01, 0.05)
    lost = PointCloud(np.array([[0.0, 0.0, 3.0], [5.0, 0.0, 0.0]]), np.zeros((2, 3), np.uint8), np.eye(3)[:2])
    surface = reconstruct_surface(PointCloud.concatenate([lost, cloud]), (0.01,))
    assert np.array_equal(np.unique(surface.triangles), np.arange(len(surface.vertices_m)))
    assert surface.quality.unused_points == 2 + len(cloud) - len(surface.vertices_m) >= 2
    row = {tuple(point): color for point, color in zip(cloud.points_m, cloud.colors, strict=True)}
    for vertex, color in zip(surface.vertices_m, surface.colors, strict=True):
        np.testing.assert_array_equal(row[tuple(vertex)], color)


def test_the_same_cloud_gives_the_same_bits(bumpy):
    first, second = (reconstruct_surface(bumpy, (0.1, 0.05)) for _ in range(2))
    np.testing.assert_array_equal(first.triangles, second.triangles)
    np.testing.assert_array_equal(first.vertices_m, second.vertices_m)
    assert first.radii_m == (0.05, 0.1)


def test_moving_the_cloud_moves_the_surface(bumpy):
    T = rigid(rotation_exp(np.array([0.3, -1.0, 2.0])), np.array([3.0, -2.0, 1.0]))
    here, there = reconstruct_surface(bumpy, (0.06,)), reconstruct_surface(bumpy.transformed(T), (0.06,))
    assert {tuple(sorted(t)) for t in here.triangles.tolist()} == {
        tuple(sorted(t)) for t in there.triangles.tolist()
    }


@pytest.mark.parametrize(
    ("cloud", "radii_m", "says"),
    [
        (PointCloud(np.zeros((2, 3)), normals=np.zeros((2, 3))), (0.1,), "at least 3 points, not 2"),
        (PointCloud(np.zeros((0, 3)), normals=np.zeros((0, 3))), (0.1,), "at least 3 points, not 0"),
        (PointCloud(np.eye(3)), (0.1,), "needs a normal for each point"),
        (sphere(50), (), "There is no ball radius"),
        (sphere(50), (0.1, 0.0), "A ball radius is 0.0 m"),
        (sphere(50), (-0.1,), "A ball radius is -0.1 m"),
        (sphere(50), (float("nan"),), "A ball radius is nan m"),
    ],
)
def test_bad_input_gets_its_sentence(cloud, radii_m, says):
    with pytest.raises(InputError, match=says):
        reconstruct_surface(cloud, radii_m)


def test_the_steps_of_the_ball_are_its_surface_cut_into_batches():
    cloud = sphere(500)
    whole = roll_ball(cloud, (0.3, 0.2))
    steps = []
    surface = drain(iterate_ball(cloud, (0.3, 0.2), batch=100), steps.append)
    assert max(len(step.triangles) for step in steps) <= 100
    assert [step.radius_m for step in steps] == sorted(step.radius_m for step in steps)
    triangles = np.concatenate([step.triangles for step in steps])
    np.testing.assert_array_equal(cloud.points_m[triangles], whole.vertices_m[whole.triangles])
    np.testing.assert_array_equal(surface.triangles, whole.triangles)
    np.testing.assert_array_equal(surface.vertices_m, whole.vertices_m)
    centers_m = np.concatenate([step.ball_centers_m for step in steps])
    radii_m = np.repeat([step.radius_m for step in steps], [len(step.triangles) for step in steps])
    to_corners_m = np.linalg.norm(cloud.points_m[triangles] - centers_m[:, None], axis=2)
    np.testing.assert_allclose(to_corners_m, np.tile(radii_m[:, None], 3), rtol=1e-6)
