"""Our own ball pivoting on clouds whose surface is known, and beside Open3D's."""

from itertools import permutations

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import triangle_areas_m2
from pipeline.surface.boundary import boundary_loops, edges_and_faces
from pipeline.surface.normals import estimate_normals
from pipeline.surface.pivoting import Roller, iterate_roll, roll
from pipeline.surface.pivoting.ball import is_empty
from pipeline.surface.pivoting.grid import build_grid
from pipeline.surface.pivoting.roll import pivot
from pipeline.surface.radii import spacing
from pipeline.surface.voxel import voxel_average
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import perforated_plane, rectangle, sphere

UP = np.array([0.0, 0.0, 1.0])


def flat_grid(columns, rows, spacing_m=0.1):
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    points_m = spacing_m * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return points_m, np.tile(UP, (len(points_m), 1))


@pytest.mark.parametrize("factors", [(1.0,), (1.0, 2.0), (3.0,)])
def test_a_sphere_becomes_closed(factors):
    cloud = sphere(5000, radius_m=0.7)
    r_F_m, _ = spacing(cloud.points_m)
    rolled = roll(cloud.points_m, cloud.normals, [factor * r_F_m for factor in factors])
    edges, faces = edges_and_faces(rolled.triangles)
    assert 5000 - len(edges) + len(rolled.triangles) == 2
    assert np.all(faces == 2)
    assert boundary_loops(rolled.triangles) == []
    a, b, c = cloud.points_m[rolled.triangles].swapaxes(0, 1)
    assert np.all(np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > 0)
    outside_m = np.linalg.norm(rolled.ball_centers_m, axis=1) - 0.7
    assert np.all((outside_m > 0) & (outside_m < factors[-1] * r_F_m))


@pytest.mark.parametrize("columns", [2, 3, 17, 60])
@pytest.mark.parametrize("factor", [0.71, 0.75, 1.0, 2.5])
def test_an_exact_grid_closes_completely(columns, factor):
    """The four corners of every square lie on one ball; two triangles each, and no gap."""
    points_m, normals = flat_grid(columns, 20)
    triangles = roll(points_m, normals, (factor * 0.1,)).triangles
    assert len(triangles) == 2 * (columns - 1) * 19
    assert edges_and_faces(triangles)[1].max() == 2
    assert len(boundary_loops(triangles)) == 1
    np.testing.assert_allclose(triangle_areas_m2(points_m, triangles), 0.005)


@pytest.mark.parametrize("sides", [5, 6, 12, 40])
def test_a_regular_polygon_is_covered_exactly(sides):
    """All corners lie on one ball, and nothing else tells which triangles to make of them."""
    angle = 2 * np.pi * np.arange(sides) / sides
    points_m = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    triangles = roll(points_m, np.tile(UP, (sides, 1)), (1.3,)).triangles
    assert len(triangles) == sides - 2
    assert triangle_areas_m2(points_m, triangles).sum() == pytest.approx(
        sides / 2 * np.sin(2 * np.pi / sides)
    )


def test_the_surface_of_a_cube_of_lattice_points_is_closed():
    """Its inner points have no normal, and stay out."""
    points = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3)
    normals = np.where(points == 0.0, -1.0, 0.0) + np.where(points == 5.0, 1.0, 0.0)
    triangles = roll(points, normals, (0.75,)).triangles
    assert len(triangles) == 6 * 25 * 2
    assert np.all(edges_and_faces(triangles)[1] == 2)
    assert triangle_areas_m2(points, triangles).sum() == pytest.approx(150.0)


def test_a_larger_ball_goes_on_and_closes_the_hole():
    cloud = perforated_plane(0.3, 0.01, 0.03)
    roller = Roller(cloud.points_m, cloud.normals)
    small = roller.roll(0.01)
    assert len(boundary_loops(small.triangles)) == 2
    large = roller.roll(0.045)
    assert len(boundary_loops(large.triangles)) == 1
    np.testing.assert_array_equal(large.triangles[: len(small.triangles)], small.triangles)
    assert np.all(large.radius_index == (np.arange(len(large.triangles)) >= len(small.triangles)))
    assert triangle_areas_m2(cloud.points_m, large.triangles).sum() == pytest.approx(0.09, rel=0.01)


@pytest.mark.parametrize("corners", list(permutations(range(3))))
def test_a_balls_own_three_points_leave_it_empty_and_any_other_does_not(corners):
    """However deep rounding has put them."""
    points_m = 0.3 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    found = np.empty(5, np.int32)
    for ids, empty in (([0, 1, 2], True), ([0, 1, 2, 3], False)):
        grid = build_grid(points_m, np.array(ids), 2.0)
        assert is_empty(grid, found, *corners, 0.0, 0.0, 0.0, 1.0) == empty


