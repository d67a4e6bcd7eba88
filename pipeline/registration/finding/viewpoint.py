"""Range images of clouds seen from their origin, whose free space can refute a pose (SPEC 4.10)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.types import BoolArray, FloatArray, IntArray

POINTS_OF_CELL = 6.0
"""Least mean number of points of an occupied cell; with fewer, cells between points would be empty."""
HIDDEN_RATIO = 1.1
"""A point of a cloud seen from the origin is hidden if another in its cell is nearer by this factor."""
MOST_HIDDEN = 0.05
"""A cloud with a larger share of hidden points was not seen from the origin."""
TOLERANCE = 0.02
"""Two ranges that differ by less than this share are of the same surface."""
_LEAST_CELLS, _MOST_CELLS = 8, 512


@dataclass(frozen=True, slots=True)
class RangeImage:
    """Ranges from the origin in the directions of a cube's faces."""

    cells: int
    """Cells along an edge of a face."""
    nearest_m: FloatArray
    """(6 cells^2,) least range in each cell; NaN where there is no point."""
    farthest_m: FloatArray
    """(6 cells^2,) largest range in each cell; NaN where there is no point."""

    def compare(self, points_m: FloatArray, tolerance_m: FloatArray) -> tuple[BoolArray, BoolArray]:
        """Compare (N, 3) points with the ranges.

        Args:
            points_m: points in the cloud's frame.
            tolerance_m: (N,) tolerance of the ranges; at least ``TOLERANCE`` times the range is used.

        Returns:
            (N,) points that were in view: not hidden, nor in an empty cell; and (N,) those of them that are
            in front of the surface, in free space.
        """
        ranges_m = np.linalg.norm(points_m, axis=1)
        cell = _cells(points_m, self.cells)
        slack_m = np.maximum(TOLERANCE * ranges_m, tolerance_m)
        in_view = ranges_m <= self.farthest_m[cell] + slack_m  # NaN is not in view
        return in_view, in_view & (ranges_m < self.nearest_m[cell] - slack_m)


def range_image(points_m: FloatArray, from_camera: bool = False) -> RangeImage | None:
    """Return the ranges of a cloud that was seen from the origin of its frame; None if it was not.

    From its viewpoint one surface is seen in each direction; from elsewhere some points hide others.

    Args:
        points_m: (N, 3) points.
        from_camera: whether a camera at the origin is known to have measured them.
    """
    ranges_m = np.linalg.norm(points_m, axis=1)
    cells = _LEAST_CELLS
    while True:
        cell = _cells(points_m, cells)
        occupied = len(np.unique(cell))
        if len(points_m) < 4.0 * POINTS_OF_CELL * occupied or cells >= _MOST_CELLS:
            break
        cells *= 2
    nearest_m, farthest_m = np.full(6 * cells**2, np.inf), np.full(6 * cells**2, -np.inf)
    np.minimum.at(nearest_m, cell, ranges_m)
    np.maximum.at(farthest_m, cell, ranges_m)
    if not from_camera and np.mean(ranges_m > HIDDEN_RATIO * nearest_m[cell]) > MOST_HIDDEN:
        return None
    empty = ~np.isfinite(nearest_m)
    nearest_m[empty] = farthest_m[empty] = np.nan
    return RangeImage(cells, nearest_m, farthest_m)


def _cells(points_m: FloatArray, cells: int) -> IntArray:
    """Return (N,) the cell of each direction: the face that it meets, and its row and column there."""
    axis = np.argmax(np.abs(points_m), axis=1)
    along = np.take_along_axis(points_m, axis[:, None], axis=1)[:, 0]
    face = 2 * axis + (along < 0.0)
    scale = 1.0 / np.maximum(np.abs(along), np.finfo(float).tiny)
    rows = np.arange(len(points_m))
    u, v = (
        np.clip((0.5 * cells * (1.0 + points_m[rows, (axis + k) % 3] * scale)).astype(np.intp), 0, cells - 1)
        for k in (1, 2)
    )
    return (face * cells + u) * cells + v
