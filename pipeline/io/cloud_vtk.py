"""Reader of legacy VTK files: the points of any data set, ASCII or binary (big-endian)."""

from __future__ import annotations

import re

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_table import POSITION, check_count, number_rows, truncated
from pipeline.types import AnyPath

_TYPES = {"float": ">f4", "double": ">f8"}
_MAX_HEADER_BYTES = 100_000
_POINTS = re.compile(rb"^POINTS[ \t]+(\d{1,18})[ \t]+(\w+)[ \t]*\r?\n", re.MULTILINE | re.IGNORECASE)


def parse_vtk(path: AnyPath, data: bytes) -> np.ndarray:
    """Read the points as a structured array; cells and attributes are ignored.

    Raises:
        InputError: the file is truncated, no legacy VTK file, or has too many points.
    """
    lines = data[:1024].split(b"\n", 3)
    place = _POINTS.search(data, 0, _MAX_HEADER_BYTES)
    kind = lines[2].strip().upper() if len(lines) > 3 else b""
    if not data.startswith(b"# vtk DataFile") or kind not in (b"ASCII", b"BINARY") or place is None:
        raise InputError(
            f"The point cloud {path} is not a legacy VTK file with points; try to export it as PLY"
        )
    count, word = int(place[1]), place[2].decode("ascii").lower()
    check_count(path, count)
    if word not in _TYPES:
        raise InputError(f"The points of {path} are of type {word}; try to save them as float or double")
    body = data[place.end() :]
    if kind == b"ASCII":  # a line may have any number of points
        words = body.split(None, 3 * count)[: 3 * count]
        if len(words) < 3 * count:
            raise truncated(path, len(words) // 3, count)
        lines = [b" ".join(words[k : k + 3]) for k in range(0, len(words), 3)]
        rows = number_rows(path, b"\n".join(lines), count, 3)
    else:
        there = len(body) // (3 * np.dtype(_TYPES[word]).itemsize)
        if there < count:
            raise truncated(path, there, count)
        rows = np.frombuffer(body, _TYPES[word], 3 * count).reshape(-1, 3).astype(np.float64)
    table = np.empty(count, [(name, "f8") for name in POSITION])
    for name, column in zip(POSITION, rows.T, strict=True):
        table[name] = column
    return table
