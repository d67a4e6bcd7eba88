"""A k-d tree of points with compiled searches, which run on all cores without Python's lock.

Unlike in SciPy's tree, a search can start from a known bound, the distance to an earlier neighbour.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from itertools import pairwise

import numba
import numpy as np

from pipeline.types import ByteArray, FloatArray, IntArray

LEAF_POINTS = 16
"""A node with more points is split."""
SERIAL_POINTS = 512
"""Fewer points are searched on the calling thread: waking other threads would take longer."""
CORES = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
"""Cores of this machine, or the lower ``NUMBA_NUM_THREADS``, set for processes that run in parallel."""
_MOST_LEVELS = 64
"""Rows of a search's stack: more than any tree has levels."""
_MOST_GUESSES = 64
"""Most thresholds that are tried to find the ``count`` smallest values."""
compiled = numba.njit(cache=True, nogil=True)


class KdTree:
    """A balanced tree: every node halves its points along the longest side of their bounding box."""

    def __init__(self, points_m: FloatArray) -> None:
        """Build the tree of (N, 3) points."""
        count = len(points_m)
        self.order = np.arange(count)
        """(N,) row of each point in the tree's order, in which the points of a leaf are adjacent."""
        self.points_m = np.ascontiguousarray(points_m, dtype=np.float64).copy()
        """(N, 3) points in the tree's order."""
        levels = levels_of(count)
        self.axes = np.zeros(max(1, 2**levels - 1), dtype=np.uint8)
        """(K,) axis along which each inner node is split; node k has the children 2k + 1 and 2k + 2."""
        self.splits_m = np.zeros(max(1, 2**levels - 1))
        """(K,) coordinate of each split."""
        self.levels = levels
        """Number of times that the points are halved."""
        if count:
            self._build()

    def _build(self) -> None:
        """Sort the points into leaves; with many points, the two halves are sorted in parallel."""
        count, levels = len(self), self.levels
        build = partial(_build, self.points_m, self.order, self.axes, self.splits_m)
        if count < 4 * SERIAL_POINTS or CORES == 1:
            build(0, 0, count, levels, 0)
            return
        build(0, 0, count, levels, levels - 1)
        other = _threads().submit(build, 2, count // 2, count, levels - 1, 0)
        build(1, 0, count // 2, levels - 1, 0)
        other.result()

    @property
    def parts(self) -> tuple[FloatArray, ByteArray, FloatArray, int]:
        """Arrays that compiled searches take: points, axes, splits and levels."""
        return self.points_m, self.axes, self.splits_m, self.levels

    def __len__(self) -> int:
        return len(self.order)

    def nearest(self, places_m: FloatArray, count: int) -> tuple[FloatArray, IntArray]:
        """Find the ``count`` nearest points of (M, 3) places.

        Returns:
            (M, count) distances, ascending, and rows of the points; ``count`` is at most N.
        """
        places_m = np.ascontiguousarray(places_m, dtype=np.float64)
        squared = np.full((len(places_m), count), np.inf)
        rows = np.zeros((len(places_m), count), dtype=np.intp)

        def search(first: int, last: int) -> None:
            _nearest(*self.parts, places_m, first, last, squared, rows)

        in_parts(search, len(places_m))
        return np.sqrt(squared), self.order[rows]


def tree_of(points_m: FloatArray) -> KdTree:
    """Return the tree of (N, 3) points that are never modified; it is cached as long as the array exists."""
    tree = _trees.get(id(points_m))
    if tree is None:
        tree = _trees[id(points_m)] = KdTree(points_m)
        weakref.finalize(points_m, _trees.pop, id(points_m), None)
    return tree


_trees: dict[int, KdTree] = {}


def levels_of(count: int) -> int:
    """Return how many times ``count`` points are halved until every leaf is small enough."""
    levels = 0
    while count > LEAF_POINTS << levels:
        levels += 1
    return levels


def in_parts(work: Callable[[int, int], None], count: int) -> None:
    """Call ``work(first, last)`` for parts of ``range(count)`` in parallel; it must release Python's lock."""
    parts = CORES if count >= SERIAL_POINTS else 1
    if parts == 1:
        work(0, count)
        return
    bounds = [count * part // parts for part in range(parts + 1)]
    others = [_threads().submit(work, *part) for part in pairwise(bounds[1:])]
    work(*bounds[:2])
    for other in others:
        other.result()


@cache
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(CORES, "k-d tree")


@compiled
def _build(
    points: FloatArray,
    order: IntArray,
    axes: ByteArray,
    splits: FloatArray,
    root: int,
    begin: int,
    end: int,
    levels: int,
    last_level: int,
) -> None:
    """Sort a node's points, and their rows with them, into its subtrees down to ``last_level``."""
    stack = np.empty((_MOST_LEVELS, 4), dtype=np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = root, begin, end, levels
    size = 1
    while size:
        size -= 1
        node, first, last, level = stack[size, 0], stack[size, 1], stack[size, 2], stack[size, 3]
        if level == last_level:
            continue
        axis = _longest_axis(points, first, last)
        middle = (first + last) // 2
        _select(points, order, first, last, middle, axis)
        axes[node], splits[node] = axis, points[middle, axis]
        for side in range(2):
            stack[size, 0], stack[size, 3] = 2 * node + 1 + side, level - 1
            stack[size, 1], stack[size, 2] = (first, middle) if side == 0 else (middle, last)
            size += 1


@compiled
def _longest_axis(points: FloatArray, first: int, last: int) -> int:
    """Return the axis along which the points' extent is largest."""
    best, longest = 0, -1.0
    for axis in range(3):
        low = high = points[first, axis]
        for i in range(first + 1, last):
            value = points[i, axis]
            low, high = min(low, value), max(high, value)
        if high - low > longest:
            best, longest = axis, high - low
    return best


@compiled
def _select(points: FloatArray, order: IntArray, first: int, last: int, middle: int, axis: int) -> None:
    """Partition the points so that none before ``middle`` has a larger coordinate than any later one."""
    low, high = first, last - 1
    while low < high:
        pivot = points[(low + high) // 2, axis]
        i, j = low, high
        while i <= j:
            while points[i, axis] < pivot:
                i += 1
            while points[j, axis] > pivot:
                j -= 1
            if i <= j:
                for k in range(3):
                    points[i, k], points[j, k] = points[j, k], points[i, k]
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@compiled
def _nearest(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    places: FloatArray,
    first: int,
    last: int,
    squared: FloatArray,
    rows: IntArray,
) -> None:
    stack, bounds = working_space()
    for i in range(first, last):
        search(points, axes, splits, levels, places[i], squared[i], rows[i], stack, bounds)


@compiled
def search(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    place: FloatArray,
    squared: FloatArray,
    rows: IntArray,
    stack: IntArray,
    bounds: FloatArray,
) -> None:
    """Find the points nearest to a place, and write them in ascending order of distance.

    Args:
        points, axes, splits, levels: parts of the tree.
        place: (3,) query point.
        squared: (k,) ascending bounds: only nearer points count; receives the points' squared distances.
        rows: (k,) receives rows in the tree's order; unchanged where no nearer point is found.
        stack, bounds: working space.
    """
    worst = len(squared) - 1
    size = _begin(len(points), levels, stack, bounds)
    while size:
        start, end, size = _next_leaf(axes, splits, place, squared[worst], stack, bounds, size)
        for j in range(start, end):
            distance = squared_distance(points[j], place)
            if distance < squared[worst]:
                k = worst
                while k > 0 and squared[k - 1] > distance:
                    squared[k], rows[k] = squared[k - 1], rows[k - 1]
                    k -= 1
                squared[k], rows[k] = distance, j


@compiled
def search_many(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    place: FloatArray,
    count: int,
    limit: float,
    squared: FloatArray,
    rows: IntArray,
    stack: IntArray,
    bounds: FloatArray,
) -> float:
    """Find the ``count`` points nearest to a place and write them unsorted, which is faster than sorted.

    Args:
        points, axes, splits, levels: parts of the tree.
        place: (3,) query point.
        count: number of points, at most N.
        limit: squared distance below which there are at least ``count`` points.
        squared, rows: (``room_for(count)``,) receive squared distances and rows in the tree's order.
        stack, bounds: working space.

    Returns:
        The squared distance of the farthest of these points.
    """
    have = 0
    size = _begin(len(points), levels, stack, bounds)
    while size:
        start, end, size = _next_leaf(axes, splits, place, limit, stack, bounds, size)
        if have + end - start >= len(squared):
            limit = min(limit, _keep_least(squared, rows, have, count))
            have = count
        for j in range(start, end):  # overwrite points that are too far: no branch to mispredict
            distance = squared_distance(points[j], place)
            squared[have], rows[have] = distance, j
            have += distance < limit
    if have > count:
        _keep_least(squared, rows, have, count)
    farthest = 0.0
    for k in range(count):
        farthest = max(farthest, squared[k])
    return farthest


@compiled
def room_for(count: int) -> int:
    """Return the length of the buffers of ``search_many``: the points it keeps, and one more."""
    return 2 * count + 24


@compiled
def _keep_least(squared: FloatArray, rows: IntArray, have: int, count: int) -> float:
    """Move the ``count`` smallest of the first ``have`` values to the front; returns an upper bound of them.

    A threshold is found by interpolating between the counts below two earlier ones. Of equal values at
    the threshold, the first are taken. The loops have no branches, which would be unpredictable.
    """
    low, high, below, above = 0.0, 0.0, 0, have
    for k in range(have):
        if squared[k] > high:
            high = squared[k]
    squared[have:] = np.inf
    for step in range(_MOST_GUESSES):
        if above == count:
            break
        share = (count - below + 0.5) / (above - below + 1.0) if step < _MOST_GUESSES // 4 else 0.5
        middle = low + share * (high - low)
        within = 0
        for k in range(len(squared)):
            within += squared[k] <= middle
        if within >= count:
            high, above = middle, within
        else:
            low, below = middle, within
    kept = 0
    for k in range(have):
        value = squared[k]
        squared[kept], rows[kept] = value, rows[k]
        kept += value <= high
    if kept > count:
        left, kept = count - below, 0
        for k in range(above):
            if squared[k] <= low or left > 0:
                left -= squared[k] > low
                squared[kept], rows[kept] = squared[k], rows[k]
                kept += 1
    return high


@compiled
def _begin(count: int, levels: int, stack: IntArray, bounds: FloatArray) -> int:
    """Put the root, with all ``count`` points, on the stack; returns the stack's size."""
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, count, levels
    bounds[0, 0] = bounds[0, 1] = bounds[0, 2] = bounds[0, 3] = 0.0
    return 1


@compiled
def _next_leaf(
    axes: ByteArray,
    splits: FloatArray,
    place: FloatArray,
    limit: float,
    stack: IntArray,
    bounds: FloatArray,
    size: int,
) -> tuple[int, int, int]:
    """Return the next leaf's start and end (0, 0 if beyond the squared ``limit``), and the stack's size."""
    size -= 1
    apart = bounds[size, 3]
    if apart >= limit:
        return 0, 0, size
    node, start, end, level = stack[size, 0], stack[size, 1], stack[size, 2], stack[size, 3]
    along_0, along_1, along_2 = bounds[size, 0], bounds[size, 1], bounds[size, 2]
    while level:
        axis = axes[node]
        middle = (start + end) // 2
        offset = place[axis] - splits[node]
        level -= 1
        old = along_0 if axis == 0 else along_1 if axis == 1 else along_2
        far = apart + offset * offset - old
        if far < limit:
            bounds[size, 0], bounds[size, 1], bounds[size, 2] = along_0, along_1, along_2
            bounds[size, axis] = offset * offset
            bounds[size, 3] = far
            stack[size, 3] = level
            if offset < 0:
                stack[size, 0], stack[size, 1], stack[size, 2] = 2 * node + 2, middle, end
            else:
                stack[size, 0], stack[size, 1], stack[size, 2] = 2 * node + 1, start, middle
            size += 1
        if offset < 0:
            node, end = 2 * node + 1, middle
        else:
            node, start = 2 * node + 2, middle
    return start, end, size


@compiled
def working_space() -> tuple[IntArray, FloatArray]:
    """Allocate working space of ``search``, to be reused by many searches."""
    return np.empty((_MOST_LEVELS, 4), dtype=np.int64), np.empty((_MOST_LEVELS, 4))


@compiled
def squared_distance(a: FloatArray, b: FloatArray) -> float:
    """Return the squared distance of two points (3,)."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return x * x + y * y + z * z
