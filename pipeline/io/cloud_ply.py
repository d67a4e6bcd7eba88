"""Reader of PLY files: their first element with any scalar properties."""

from __future__ import annotations

from typing import Literal

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_table import check_count, table_of
from pipeline.types import AnyPath

_MAX_HEADER_BYTES = 10_000
TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip


def parse_ply(path: AnyPath, data: bytes) -> np.ndarray:
    """Read the vertex element, the first of the file, as a structured array; ASCII and both byte orders.

    Raises:
        InputError: the file is truncated, no PLY file, or has too many points.
    """
    end = data.find(b"end_header", 0, _MAX_HEADER_BYTES)
    start = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or start == 0:
        raise InputError(f"The point cloud {path} is not a PLY file; try to export it as PLY")
    try:
        order, count, dtype = _parse_header(data[:end].decode("ascii", "replace").splitlines())
    except (KeyError, ValueError, IndexError):
        raise InputError(
            f"The point cloud {path} has an unusual PLY header; try to export it with points as first element"
        ) from None
    check_count(path, count)
    if order != "a":
        dtype = dtype.newbyteorder(order)
    return table_of(path, data[start:], count, dtype, ascii_text=order == "a")


def _parse_header(lines: list[str]) -> tuple[Literal["a", "<", ">"], int, np.dtype]:
    """Return the byte order (``a`` for ASCII), the number of vertices and their layout."""
    orders: dict[str, Literal["a", "<", ">"]]
    orders = {"ascii": "a", "binary_little_endian": "<", "binary_big_endian": ">"}
    order: Literal["a", "<", ">"] | None = None
    count = -1
    properties: list[tuple[str, str]] = []
    for words in (line.split() for line in lines):
        if words[:1] == ["format"]:
            order = orders[words[1]]
        elif words[:1] == ["element"] and count >= 0:
            break
        elif words[:1] == ["element"]:
            if words[1] != "vertex":
                raise ValueError
            count = int(words[2])
        elif words[:1] == ["property"]:
            properties.append((words[2], TYPES[words[1]]))
    if order is None or count < 0 or not properties:
        raise ValueError
    return order, count, np.dtype(properties)
