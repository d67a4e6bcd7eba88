"""Photographs on a mesh, in the form that renderers and files have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.types import BoolArray, ByteArray, FloatArray, IntArray

WHITE_ROWS = 16
"""Number of white rows below the photographs of a ``Texture``."""


@dataclass(frozen=True, slots=True)
class Corners:
    """A mesh whose vertices are repeated once for each photograph from which they take colours."""

    vertices: IntArray
    """(W,) index of each vertex in the original mesh."""
    triangles: IntArray
    """(F, 3) int32."""
    uv: FloatArray
    """(W, 2) float32 image coordinates, shares from the upper left corner (glTF); white where no camera sees
    the triangle."""
    seen: BoolArray
    """(W,) False where no camera sees the triangles."""


@dataclass(frozen=True, slots=True)
class Texture:
    """Photographs and texture coordinates for the triangles of one mesh."""

    image: ByteArray
    """(H, W, 3) RGB: the photographs in a grid, and below them ``WHITE_ROWS`` white rows."""
    camera: IntArray
    """(F,) int32 camera whose photograph is used for each triangle; -1 if no camera sees it."""
    uv: FloatArray
    """(C, V, 2) float32 texture coordinates of each vertex in each camera's photograph."""

    def corners(self, triangles: IntArray) -> Corners:
        """Return the mesh in the form that renderers need, from the (F, 3) triangles of the original mesh."""
        count = self.uv.shape[1]
        keys = (self.camera[:, None].astype(np.int64) + 1) * count + triangles
        used, inverse_of = np.unique(keys, return_inverse=True)
        cameras, vertices = used // count - 1, used % count
        white = 0.5, 1.0 - 0.5 * WHITE_ROWS / self.image.shape[0]
        uv = np.where(cameras[:, None] >= 0, self.uv[np.maximum(cameras, 0), vertices], white)
        joined = inverse_of.reshape(triangles.shape).astype(np.int32)
        return Corners(vertices, joined, uv.astype(np.float32), cameras >= 0)
