"""Arrays and binary glTF in few bytes for the page, which unpacks them to the same bytes (``packing.js``).

Packed content is a little-endian ``uint32`` length of a JSON list of parts, the list, then the bytes of each
part. Unpacked, the parts follow each other without a gap. A part is one of

- ``["raw", n]``: n bytes as they are;
- ``["rows", n, columns, bytes, stride]``: n rows of little-endian integers of 1, 2 or 4 bytes, a row every
  ``stride`` bytes (zeros fill it up), as differences to the row before;
- ``["vertices", n, columns, bytes, stride, unit]``: the same for the vertices of the content's triangles, as
  multiples of ``unit``. The difference of vertex K is to a mean, rounded down: that of the corners with an
  index below K in the first triangle that has the corner K. Without such corners it is to the row before;
- ``["grid", n, columns, bits]``: rows of 32-bit floats, each an integer over 2^bits, as differences of those;
- ``["triangles", n, bytes]``: rows of three indices (a, b, c), each as three differences. With (a', b', c')
  the row above, zeros above the first, and N one more than the greatest of a and all indices above, they are
  a - a'; c' - b if a = a' and the row is not the first, else N - b; and max(N, b + 1) - c. In the order of a
  walk (``ordering.py``) nearly all are 0 or 1;
- ``["colors", n]``: rows of RGB bytes: green, red - green, blue - green, as differences to the row before;
- ``["light", n]``: rows of linear RGB and opacity 1 of 16 bits, which are sRGB bytes packed as ``colors``.

Differences are modulo the size of the numbers, zig-zag (0, -1, 1, -2 are 0, 1, 2, 3), in planes: the lowest
bytes of the first column's numbers, then their next bytes, then the next column. Colours are not zig-zag.
Deflate finds little to do in the values themselves, and much in such planes.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.drawing.glb import LINEAR, Parts
from pipeline.types import ByteArray, IntArray

GRID_BITS = 12
"""Binary digits after the point of coordinates that ``rounded`` leaves: steps of 0.24 mm."""
_GRID_MOST = 1 << 30
_FEW_COLUMNS = 4
Part = tuple[list[Any], bytes]
"""The description of a part, and its bytes."""
_SHADE = np.full(1 << 16, 0, np.uint8)
_SHADE[LINEAR] = np.arange(256)


def rounded(points_m: NDArray[np.floating]) -> NDArray[np.float32]:
    """Round coordinates, in an array of any shape, to the grid that packs well: by up to 0.12 mm each."""
    return _of_grid(np.rint(points_m.astype(np.float64) * (1 << GRID_BITS)))


def _of_grid(steps: NDArray[Any]) -> NDArray[np.float32]:
    positions: NDArray[np.float32] = (steps / float(1 << GRID_BITS) + 0.0).astype(np.float32)  # no -0
    return positions


def pack(content: bytes | NDArray[Any]) -> bytes:
    """Pack an array of rows, or a file, which only gains if ``glb.py`` wrote it."""
    if isinstance(content, np.ndarray):
        parts = [_packed_array(content)]
    elif content.startswith(b"glTF") and Parts.of(content).is_own:
        parts = [part for part in _packed_gltf(content) if part[1]]
    else:
        parts = [_raw(content)]
    head = json.dumps([described for described, _ in parts], separators=(",", ":")).encode()
    return b"".join([struct.pack("<I", len(head)), head, *(data for _, data in parts)])


def _packed_array(array: NDArray[Any]) -> Part:
    if array.ndim != 2 or not 0 < array.shape[1] <= _FEW_COLUMNS or array.dtype.byteorder == ">":
        return _raw(array.tobytes())
    if array.dtype == np.uint8 and array.shape[1] == 3:
        return ["colors", len(array)], _color_planes(array)
    if array.dtype == np.float32:
        steps = array.astype(np.float64) * (1 << GRID_BITS)
        if np.all(np.abs(steps) < _GRID_MOST):
            whole = steps.astype("<i4")
            if _of_grid(whole).tobytes() == array.tobytes():
                return ["grid", *array.shape, GRID_BITS], _planes(_differences(whole))
    if array.dtype.itemsize not in (1, 2, 4) or array.dtype.kind not in "iuf":
        return _raw(array.tobytes())
    return _rows(np.ascontiguousarray(array).view(f"<u{array.dtype.itemsize}"))


def _packed_gltf(glb: bytes) -> Iterator[Part]:
    """Yield the parts of a binary glTF: its accessors' arrays in differences, the rest as it is."""
    parts = Parts.of(glb)
    kinds = {row: name for name, row in parts.primitive["attributes"].items()}
    triangles = parts.triangles
    done, start = 0, len(glb) - len(parts.body)
    for row, accessor in enumerate(parts.head["accessors"]):
        view = parts.head["bufferViews"][accessor["bufferView"]]
        first = start + view["byteOffset"]
        yield _raw(glb[done:first])
        numbers = parts.array(row)
        if row not in kinds:
            yield _packed_indices(numbers, triangles)
        elif kinds[row] == "COLOR_0":
            yield ["light", len(numbers)], _color_planes(_SHADE[numbers[:, :3]])
        else:
            yield _packed_vertices(numbers.view(f"<u{numbers.itemsize}"), view["byteStride"], triangles)
        done = first + view["byteLength"]
    yield _raw(glb[done:])


