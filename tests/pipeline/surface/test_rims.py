"""Even rims: what is dropped, closed and moved, and what must not change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.config import PRESETS
from pipeline.surface.ball_pivoting import roll_ball
from pipeline.surface.boundary import boundary_loops, edges_and_faces, loop_measures
from pipeline.surface.rims import even_rims
from pipeline.types import PointCloud, PointSource, Surface
from tests.pipeline.surface.shapes import sphere

SPACING_M = 0.01


def flat(xy, triangles, source=None) -> Surface:
    """A surface in the plane z = 0, facing up, in units of the spacing."""
    xy = np.asarray(xy, float)
    count = len(xy)
    return Surface(
        vertices_m=SPACING_M * np.column_stack([xy, np.zeros(count)]),
        triangles=np.array(triangles, np.int32),
        colors=np.arange(3 * count, dtype=np.uint8).reshape(-1, 3),
        radii_m=(2.0 * SPACING_M,),
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        source=np.full(count, PointSource.SENSOR, np.uint8) if source is None else np.array(source, np.uint8),
        rows=np.arange(count, dtype=np.int32) + 7,
    )


def strip(width: int) -> tuple[list[tuple[float, float]], list[tuple[int, int, int]]]:
    """A row of squares between y = 0 and y = -1, each of two triangles; vertex k of y = 0 comes first."""
    xy = [(x, 0.0) for x in range(width + 1)] + [(x, -1.0) for x in range(width + 1)]
    low = width + 1
    triangles = [
        corner for x in range(width) for corner in ((x, low + x, x + 1), (x + 1, low + x, low + x + 1))
    ]
    return xy, triangles


@pytest.fixture
def ragged():
    """A sheet with a round hole, made by the ball of points that scatter within the plane."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(50.0), np.arange(50.0))
    xy = np.column_stack([x.ravel(), y.ravel()]) + rng.uniform(-0.25, 0.25, (2500, 2))
    xy = xy[np.linalg.norm(xy - 24.5, axis=1) > 10.0]
    points_m = SPACING_M * np.column_stack([xy, np.zeros(len(xy))])
    cloud = PointCloud(points_m, normals=np.tile([0.0, 0.0, 1.0], (len(xy), 1)))
    return roll_ball(cloud, [0.9 * SPACING_M, 1.2 * SPACING_M])


def hole_loops(surface: Surface) -> list[np.ndarray]:
    """The loop around the round hole."""
    return [loop for loop in boundary_loops(surface.triangles) if 30 < len(loop) < 120]


def hole_radii_m(surface: Surface) -> np.ndarray:
    """Distance of the hole's rim vertices from its middle."""
    return np.linalg.norm(surface.vertices_m[hole_loops(surface)[0], :2] - 24.5 * SPACING_M, axis=1)


def areas_m2(surface: Surface) -> np.ndarray:
    """Signed area of each triangle seen from above."""
    a, b, c = surface.vertices_m[surface.triangles].swapaxes(0, 1)
    return 0.5 * np.cross(b - a, c - a)[:, 2]


def test_a_round_hole_is_rounder_and_as_large(ragged):
    even = even_rims(ragged, np.full(len(ragged.vertices_m), 0.6 * SPACING_M))
    before, after = hole_radii_m(ragged), hole_radii_m(even.surface)
    assert after.std() < 0.7 * before.std()
    assert after.mean() == pytest.approx(before.mean(), abs=0.25 * SPACING_M)
    lengths = [max(loop_measures(s.vertices_m, hole_loops(s))[0]) for s in (ragged, even.surface)]
    assert lengths[1] < 0.97 * lengths[0]


@pytest.mark.parametrize("sigma", [0.05, 0.3, 3.0])
def test_no_vertex_leaves_half_its_noise_or_its_plane_and_no_triangle_turns(ragged, sigma):
    even = even_rims(ragged, np.full(len(ragged.vertices_m), sigma * SPACING_M))
    surface = even.surface
    from_m = ragged.vertices_m[np.searchsorted(ragged.rows, surface.rows)]
    moved_m = np.linalg.norm(surface.vertices_m - from_m, axis=1)
    np.testing.assert_allclose(moved_m, even.moved_m, atol=1e-12)
    assert 0.0 < moved_m.max() <= 0.5 * sigma * SPACING_M + 1e-12
    assert np.all(surface.vertices_m[:, 2] == 0.0)
    assert areas_m2(surface).min() > 0.0
    assert edges_and_faces(surface.triangles)[1].max() == 2
    inner = np.ones(len(surface.vertices_m), bool)
    inner[np.concatenate(boundary_loops(surface.triangles))] = False
    assert np.all(even.moved_m[inner] == 0.0)


def test_without_noise_nothing_moves(ragged):
    unknown = np.full(len(ragged.vertices_m), np.nan)
    for sigma_m in (None, unknown):
        assert np.all(even_rims(ragged, sigma_m).moved_m == 0.0)


