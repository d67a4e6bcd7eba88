"""Meshes in few bytes for a browser: 16-bit positions, 8-bit colours, differences, deflate.

A packed mesh is a deflated (zlib) sequence of little-endian ``uint32`` numbers of vertices V and triangles F,
then byte planes, each holding one byte of every number in a column, the least significant first:

1. positions, (3, V) 16 bits: steps of ``Box.step_m`` from ``Box.low_m``, as zig-zag differences to the
   vertex before;
2. colours, (3, V) 8 bits: green, red - green, blue - green, as differences to the vertex before;
3. triangles, (3, F) 32 bits: the lowest index ``a``, as difference to the triangle before, ``b - a`` and
   ``c - a``.

Vertices are in the order of a Morton curve, triangles in that of their lowest vertex: differences are small.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.drawing.ordering import curve_order, lowest_first
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import ByteArray, FloatArray, IntArray, Surface

STEPS = 65_535
"""Steps of a position along the longest side of the box."""
FEWEST_TRIANGLES = 500
"""Least number of triangles after thinning, even if there are too few bytes."""
_TRIES = 6
_LEVEL = 6
"""Compression level of deflate; 9 takes four times as long for 0.7 % fewer bytes."""


@dataclass(frozen=True, slots=True)
class Box:
    """Origin and step of the positions."""

    low_m: FloatArray
    """(3,) the lowest corner."""
    step_m: float

    @staticmethod
    def around(points_m: FloatArray) -> Box:
        """Return the bounding box of (N, 3) points, N at least 1."""
        low_m = points_m.min(axis=0)
        side_m = float((points_m.max(axis=0) - low_m).max())
        return Box(low_m, max(side_m, 1e-6) / STEPS)


def pack(mesh: Surface, box: Box) -> bytes:
    """Return a coloured mesh inside ``box`` as bytes; vertices that no triangle uses are left out."""
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    steps = np.rint((mesh.vertices_m[used] - box.low_m) / box.step_m).astype(np.int64).reshape(-1, 3)
    colors = np.zeros((len(used), 3), np.uint8) if mesh.colors is None else mesh.colors[used]
    order = curve_order(steps)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    faces = lowest_first(place[triangles.reshape(-1, 3)])
    low = faces[:, :1]
    columns = np.hstack([np.diff(low, axis=0, prepend=0), faces[:, 1:] - low])
    parts = (
        np.array([len(used), len(faces)], "<u4"),
        _planes(_zigzag(steps[order]), "<u2"),
        _planes(_differences(_decorrelated(colors[order])), "u1"),
        _planes(columns, "<u4"),
    )
    return zlib.compress(b"".join(part.tobytes() for part in parts), _LEVEL)


def pack_within(meshes: Sequence[Surface], box: Box, most_bytes: int, last: float = 4.0) -> list[bytes]:
    """Pack every mesh; thin them (Garland and Heckbert 1997) if together they take too many bytes.

    Args:
        meshes: meshes of the moments in order.
        box: bounding box of all of them.
        most_bytes: most bytes of all of them together.
        last: factor by which the last mesh may take more bytes than any other.
    """
    packed = [pack(mesh, box) for mesh in meshes]
    weights = np.array([1.0] * (len(meshes) - 1) + [last])
    share = _share(np.array([len(data) for data in packed]) / weights, weights, most_bytes)
    for row, (mesh, weight) in enumerate(zip(meshes, weights.tolist(), strict=True)):
        packed[row] = _thinned(mesh, box, packed[row], share * weight)
    return packed


def _share(needs: FloatArray, weights: FloatArray, most: float) -> float:
    """Return the largest share for which ``weights * min(needs, share)`` sums to at most ``most``."""
    order = np.argsort(needs)
    left, weight = most, float(weights.sum())
    for row in order.tolist():
        if needs[row] * weight > left:
            return left / weight
        left -= needs[row] * weights[row]
        weight -= weights[row]
    return float("inf")


def _thinned(mesh: Surface, box: Box, packed: bytes, most_bytes: float) -> bytes:
    """Return the packed mesh, with so few triangles that it fits, but at least ``FEWEST_TRIANGLES``."""
    count = len(mesh.triangles)
    for _ in range(_TRIES):
        if len(packed) <= most_bytes or count <= FEWEST_TRIANGLES:
            break
        count = max(int(0.97 * count * most_bytes / len(packed)), FEWEST_TRIANGLES)
        packed = pack(thinned(mesh, count), box)
    return packed


def thinned(mesh: Surface, triangles: int) -> Surface:
    """Return the mesh with about this many triangles; its rims hardly move."""
    legacy = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices_m), o3d.utility.Vector3iVector(mesh.triangles)
    )
    if mesh.colors is not None:
        legacy.vertex_colors = o3d.utility.Vector3dVector(mesh.colors / 255.0)
    thin = legacy.simplify_quadric_decimation(triangles)
    colors = np.rint(255.0 * np.asarray(thin.vertex_colors)).astype(np.uint8)
    low_m, high_m = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    vertices_m = np.clip(np.asarray(thin.vertices), low_m, high_m)
    return Surface(vertices_m, np.asarray(thin.triangles), colors if len(colors) else None)


def _decorrelated(rgb: ByteArray) -> ByteArray:
    green = rgb[:, 1]
    return np.column_stack([green, rgb[:, 0] - green, rgb[:, 2] - green])


def _differences(columns: ByteArray) -> ByteArray:
    """Return the differences to the row before, modulo 256."""
    before = np.vstack([np.zeros((1, 3), np.uint8), columns[:-1]])
    return columns - before[: len(columns)]


def _zigzag(steps: IntArray) -> IntArray:
    """Return zig-zag differences to the row before, modulo 65,536: small ones of either sign are small."""
    delta = np.diff(steps, axis=0, prepend=0).astype(np.int16).astype(np.int64)
    return (delta << 1) ^ (delta >> 63)


def _planes(columns: IntArray, kind: str) -> ByteArray:
    """Return the bytes of (N, 3) numbers, plane by plane."""
    numbers = np.ascontiguousarray(columns.T).astype(kind)
    bytes_ = numbers.view(np.uint8).reshape(3, len(columns), numbers.itemsize)
    return np.ascontiguousarray(np.moveaxis(bytes_, 2, 1))