def test_a_ball_stops_at_what_it_meets_first_though_something_just_behind_it_is_nearer():
    """Its centre goes around the z axis; it meets a far point after 90 degrees, and a near one after 352."""
    size_m = np.sqrt(1.0 - 0.1**2)

    def met_at(angle_deg, axis_m):
        """A point so far from the axis that the ball comes onto it there."""
        ahead = np.arccos((size_m**2 + axis_m**2 - 1.0) / (2.0 * size_m * axis_m))
        angle = np.radians(angle_deg) + ahead
        return axis_m * np.array([np.cos(angle), np.sin(angle), 0.0])

    points_m = np.array([[0.0, 0.0, -0.1], [0.0, 0.0, 0.1], met_at(352.0, 1.993), met_at(90.0, 1.0)])
    grid, found = build_grid(points_m, np.arange(4), 2.0), np.empty(5, np.int32)
    hit, *center_m = pivot(points_m, grid, found, 0, 1, np.array([size_m, 0.0, 0.0]), 1.0)
    assert hit == 3
    np.testing.assert_allclose(center_m, (0.0, size_m, 0.0), atol=1e-9)
    without = build_grid(points_m, np.arange(3), 2.0)
    assert pivot(points_m, without, found, 0, 1, np.array([size_m, 0.0, 0.0]), 1.0)[0] == 2


def test_the_first_triangle_is_the_one_whose_farther_corner_is_nearest():
    """Corners 1.0 and 1.2 away, not 0.5 and 1.5; what lies outside without a normal moves the grid."""
    away_m, angle = np.array([0.0, 1.0, 1.2, 0.5, 1.5]), np.radians([0.0, 200.0, 150.0, 20.0, 60.0])
    points_m = np.column_stack([away_m * np.cos(angle), away_m * np.sin(angle), 0.0 * angle])
    points_m[0, 2] = 0.001  # the first in its cell
    outside_m = -np.arange(5.0, 9.0)[:, None] * np.ones(3)
    normals = np.concatenate([np.tile(UP, (5, 1)), np.zeros((4, 3))])
    first = next(Roller(np.concatenate([points_m, outside_m]), normals).iterate(1.0, batch=1))
    assert sorted(first.triangles[0].tolist()) == [0, 1, 2]


def test_a_ball_smaller_than_half_the_spacing_falls_through():
    cloud = perforated_plane(0.3, 0.01, 0.0)
    assert len(roll(cloud.points_m, cloud.normals, (0.001, 0.004)).triangles) == 0
    assert len(roll(*flat_grid(10, 10), (0.05,)).triangles) == 0


@pytest.mark.parametrize(
    "points_m",
    [
        np.zeros((10, 3)),
        np.arange(30.0)[:, None] * [0.1, 0.2, 0.3],
        np.repeat(np.eye(3), 4, axis=0)[:2].repeat(3, axis=0),
    ],
    ids=["one place", "one line", "two places"],
)
def test_points_without_a_triangle_give_none(points_m):
    assert len(roll(points_m, np.tile(UP, (len(points_m), 1)), (0.2, 1.0, 50.0)).triangles) == 0


def test_repeated_points_count_once():
    points_m, normals = flat_grid(6, 6)
    doubled = roll(np.repeat(points_m, 3, axis=0), np.repeat(normals, 3, axis=0), (0.075,))
    assert len(doubled.triangles) == 50
    assert np.all(doubled.triangles % 3 == 0)


def test_far_points_cost_no_memory_and_change_nothing():
    points_m, normals = flat_grid(20, 20)
    with_far = np.concatenate([points_m, [[1e6, 0, 0], [0, -1e7, 3e5]]])
    triangles = roll(with_far, np.concatenate([normals, [UP, UP]]), (0.075,)).triangles
    assert len(triangles) == 2 * 19 * 19


def noisy_room(seed=0, count=60_000):
    """Floor, two walls and a box, 3 mm of noise, thinned to one point every 4 cm."""
    rng = np.random.default_rng(seed)
    faces = [
        (rectangle((-2, 2), (-2, 2))[0], 0.5),
        (rectangle((-2, 2), (0, 2.5))[0][:, [0, 2, 1]] + [0, 2, 0], 0.3),
        (rectangle((-2, 2), (0, 2.5))[0][:, [2, 0, 1]] + [2, 0, 0], 0.3),
        (rectangle((-0.5, 0.5), (-0.5, 0.5))[0] + [0, 0, 0.6], 0.05),
    ]
    parts = []
    for corners_m, share in faces:
        s, t = rng.random((2, int(share * count), 1))
        parts.append(corners_m[0] + s * (corners_m[1] - corners_m[0]) + t * (corners_m[3] - corners_m[0]))
    points_m = np.concatenate(parts)
    points_m += rng.normal(0.0, 0.003, points_m.shape)
    return estimate_normals(voxel_average(PointCloud(points_m), 0.04), np.array([-1.0, -1.0, 1.5]))


def noisy_sphere():
    cloud = sphere(6000)
    noise_m = np.random.default_rng(1).normal(0.0, 0.004, (6000, 1))
    return PointCloud(cloud.points_m + noise_m * cloud.normals, normals=cloud.normals)


