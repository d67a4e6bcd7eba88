"""The walk of the ball: what it did, and that it really rolls from one rest to the next."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import drain
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.pivoting import iterate_roll, roll
from pipeline.surface.walk import Kind, ball_on_arc, hole_on_flat_ground, iterate_walk, nearest_rows
from tests.pipeline.surface.shapes import perforated_plane, sphere

SETTINGS = settings(max_examples=25, deadline=None, derandomize=True)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def ball(rng, count):
    normals = unit(rng.normal(size=(count, 3)))
    return normals * (1.0 + 0.02 * rng.normal(size=(count, 1))), normals


def room(rng, count):
    """A floor and two walls that meet in a corner, noisy as a sensor sees them, normals inwards."""
    axis = rng.integers(0, 3, count)
    points_m = rng.uniform(0.0, 2.0, (count, 3))
    points_m[np.arange(count), axis] = 0.01 * rng.normal(size=count)
    return points_m, np.eye(3)[axis]


@st.composite
def walks(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    points_m, normals = draw(st.sampled_from([ball, room]))(rng, draw(st.integers(60, 400)))
    radii_m = draw(st.sampled_from([(0.35,), (0.2, 0.5), (0.15, 0.3, 0.6)]))
    try:
        return drain(iterate_walk(points_m + draw(st.sampled_from([0.0, 30.0])), normals, radii_m))
    except ReconstructionError:
        return drain(iterate_walk(points_m, normals, (0.9,)))


@SETTINGS
@given(walks())
def test_the_ball_rolls_on_its_edge_and_never_through_a_point(walk):
    """At share 0 it rests on the parent, at 1 on the triangle, and it is empty all along its arc."""
    triangles = np.arange(len(walk.triangles))
    radius_m = np.array(walk.radii_m)[walk.radius_index]
    rolled = walk.parent >= 0
    tree = cKDTree(walk.vertices_m)
    for share in (0.0, 0.07, 0.25, 0.5, 0.81, 1.0):
        center_m = ball_on_arc(walk, triangles, share)
        for corner in (0, 1):
            distance_m = np.linalg.norm(center_m - walk.vertices_m[walk.triangles[:, corner]], axis=1)
            np.testing.assert_allclose(distance_m, radius_m, rtol=1e-8)
        nearest_m, _ = tree.query(center_m)
        assert np.all(nearest_m >= radius_m * (1.0 - 1e-6))
    np.testing.assert_allclose(ball_on_arc(walk, triangles, 1.0), walk.ball_centers_m, atol=1e-7)
    parents = walk.vertices_m[walk.triangles[walk.parent[rolled]]]
    at_start_m = ball_on_arc(walk, triangles[rolled], 0.0)
    distance_m = np.linalg.norm(parents - at_start_m[:, None], axis=2)
    np.testing.assert_allclose(distance_m, np.repeat(radius_m[rolled, None], 3, axis=1), rtol=1e-6)
    same = walk.radius_index[walk.parent[rolled]] == walk.radius_index[rolled]
    made_m = walk.ball_centers_m[walk.parent[rolled]]
    np.testing.assert_allclose(at_start_m[same], made_m[same], atol=1e-7)
    normal = np.cross(parents[:, 1] - parents[:, 0], parents[:, 2] - parents[:, 0])
    assert np.all(np.sum((at_start_m - parents[:, 0]) * normal, axis=1) > -1e-9)
    assert np.all((walk.turn_rad > -1e-3) & (walk.turn_rad < 2 * np.pi))


@SETTINGS
@given(walks())
def test_parents_and_kinds_tell_how_a_triangle_came_about(walk):
    used = set()
    for triangle, (corners, parent, kind) in enumerate(
        zip(walk.triangles.tolist(), walk.parent.tolist(), walk.kind.tolist(), strict=True)
    ):
        if kind == Kind.SEED:
            assert parent == -1
            assert used.isdisjoint(corners)
        else:
            assert 0 <= parent < triangle
            before = walk.triangles[parent].tolist()
            assert (corners[1], corners[0]) in {(before[k], before[k - 2]) for k in range(3)}
            assert (kind == Kind.GLUE) == (corners[2] in used)
        used.update(corners)


@pytest.mark.parametrize("batch", [1, 37])
def test_the_front_of_every_step_can_be_told_from_the_edges_that_found_nothing(batch):
    cloud = perforated_plane(0.5, 0.02, 0.08)
    radii_m = (0.016, 0.03)
    walk = drain(iterate_walk(cloud.points_m, cloud.normals, radii_m, batch))
    steps = list(iterate_roll(cloud.points_m, cloud.normals, radii_m, batch))
    assert len(walk.step_ends) == len(steps)
    starts, ends = walk.triangles.reshape(-1), walk.triangles[:, [1, 2, 0]].reshape(-1)
    own = np.arange(len(starts)) // 3
    for index, (step, count) in enumerate(zip(steps, walk.step_ends, strict=True)):
        assert walk.radii_m[walk.step_radius[index]] == step.radius_m
        active = walk.left_front[walk.step_radius[index]] > index
        active &= own < count
        front = set(map(tuple, step.front_edges.tolist()))
        assert set(zip(starts[active].tolist(), ends[active].tolist(), strict=True)) == front
        is_open = (own < count) & (walk.glued_by >= count)
        assert np.all(is_open[active])
        edges, faces = edges_and_faces(walk.triangles[:count])
        rims = set(map(tuple, edges[faces == 1].tolist()))
        assert {(min(e), max(e)) for e in zip(starts[is_open], ends[is_open], strict=True)} == rims
    np.testing.assert_array_equal(walk.triangles, roll(cloud.points_m, cloud.normals, radii_m).triangles)


def test_a_sphere_has_one_seed_and_every_pivot_is_a_step():
    cloud = sphere(400)
    walk = drain(iterate_walk(cloud.points_m, cloud.normals, (0.2,)))
    assert np.flatnonzero(walk.kind == Kind.SEED).tolist() == [0]
    assert np.sum(walk.kind == Kind.JOIN) == 400 - 3
    assert len(walk.triangles) == 2 * 400 - 4
    np.testing.assert_array_equal(np.diff(walk.step_ends), [1] * (len(walk.triangles) - 1) + [0])
    assert np.all(walk.glued_by < len(walk.triangles))


def test_progress_grows_and_the_walk_can_be_left():
    cloud = sphere(500)
    walking = iterate_walk(cloud.points_m, cloud.normals, (0.1, 0.2))
    fractions = [said.fraction for said in walking]
    assert fractions == sorted(fractions)
    assert 10 < len(fractions) <= 50
    walking = iterate_walk(cloud.points_m, cloud.normals, (0.1, 0.2))
    next(walking)
    walking.close()


def test_a_ball_that_falls_through_everywhere_is_told():
    cloud = sphere(500)
    with pytest.raises(ReconstructionError, match=r"of up to 0\.01 m rests on three of these 500 points"):
        drain(iterate_walk(cloud.points_m, cloud.normals, (0.01,)))


def test_the_place_to_look_at_is_on_the_rim_of_a_hole():
    cloud = perforated_plane(1.0, 0.02, 0.1)
    triangles = roll(cloud.points_m, cloud.normals, (0.02,)).triangles
    center_m = hole_on_flat_ground(cloud.points_m, cloud.normals, triangles, 300)
    assert 0.1 < np.linalg.norm(center_m) < 0.13
    rows = nearest_rows(cloud.points_m, center_m, 300)
    assert len(rows) == 300
    distances_m = np.linalg.norm(cloud.points_m - center_m, axis=1)
    assert distances_m[rows].max() <= np.delete(distances_m, rows).min()
    assert np.all(np.diff(rows) > 0)


def test_without_a_hole_the_place_to_look_at_is_on_the_surface():
    cloud = sphere(300)
    triangles = roll(cloud.points_m, cloud.normals, (0.3,)).triangles
    assert np.linalg.norm(hole_on_flat_ground(cloud.points_m, cloud.normals, triangles, 50)) == pytest.approx(
        1.0
    )
    with pytest.raises(InputError, match="no surface to look at"):
        hole_on_flat_ground(cloud.points_m, cloud.normals, triangles[:0], 50)
    with pytest.raises(InputError, match="place to look at is"):
        nearest_rows(cloud.points_m, np.full(3, np.nan), 10)
