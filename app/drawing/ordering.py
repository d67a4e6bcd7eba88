"""Orders of vertices and triangles in which neighbours follow each other, so that differences are small."""

from __future__ import annotations

import numpy as np

from pipeline.types import FloatArray, IntArray

_BITS = 10
"""Bits of each coordinate along a Morton curve."""


def curve_order(places: FloatArray | IntArray) -> IntArray:
    """Return (N,) rows of (N, 3) points along a Morton curve (Morton 1966) through their box."""
    if not len(places):
        return np.empty(0, np.int64)
    low = places.min(axis=0)
    side = max(float((places.max(axis=0) - low).max()), 1e-12)
    cells = np.minimum((places - low) * ((1 << _BITS) / side), (1 << _BITS) - 1).astype(np.int64)
    code = np.zeros(len(cells), np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def lowest_first(triangles: IntArray) -> IntArray:
    """Turn each of (F, 3) triangles so that its lowest index is first (orientation kept), and sort them."""
    turns = (np.argmin(triangles, axis=1)[:, None] + np.arange(3)) % 3
    turned = np.take_along_axis(triangles, turns, axis=1)
    return turned[np.lexsort(turned.T[::-1])]


def reordered(places: FloatArray | IntArray, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Return (V,) rows of the vertices in the order of a walk, and the (F, 3) triangles of those.

    The walk over the mesh begins each piece at its first vertex along a curve.
    """
    from pipeline.kernels.fans import walked  # loads numba, which the serving process does without

    along = curve_order(places)
    place = np.empty_like(along)
    place[along] = np.arange(len(along))
    order, faces = walked(place[triangles.reshape(-1, 3)], len(along))
    return along[order], faces