def open3d_triangles(cloud, radii_m):
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    points.normals = o3d.utility.Vector3dVector(cloud.normals)
    radii = o3d.utility.DoubleVector(radii_m)
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(points, radii)
    return np.asarray(mesh.triangles)


@pytest.mark.parametrize("make", [noisy_sphere, noisy_room])
@pytest.mark.parametrize("factor", [1.0, 1.5, 2.5])
def test_open3d_covers_the_same(make, factor):
    cloud = make()
    radius_m = factor * spacing(cloud.points_m)[0]
    triangles = roll(cloud.points_m, cloud.normals, (radius_m,)).triangles
    expected = open3d_triangles(cloud, (radius_m,))
    areas_m2 = [triangle_areas_m2(cloud.points_m, mesh).sum() for mesh in (triangles, expected)]
    assert areas_m2[0] == pytest.approx(areas_m2[1], rel=0.02)
    assert len(triangles) == pytest.approx(len(expected), rel=0.03)


@pytest.mark.parametrize("make", [noisy_sphere, noisy_room])
def test_a_list_of_radii_covers_at_least_what_open3d_does(make):
    """And leaves no more rims; at a single radius the two agree, with several Open3D's stays behind."""
    cloud = make()
    radii_m = np.array([1.0, 1.5, 2.0]) * spacing(cloud.points_m)[0]
    triangles = roll(cloud.points_m, cloud.normals, radii_m).triangles
    expected = open3d_triangles(cloud, radii_m)
    areas_m2 = [triangle_areas_m2(cloud.points_m, mesh).sum() for mesh in (triangles, expected)]
    assert 0.98 * areas_m2[1] <= areas_m2[0] <= 1.1 * areas_m2[1]
    assert (edges_and_faces(triangles)[1] == 1).sum() <= (edges_and_faces(expected)[1] == 1).sum()


def test_each_edge_of_the_front_has_one_triangle_so_far():
    points_m, normals = flat_grid(6, 6)
    steps = list(iterate_roll(points_m, normals, (0.075,), batch=1))
    assert len(steps) >= 50
    for k, step in enumerate(steps):
        edges, faces = edges_and_faces(np.concatenate([one.triangles for one in steps[: k + 1]]))
        rims = set(map(tuple, edges[faces == 1].tolist()))
        assert {tuple(sorted(edge)) for edge in step.front_edges.tolist()} <= rims


def test_batches_show_the_front_and_can_be_cancelled():
    points_m, normals = flat_grid(40, 40)
    steps = iterate_roll(points_m, normals, (0.075, 0.2), batch=100)
    first = next(steps)
    assert len(first.triangles) == 100
    faces = dict(
        zip(map(tuple, (e := edges_and_faces(first.triangles))[0].tolist()), e[1].tolist(), strict=True)
    )
    assert len(first.front_edges) > 10
    assert all(faces[tuple(sorted(edge))] == 1 for edge in first.front_edges.tolist())
    assert 0.0 < first.progress < 0.5
    later = list(steps)
    progress = [step.progress for step in [first, *later]]
    assert progress == sorted(progress)
    assert progress[-1] == 1.0
    assert len(later[-1].front_edges) == 0
    assert {step.radius_m for step in later} == {0.075, 0.2}

    roller = Roller(points_m, normals)
    cancelled = roller.iterate(0.075, batch=100)
    next(cancelled)
    cancelled.close()
    assert len(roller.rolled.triangles) == 100
    assert len(roller.roll(0.1).triangles) == 2 * 39 * 39


def test_progress_is_the_share_of_points_with_a_triangle_though_a_smaller_ball_gave_them_up():
    points_m, normals = flat_grid(10, 10)
    roller = Roller(points_m, normals)
    assert len(roller.roll(0.04).triangles) == 0
    steps = roller.iterate(0.075, batch=20)
    told = [(step.progress, len(np.unique(roller.rolled.triangles)) / 100) for step in steps]
    assert len(told) > 5
    assert [progress for progress, _ in told] == pytest.approx([share for _, share in told])


@pytest.mark.parametrize(
    "radii_m", [(), (0.0,), (-0.1,), (float("nan"),), (float("inf"),), (0.1, 0.1), (0.2, 0.1)]
)
def test_bad_radii_get_their_sentence(radii_m):
    with pytest.raises(InputError, match="ball radius"):
        roll(*flat_grid(5, 5), radii_m)


@pytest.mark.parametrize(
    ("points_m", "normals", "says"),
    [
        (np.zeros((2, 3)), np.zeros((2, 3)), "at least 3 points, not 2"),
        (np.eye(3), None, "needs a normal for each point"),
        (np.eye(3), np.eye(3)[:2], "needs a normal for each point"),
        (np.full((3, 3), np.nan), np.eye(3), "not finite"),
    ],
)
def test_bad_clouds_get_their_sentence(points_m, normals, says):
    with pytest.raises(InputError, match=says):
        Roller(points_m, normals)


def test_a_batch_needs_a_triangle():
    with pytest.raises(InputError, match="batch has 0"):
        next(Roller(*flat_grid(5, 5)).iterate(0.1, batch=0))
