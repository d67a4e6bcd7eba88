"""What must hold for every triangle that our own ball pivoting makes, on clouds drawn at random."""

from collections import Counter

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from pipeline.surface.pivoting import Roller, roll
from pipeline.surface.pivoting.grid import build_grid, gather

SETTINGS = settings(max_examples=60, deadline=None, derandomize=True)


def unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def blob(rng, count):
    return rng.normal(size=(count, 3)), unit(rng.normal(size=(count, 3)))


def sheet(rng, count):
    """A wavy sheet, noisy along its normal."""
    x, y = rng.uniform(-2.0, 2.0, (2, count))
    z = 0.3 * np.sin(2 * x) * np.cos(2 * y) + rng.uniform(0.0, 0.15) * rng.normal(size=count)
    normals = np.stack([-0.6 * np.cos(2 * x) * np.cos(2 * y), 0.6 * np.sin(2 * x) * np.sin(2 * y), x**0])
    return np.column_stack([x, y, z]), unit(normals.T)


def ball(rng, count):
    """Points on a sphere, whose normals all point out or all in."""
    normals = unit(rng.normal(size=(count, 3)))
    return normals * (1.0 + 0.02 * rng.normal(size=(count, 1))), normals * rng.choice([-1.0, 1.0])


def lattice(rng, count):
    """Corners of cubes: many points on one ball, on one plane and on one line; some twice."""
    points = rng.integers(0, 5, (count, 3)) * rng.choice([0.4, 0.5, 1.0 / 3.0])
    return points, unit(rng.normal(size=(count, 3)) * 0.3 + [0.0, 0.0, 1.0])


def same_sphere(rng, count):
    """All points on one ball that has itself the radius to roll with."""
    normals = unit(rng.normal(size=(count, 3)))
    return 0.6 * normals, -normals