def _packed_indices(indices: NDArray[np.unsignedinteger], triangles: IntArray | None) -> Part:
    if triangles is None:
        return _rows(indices.reshape(-1, 2))
    return ["triangles", len(triangles), indices.itemsize], _triangle_planes(triangles, indices.itemsize)


def _packed_vertices(numbers: NDArray[np.unsignedinteger], stride: int, triangles: IntArray | None) -> Part:
    size = numbers.itemsize
    if triangles is None:
        return ["rows", *numbers.shape, size, stride], _planes(_differences(numbers))
    unit = max(int(np.gcd.reduce(numbers, axis=None)), 1)
    steps = (numbers // unit).astype(np.int64)
    planes = _planes(_zigzag(steps - _expected(steps, triangles), size))
    return ["vertices", *numbers.shape, size, stride, unit], planes


def _expected(rows: NDArray[np.int64], triangles: IntArray) -> NDArray[np.int64]:
    """Return the rows from which those of the vertices differ: see ``vertices`` in the module's text."""
    expected = np.vstack([np.zeros((1, rows.shape[1]), np.int64), rows[:-1]])
    flat = triangles.reshape(-1)
    named = np.flatnonzero(flat < len(rows))[::-1]
    first = np.full(len(rows), -1)
    first[flat[named]] = named  # of equal vertices the last assignment counts, which is the first corner
    vertices = np.flatnonzero(first >= 0)
    corners = triangles[first[vertices] // 3]
    known = corners < vertices[:, None]
    total = np.where(known[:, :, None], rows[np.where(known, corners, 0)], 0).sum(axis=1)
    count = known.sum(axis=1)
    expected[vertices[count > 0]] = total[count > 0] // count[count > 0, None]
    return expected


def _triangle_planes(triangles: IntArray, size: int) -> bytes:
    a, b, c = triangles.T
    above = np.concatenate([np.zeros((1, 3), np.int64), triangles[:-1]])
    greatest = np.concatenate([[-1], np.maximum.accumulate(triangles.max(axis=1))[:-1]])
    following = np.maximum(greatest, a) + 1
    same = a == above[:, 0]
    same[:1] = False
    expected = np.where(same, above[:, 2], following)
    columns = np.column_stack([a - above[:, 0], expected - b, np.maximum(following, b + 1) - c])
    return _planes(_zigzag(columns, size))


def _raw(data: bytes) -> Part:
    return ["raw", len(data)], data


def _rows(numbers: NDArray[Any]) -> Part:
    size = numbers.itemsize
    return ["rows", *numbers.shape, size, size * numbers.shape[1]], _planes(_differences(numbers))


def _differences(numbers: NDArray[np.integer]) -> NDArray[np.unsignedinteger]:
    """Return zig-zag differences to the row before, modulo the size of the numbers."""
    wide = np.vstack([np.zeros((1, numbers.shape[1]), np.int64), numbers.astype(np.int64)])
    return _zigzag(wide[1:] - wide[:-1], numbers.itemsize)


def _zigzag(differences: NDArray[np.int64], size: int) -> NDArray[np.unsignedinteger]:
    wrapped = differences.astype(f"<i{size}").astype(np.int64)
    return ((wrapped << 1) ^ (wrapped >> 63)).astype(f"<u{size}")


def _color_planes(rgb: ByteArray) -> bytes:
    """Return the planes of (N, 3) colours."""
    green = rgb[:, 1]
    columns = np.column_stack([green, rgb[:, 0] - green, rgb[:, 2] - green])
    before = np.vstack([np.zeros((1, 3), np.uint8), columns[:-1]])[: len(columns)]
    return _planes(columns - before)


def _planes(numbers: NDArray[np.unsignedinteger]) -> bytes:
    """Return the bytes of (N, C) numbers, column by column, the lowest bytes of a column first."""
    columns = np.ascontiguousarray(numbers.T)
    bytes_ = columns.view(np.uint8).reshape(*columns.shape, numbers.itemsize)
    return np.ascontiguousarray(np.moveaxis(bytes_, 2, 1)).tobytes()
