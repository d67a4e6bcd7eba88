"""Colours of a surface, stored by small cubes of space, so that a mesh needs no texture coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from pipeline.types import ByteArray, FloatArray, IntArray

_SIDE = 1024
"""Number of cubes along one axis that an index can address."""
_NEIGHBOURS = np.array(
    sorted(
        ((x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)), key=lambda d: np.dot(d, d)
    ),
    np.int64,
)


@dataclass(frozen=True, slots=True)
class SolidColors:
    """A ``lab.worlds.scene.Texture``: the mean colour of a surface in each cube that it passes through."""

    low_m: FloatArray
    """(3,) lowest corner of the first cube."""
    cube_m: float
    """Side of a cube."""
    keys: IntArray
    """(K,) int32, sorted numbers of the cubes that hold colour."""
    colors: ByteArray
    """(K, 3) 8-bit colours with a gamma of 2.2."""

    @classmethod
    def sampled(cls, points_m: FloatArray, rgb: FloatArray, cube_m: float) -> SolidColors:
        """Average (N, 3) linear colours at (N, 3) positions in cubes of ``cube_m`` or larger."""
        low_m = points_m.min(axis=0) - cube_m
        cube_m = max(cube_m, float(np.ptp(points_m, axis=0).max()) / (_SIDE - 4))
        cells = ((points_m - low_m) / cube_m).astype(np.int64)
        number = (cells[:, 0] * _SIDE + cells[:, 1]) * _SIDE + cells[:, 2]
        keys, inverse, count = np.unique(number, return_inverse=True, return_counts=True)
        total = [np.bincount(inverse, weights=rgb[:, c], minlength=len(keys)) for c in range(3)]
        mean = np.clip(np.stack(total, axis=1) / count[:, None], 0.0, 1.0)
        return cls(
            low_m, cube_m, keys.astype(np.int32), np.round(255.0 * mean ** (1.0 / 2.2)).astype(np.uint8)
        )

    def __call__(self, points_m: FloatArray, normals: FloatArray) -> FloatArray:
        """Return (N, 3) linear albedo at (N, 3) positions; the mean colour where nothing was sampled."""
        places = (points_m - self.low_m.astype(np.float32)) * np.float32(1.0 / self.cube_m)
        row = _rows(places, self.keys, _NEIGHBOURS)
        albedo = _LINEAR[self.colors[row]]
        lost = row < 0
        if lost.any():
            albedo[lost] = _LINEAR[self.colors].mean(axis=0)
        return albedo


@numba.njit(cache=True, nogil=True)
def _rows(places, keys, neighbours):  # type: ignore[no-untyped-def]
    """Return (N,) row of the cube at each position, or of a cube that touches it; -1 for none."""
    rows = np.full(len(places), -1, np.int64)
    for n in range(len(places)):
        x, y, z = np.int64(places[n, 0]), np.int64(places[n, 1]), np.int64(places[n, 2])
        for k in range(len(neighbours)):
            i, j, m = x + neighbours[k, 0], y + neighbours[k, 1], z + neighbours[k, 2]
            if min(i, j, m) < 0 or max(i, j, m) >= _SIDE:
                continue
            key = (i * _SIDE + j) * _SIDE + m
            row = np.searchsorted(keys, key)
            if row < len(keys) and keys[row] == key:
                rows[n] = row
                break
    return rows


_LINEAR = ((np.arange(256) / 255.0) ** 2.2).astype(np.float32)
