"""Point clouds as PLY files."""

from __future__ import annotations

import os
from typing import Literal

import numpy as np

from pipeline.errors import InputError
from pipeline.io.atomic import atomic_path
from pipeline.io.limits import MAX_GEOMETRY_BYTES, read_bytes
from pipeline.types import PointCloud

MAX_POINTS = 20_000_000
_MAX_HEADER_BYTES = 10_000
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_POSITION, _NORMAL, _COLOR = ("x", "y", "z"), ("nx", "ny", "nz"), ("red", "green", "blue")
_LABEL = "source"

Path = str | os.PathLike[str]


def read_cloud(path: Path) -> PointCloud:
    """Points with normals, colours and source labels, where the PLY file has them.

    Reads ASCII and both binary orders with any scalar properties; further elements (faces) and
    points that are not finite are left out.

    Raises:
        InputError: missing, truncated, too large, not a PLY file or without points.
    """
    data = read_bytes(path, MAX_GEOMETRY_BYTES, "point cloud")
    vertices = _read_vertices(path, data)
    points_m = _columns(vertices, _POSITION, np.float64)
    if points_m is None:
        raise InputError(f"The point cloud {path} has no x, y, z; try a PLY file with positions")
    colors = _columns(vertices, _COLOR, np.float64)
    if colors is not None and vertices["red"].dtype.kind == "f":
        colors = np.rint(colors * 255.0)
    source = _columns(vertices, (_LABEL,), np.uint8)
    cloud = PointCloud(
        points_m=points_m,
        colors=None if colors is None else np.clip(np.nan_to_num(colors), 0, 255).astype(np.uint8),
        normals=_columns(vertices, _NORMAL, np.float64),
        source=None if source is None else source[:, 0],
    )
    finite = np.isfinite(points_m).all(axis=1)
    if not finite.any():
        raise InputError(f"The point cloud {path} holds no point with finite coordinates; try another file")
    return cloud if finite.all() else cloud.select(finite)


def write_cloud(path: Path, cloud: PointCloud) -> None:
    """Write a binary PLY: float positions and normals, uchar colours and source label.

    Raises:
        InputError: not a .ply name, or the folder cannot be written.
    """
    if not str(path).endswith(".ply"):
        raise InputError(f"{path} is no name for a point cloud; try one that ends in .ply")
    fields: list[tuple[str, str, np.ndarray]]
    fields = [(name, "float", cloud.points_m[:, axis]) for axis, name in enumerate(_POSITION)]
    if cloud.normals is not None:
        fields += [(name, "float", cloud.normals[:, axis]) for axis, name in enumerate(_NORMAL)]
    if cloud.colors is not None:
        fields += [(name, "uchar", cloud.colors[:, channel]) for channel, name in enumerate(_COLOR)]
    if cloud.source is not None:
        fields.append((_LABEL, "uchar", cloud.source))
    table = np.empty(len(cloud), [(name, f"<{_TYPES[word]}") for name, word, _ in fields])
    for name, _, column in fields:
        table[name] = column
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(cloud)}"]
    header += [f"property {word} {name}" for name, word, _ in fields]
    with atomic_path(path) as sibling:
        sibling.write_bytes("\n".join([*header, "end_header\n"]).encode("ascii") + table.tobytes())


def _columns(table: np.ndarray, names: tuple[str, ...], dtype: type) -> np.ndarray | None:
    """(N, len(names)) of the named fields, None unless the table has them all."""
    if not set(names) <= set(table.dtype.names or ()):
        return None
    return np.stack([table[name].astype(dtype) for name in names], axis=1)


def _read_vertices(path: Path, data: bytes) -> np.ndarray:
    """The vertex element, the first of the file, as a structured array."""
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
    if count > MAX_POINTS:
        raise InputError(
            f"The point cloud {path} has {count} points, more than the {MAX_POINTS // 10**6} million that "
            "are read; try to thin it"
        )
    if order == "a":
        return _read_ascii(path, data[start:], count, dtype)
    there = (len(data) - start) // dtype.itemsize
    if there < count:
        raise _truncated(path, there, count)
    return np.frombuffer(data, dtype.newbyteorder(order), count, start)


def _parse_header(lines: list[str]) -> tuple[Literal["a", "<", ">"], int, np.dtype]:
    """Byte order (``a`` for ASCII), number of vertices and their layout."""
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
            properties.append((words[2], _TYPES[words[1]]))
    if order is None or count < 0:
        raise ValueError
    return order, count, np.dtype(properties)


def _read_ascii(path: Path, body: bytes, count: int, dtype: np.dtype) -> np.ndarray:
    width = len(dtype.names or ())
    try:
        rows = [tuple(map(float, line.split()[:width])) for line in body.splitlines()[:count] if line.strip()]
        if len(rows) < count:
            raise _truncated(path, len(rows), count)
        return np.array(rows, dtype=dtype)
    except (ValueError, OverflowError):
        raise InputError(
            f"The point cloud {path} has a line that is not {width} numbers; try to export it again"
        ) from None


def _truncated(path: Path, there: int, count: int) -> InputError:
    return InputError(
        f"The point cloud {path} ends after {there} of its {count} points; try to copy or export it again"
    )
