"""Grids of circles, straight or in shifted rows and of any size, found from their centres alone."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from itertools import combinations, product

import numpy as np
from scipy.spatial import cKDTree

from pipeline.calibration.board import MOST_POINTS, Board
from pipeline.calibration.grid_order import even_steps, upright_orders
from pipeline.config import Pattern
from pipeline.types import FloatArray, IntArray

NEIGHBOURS = 6
"""Nearest neighbours of the middle blob from which the two steps of the lattice are chosen."""
NEAR = 0.3
"""Largest distance of a blob from where the last step predicts it, as a share of the step."""
LEAST_SINE = 0.1
"""Least sine of the angle between the two steps."""
LEAST_SHARE = 0.5
"""Least share of the blobs that are on the board; others are letters or objects."""
LEAST_SIDE = 3
"""Least columns and rows of a board of any size."""


def boards_seen(blobs_px: FloatArray) -> Iterator[tuple[Pattern, IntArray]]:
    """Yield the pattern and the (R, C) indices of blobs of each whole grid of circles; the same grid may come
    rotated, mirrored and transposed.

    Args:
        blobs_px: (B, 2) centres of blobs.
    """
    blobs, places = _lattice(blobs_px)
    for steps in product((-1, 0, 1), repeat=4):
        change = np.array(steps).reshape(2, 2)
        if abs(steps[0] * steps[3] - steps[1] * steps[2]) != 1:
            continue
        column, row = change @ places.T
        straight = _rows(column, row, 1)
        if straight is not None:
            yield "circles", blobs[straight]
        shifted = _rows(column + row, row - column, 2)
        if shifted is not None:
            yield "circles-asymmetric", blobs[shifted]


def orders_on(board: Board, blobs_px: FloatArray) -> list[IntArray]:
    """Return the (N,) indices of a board's blobs for each possible order of its points; empty if the blobs do
    not form the board.
    """
    for pattern, rows in boards_seen(blobs_px):
        if pattern != board.pattern or rows.shape != board.size[::-1]:
            continue
        first = rows.ravel()
        if not even_steps(blobs_px[first], board):
            continue
        orders = upright_orders(board, blobs_px[first])
        if orders:
            return [first[order] for order in orders]
    return []


def board_seen(blobs_px: FloatArray, like: Board) -> Board | None:
    """Return the board of circles that blobs form, with the given one's pattern and orientation if they fit;
    None if they form none.
    """
    seen = {
        Board(pattern, rows.shape[1], rows.shape[0], like.spacing_m)
        for pattern, rows in boards_seen(blobs_px)
        if min(rows.shape) >= LEAST_SIDE and max(rows.shape) <= MOST_POINTS
    }
    seen = {one for one in seen if orders_on(one, blobs_px)}

    def likeness(one: Board) -> tuple[bool, bool, int, int]:
        wide = (one.columns >= one.rows) == (like.columns >= like.rows)
        return one.pattern == like.pattern, wide, one.columns, one.rows

    return max(seen, key=likeness, default=None)


def _lattice(blobs_px: FloatArray) -> tuple[IntArray, IntArray]:
    """Return (L,) indices of the blobs of the largest lattice, and their (L, 2) integer coordinates in some
    basis; empty if too few blobs form one.
    """
    best: dict[int, tuple[int, int]] = {}
    if LEAST_SIDE**2 <= len(blobs_px) <= MOST_POINTS**2:
        tree = cKDTree(blobs_px)
        middle = int(tree.query(np.median(blobs_px, axis=0))[1])
        around = tree.query(blobs_px[middle], NEIGHBOURS + 1)[1][1:]
        for one, other in combinations((blobs_px[around] - blobs_px[middle]).tolist(), 2):
            basis = np.array([one, other])
            sine = abs(np.linalg.det(basis)) / np.prod(np.linalg.norm(basis, axis=1))
            if sine > LEAST_SINE:
                best = max(best, _grown(blobs_px, tree, middle, basis), key=len)
    if len(best) < max(LEAST_SIDE**2, LEAST_SHARE * len(blobs_px)):
        best = {}
    return np.array(list(best), np.int64), np.array(list(best.values()), np.int64).reshape(-1, 2)


def _grown(blobs_px: FloatArray, tree: cKDTree, middle: int, basis: FloatArray) -> dict[int, tuple[int, int]]:
    """Return integer coordinates of the blobs that steps from blob to blob reach, with (0, 0) for the middle.

    Each blob inherits the step that led to it, so that the steps follow perspective and distortion.
    """
    places = {middle: (0, 0)}
    taken = {(0, 0)}
    steps = {middle: basis}
    left = deque([middle])
    while left:
        start = left.popleft()
        for axis, sign in product((0, 1), (1, -1)):
            place = places[start][0] + sign * (axis == 0), places[start][1] + sign * (axis == 1)
            if place in taken:
                continue
            step_px = steps[start][axis]
            off_px, blob = tree.query(blobs_px[start] + sign * step_px)
            if off_px > NEAR * np.linalg.norm(step_px) or blob in places:
                continue
            places[int(blob)] = place
            taken.add(place)
            own = steps[start].copy()
            own[axis] = sign * (blobs_px[blob] - blobs_px[start])
            steps[int(blob)] = own
            left.append(int(blob))
    return places


def _rows(x: IntArray, y: IntArray, every: int) -> IntArray | None:
    """Return (R, C) positions in ``x`` and ``y`` of a whole grid's blobs; None if it has gaps.

    Args:
        x: (L,) integer coordinates along the rows.
        y: (L,) integer coordinates across the rows.
        every: 1 for straight rows; 2 for rows that use every second x, with odd rows shifted by one.
    """
    if not len(x):
        return None
    x, y = x - x.min(), y - y.min()
    rows = int(y.max()) + 1
    columns, rest = divmod(len(x), rows)
    if rest or columns < 2 or rows < 2:
        return None
    shift = y % 2 if every == 2 else 0
    column, odd = np.divmod(x - shift, every)
    if odd.any() or (column < 0).any() or (column >= columns).any():
        return None
    grid = np.full((rows, columns), -1)
    grid[y, column] = np.arange(len(x))
    return None if (grid < 0).any() else grid