def test_a_guess_stays_where_it_is(ragged):
    guessed = ragged.vertices_m[:, 0] > 0.245
    surface = replace(ragged, source=guessed.astype(np.uint8))
    even = even_rims(surface, np.full(len(guessed), 0.3 * SPACING_M))
    assert np.all(even.moved_m[even.surface.source == PointSource.INFERRED] == 0.0)
    assert np.any(even.moved_m[even.surface.source == PointSource.SENSOR] > 0.0)


def test_a_sharp_notch_is_closed_by_one_triangle():
    xy, triangles = strip(2)
    xy += [(0.5, 0.8), (1.5, 0.8)]  # two teeth, and a notch of 64 degrees between them
    even = even_rims(flat(xy, [*triangles, (0, 1, 6), (1, 2, 7)]), None)
    assert (even.closed, even.dropped) == (1, 0)
    assert sorted(even.surface.triangles[-1].tolist()) == [1, 6, 7]
    assert areas_m2(even.surface).min() > 0.0


@pytest.mark.parametrize(("guessed", "closed"), [((), 1), ((6,), 1), ((6, 7), 0)])
def test_a_notch_between_two_guesses_stays_open(guessed, closed):
    xy, triangles = strip(2)
    xy += [(0.5, 0.8), (1.5, 0.8)]
    source = np.isin(np.arange(8), guessed)
    assert even_rims(flat(xy, [*triangles, (0, 1, 6), (1, 2, 7)], source), None).closed == closed


def test_a_missing_triangle_is_put_back():
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0))
    points_m = SPACING_M * np.column_stack(
        [x.ravel() + 0.5 * (y.ravel() % 2), 0.87 * y.ravel(), np.zeros(36)]
    )
    whole = roll_ball(PointCloud(points_m, normals=np.tile([0.0, 0.0, 1.0], (36, 1))), [SPACING_M])
    middle = np.argmin(
        np.linalg.norm(whole.vertices_m[whole.triangles].mean(axis=1) - points_m.mean(0), axis=1)
    )
    even = even_rims(replace(whole, triangles=np.delete(whole.triangles, middle, axis=0)), None)
    triangles = {tuple(sorted(corners)) for corners in even.surface.triangles.tolist()}
    assert tuple(sorted(whole.triangles[middle].tolist())) in triangles
    assert len(boundary_loops(even.surface.triangles)) == 1


def test_spikes_and_hanging_triangles_go_with_their_vertices():
    xy, triangles = strip(3)
    xy += [(1.5, 5.0), (-1.0, 0.2), (-1.0, 1.0)]  # a spike on the second square, a triangle at corner 0
    surface = flat(xy, [*triangles, (1, 2, 8), (0, 10, 9)])
    even = even_rims(surface, None)
    assert (even.dropped, even.closed) == (2, 0)
    assert even.surface.rows.tolist() == list(range(7, 15))
    np.testing.assert_array_equal(even.surface.colors, surface.colors[:8])
    np.testing.assert_array_equal(even.surface.triangles, triangles)
    assert len(even.surface.vertices_m) == len(even.surface.normals) == len(even.surface.source) == 8


def test_a_blunt_tooth_and_a_triangle_for_itself_stay():
    xy, triangles = strip(3)
    xy += [(1.5, 0.6), (9.0, 9.0), (10.0, 9.0), (9.5, 9.9)]
    even = even_rims(flat(xy, [*triangles, (1, 2, 8), (9, 10, 11)]), None)
    assert even.dropped == 0


def test_two_triangles_that_hang_on_each_other_stay():
    bow = flat([(0, 0), (1, 0.5), (1, -0.5), (-1, 0.5), (-1, -0.5)], [(0, 2, 1), (0, 3, 4)])
    assert even_rims(bow, None).dropped == 0


def test_a_closed_surface_and_an_empty_one_do_not_change():
    ball = roll_ball(sphere(500), [0.3])
    even = even_rims(ball, np.full(len(ball.vertices_m), 0.1))
    np.testing.assert_array_equal(even.surface.vertices_m, ball.vertices_m)
    np.testing.assert_array_equal(even.surface.triangles, ball.triangles)
    empty = replace(ball, vertices_m=np.empty((0, 3)), triangles=np.empty((0, 3), np.int32))
    assert even_rims(empty, None).surface is empty


def test_moving_the_cloud_moves_the_answer(ragged):
    sigma_m = np.full(len(ragged.vertices_m), 0.3 * SPACING_M)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    away = replace(ragged, vertices_m=ragged.vertices_m @ turn.T + 1.0, normals=ragged.normals @ turn.T)
    here, there = even_rims(ragged, sigma_m).surface, even_rims(away, sigma_m).surface
    np.testing.assert_array_equal(here.triangles, there.triangles)
    np.testing.assert_allclose(here.vertices_m @ turn.T + 1.0, there.vertices_m, atol=1e-9)


def test_only_our_preset_evens_rims():
    assert PRESETS["packetmesh"].surface.even_rims
    assert not PRESETS["thesis"].surface.even_rims
