"""The compiled tree finds what a search of all points finds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.kernels.kdtree import SERIAL_POINTS, KdTree, room_for, search_many, working_space


def _all_distances_m(places_m: np.ndarray, points_m: np.ndarray) -> np.ndarray:
    return np.linalg.norm(places_m[:, None] - points_m[None], axis=2)


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 400),
    neighbours=st.integers(1, 25),
    kind=st.sampled_from(["volume", "line", "grid", "one place", "far from the origin"]),
)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_neighbours_are_those_of_a_search_of_all_points(seed, count, neighbours, kind):
    rng = np.random.default_rng(seed)
    points_m = rng.normal(size=(count, 3))
    if kind == "line":
        points_m[:, 1:] = 0.0
    if kind == "grid":
        points_m = np.round(2.0 * points_m) / 2.0
    if kind == "one place":
        points_m[:] = points_m[0]
    if kind == "far from the origin":
        points_m += 1e4
    places_m = np.concatenate([points_m[:20], points_m[:20] + rng.normal(size=points_m[:20].shape)])
    neighbours = min(neighbours, count)
    distances_m, rows = KdTree(points_m).nearest(places_m, neighbours)
    truth_m = _all_distances_m(places_m, points_m)
    np.testing.assert_allclose(distances_m, np.sort(truth_m, axis=1)[:, :neighbours], atol=1e-12)
    np.testing.assert_allclose(distances_m, np.take_along_axis(truth_m, rows, axis=1), atol=1e-12)
    assert all(len(set(some)) == neighbours for some in rows.tolist())
    tree = KdTree(points_m)
    squared, many = np.empty(room_for(neighbours)), np.zeros(room_for(neighbours), dtype=np.intp)
    for place_m, nearest_m, all_m in zip(places_m, distances_m, truth_m, strict=True):
        farthest = search_many(*tree.parts, place_m, neighbours, np.inf, squared, many, *working_space())
        some = tree.order[many[:neighbours]]
        np.testing.assert_allclose(np.sort(all_m[some]), nearest_m, atol=1e-12)
        np.testing.assert_allclose(np.sqrt(squared[:neighbours]), all_m[some], atol=1e-12)
        assert farthest == squared[:neighbours].max()
        assert len(set(some.tolist())) == neighbours


def test_a_search_on_all_cores_gives_each_place_its_own():
    rng = np.random.default_rng(1)
    points_m, places_m = rng.uniform(size=(500, 3)), rng.uniform(size=(3 * SERIAL_POINTS + 1, 3))
    distances_m, rows = KdTree(points_m).nearest(places_m, 2)
    truth_m = _all_distances_m(places_m, points_m)
    np.testing.assert_array_equal(rows, np.argsort(truth_m, axis=1)[:, :2])
    np.testing.assert_allclose(distances_m, np.sort(truth_m, axis=1)[:, :2], atol=1e-14)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_points_come_in_any_layout_and_are_left_as_they_were(order, kind):
    points_m = np.asarray(np.random.default_rng(2).uniform(size=(100, 3)), dtype=kind, order=order)
    before_m = points_m.copy()
    assert KdTree(points_m).nearest(points_m, 1)[1][:, 0].tolist() == list(range(100))
    np.testing.assert_array_equal(points_m, before_m)