@st.composite
def clouds(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    make = draw(st.sampled_from([blob, sheet, ball, lattice, same_sphere]))
    points_m, normals = make(rng, draw(st.integers(3, 250)))
    radii_m = sorted(
        set(draw(st.lists(st.sampled_from([0.2, 0.35, 0.5, 0.6, 1.0, 3.0]), min_size=1, max_size=3)))
    )
    offset_m = draw(st.sampled_from([0.0, 100.0]))
    return points_m + offset_m, normals, tuple(radii_m)


@SETTINGS
@given(clouds())
def test_every_ball_is_empty_and_rests_on_its_three_points(cloud):
    points_m, normals, radii_m = cloud
    rolled = roll(points_m, normals, radii_m)
    radius_m = np.array(radii_m)[rolled.radius_index]
    nearest_m, _ = cKDTree(points_m).query(rolled.ball_centers_m)
    assert np.all(nearest_m >= radius_m * (1.0 - 1e-9))
    distance_m = np.linalg.norm(points_m[rolled.triangles] - rolled.ball_centers_m[:, None], axis=2)
    np.testing.assert_allclose(distance_m, np.repeat(radius_m[:, None], 3, axis=1), rtol=1e-9)


@SETTINGS
@given(clouds())
def test_triangles_fit_the_ball_and_agree_with_the_normals(cloud):
    """The circumradius is at most the ball's, the ball lies outside, and all three normals agree."""
    points_m, normals, radii_m = cloud
    rolled = roll(points_m, normals, radii_m)
    a, b, c = points_m[rolled.triangles].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    sides_m = [np.linalg.norm(side, axis=1) for side in (b - c, c - a, a - b)]
    circumradius_m = np.prod(sides_m, axis=0) / (2.0 * np.linalg.norm(normal, axis=1))
    assert np.all(circumradius_m <= np.array(radii_m)[rolled.radius_index] * (1.0 + 1e-5))
    assert np.all(np.sum((rolled.ball_centers_m - a) * unit(normal), axis=1) >= -1e-4 * circumradius_m)
    assert np.all(np.einsum("fi,fki->fk", normal, normals[rolled.triangles]) > 0.0)


@SETTINGS
@given(clouds())
def test_no_directed_edge_appears_twice(cloud):
    """So no edge has more than two triangles, the two disagree in direction, and no triangle is double."""
    points_m, normals, radii_m = cloud
    triangles = roll(points_m, normals, radii_m).triangles
    directed = Counter(map(tuple, triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))
    assert max(directed.values(), default=1) == 1
    assert len({frozenset(triangle) for triangle in triangles.tolist()}) == len(triangles)
    assert all(len(set(triangle)) == 3 for triangle in triangles.tolist())


@SETTINGS
@given(clouds())
def test_nothing_is_left_that_a_ball_could_do(cloud):
    """Three unused points on which an empty ball rests in agreement with their normals are not left over."""
    points_m, normals, radii_m = cloud
    points_m, normals = points_m[:60], normals[:60]
    used = np.unique(roll(points_m, normals, radii_m[-1:]).triangles)
    unused = np.setdiff1d(np.unique(points_m, axis=0, return_index=True)[1], used)
    tree = cKDTree(points_m)
    triples = np.stack(np.meshgrid(unused, unused, unused, indexing="ij"), axis=-1).reshape(-1, 3)
    triples = triples[(triples[:, 0] < triples[:, 1]) & (triples[:, 0] < triples[:, 2])]
    triples = triples[triples[:, 1] != triples[:, 2]]
    a, b, c = points_m[triples].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    area2 = np.sum(normal**2, axis=1)
    to_center = np.cross(normal, b - a) * np.sum((c - a) ** 2, axis=1, keepdims=True)
    to_center += np.cross(c - a, normal) * np.sum((b - a) ** 2, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_center = to_center / (2.0 * area2[:, None])
        height2 = (radii_m[-1] * (1.0 - 1e-6)) ** 2 - np.sum(to_center**2, axis=1)
        to_center += np.sqrt(height2 / area2)[:, None] * normal
    # The ball must lie on the outer side of all three points' tangent planes, wherever the search began.
    fits = (height2 > 0.0) & np.all(np.einsum("fi,fki->fk", normal, normals[triples]) > 1e-6, axis=1)
    center_m = a + np.nan_to_num(to_center, posinf=0.0, neginf=0.0)
    above = np.einsum("fki,fki->fk", center_m[:, None] - points_m[triples], normals[triples])
    fits &= np.all(above > 1e-6, axis=1)
    nearest_m, _ = tree.query(center_m[fits])
    assert np.all(nearest_m < radii_m[-1] * (1.0 - 1e-7))


@SETTINGS
@given(clouds(), st.integers(1, 7))
def test_the_same_cloud_gives_the_same_bits_in_any_batches(cloud, batch):
    points_m, normals, radii_m = cloud
    whole = roll(points_m, normals, radii_m)
    roller = Roller(points_m, normals)
    steps = [step for radius_m in radii_m for step in roller.iterate(radius_m, batch)]
    np.testing.assert_array_equal(np.concatenate([step.triangles for step in steps]), whole.triangles)
    np.testing.assert_array_equal(np.concatenate([s.ball_centers_m for s in steps]), whole.ball_centers_m)
    np.testing.assert_array_equal(roller.rolled.radius_index, whole.radius_index)
    assert max(len(step.triangles) for step in steps) <= batch


@SETTINGS
@given(st.integers(0, 2**32), st.integers(1, 300), st.floats(0.01, 3.0), st.floats(0.0, 3.0), st.booleans())
def test_the_grid_finds_exactly_what_is_in_reach(seed, count, cell_m, reach_m, far):
    rng = np.random.default_rng(seed)
    points_m = rng.uniform(-1.0, 1.0, (count, 3)) * rng.choice([0.0, 1.0], 3)
    points_m[: count // 10] *= 1e6 if far else 1.0
    grid = build_grid(points_m, np.arange(count), cell_m)
    found = np.empty(count + 1, np.int32)
    for place in rng.uniform(-1.5, 1.5, (5, 3)):
        rows = found[: gather(grid, *place, reach_m, found)]
        inside = np.flatnonzero(np.sum((points_m - place) ** 2, axis=1) <= reach_m**2)
        np.testing.assert_array_equal(np.sort(grid.ids[rows]), inside)
    assert len(grid.starts) <= 4 * count + 513
