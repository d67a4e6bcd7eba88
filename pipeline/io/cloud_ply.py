"""Reader of PLY files: their vertices with any scalar properties."""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_table import COLOR, NORMAL, POSITION, check_count, table_of
from pipeline.types import AnyPath

_log = logging.getLogger(__name__)

_MAX_HEADER_BYTES = 1_000_000
TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_LINE_END = re.compile(rb"\r\n|\r|\n|\Z")
_SPLAT = ("f_dc_0", "f_dc_1", "f_dc_2")
_SPLAT_FACTOR = 0.5 / np.sqrt(np.pi)
"""Constant spherical harmonic; a splat's mean colour is 0.5 plus this times its first coefficient."""


@dataclass(frozen=True, slots=True)
class _Element:
    """One element of a PLY header."""

    name: str
    count: int
    properties: list[tuple[str, str]]
    """Name and NumPy type of each property; the type of a list is ``list``."""


def parse_ply(path: AnyPath, data: bytes) -> np.ndarray:
    """Read the vertices as a structured array; ASCII and both byte orders, any end of line.

    Gaussian splats (Kerbl et al. 2023) get their mean colours.

    Raises:
        InputError: the file is truncated, no PLY file, has too many points, or lists among its vertices.
    """
    end = data.find(b"end_header", 0, _MAX_HEADER_BYTES)
    if not data.startswith(b"ply") or end < 0:
        raise InputError(f"The point cloud {path} is not a PLY file; try to export it as PLY")
    try:
        order, elements = _parse_header(data[:end].decode("ascii", "replace").splitlines())
        place = [element.name for element in elements].index("vertex")
        vertex = elements[place]
        names = [name for name, _ in vertex.properties]
        if len(set(names)) < len(names):
            raise ValueError
        if min(element.count for element in elements[: place + 1]) < 0 or not vertex.properties:
            raise ValueError
    except (KeyError, ValueError, IndexError):
        raise InputError(
            f"The point cloud {path} has an unusual PLY header; try to export it with an element vertex that "
            "has x, y and z"
        ) from None
    for element in elements[: place + 1]:
        lists = [name for name, kind in element.properties if kind == "list"]
        if lists:
            raise InputError(
                f"The element {element.name} of {path} has the list {lists[0]}, so its rows differ in "
                "length; try to export it without this list"
            )
    check_count(path, vertex.count)
    body = _after(data[_body_start(data, end) :], elements[:place], order)
    table = table_of(path, body, vertex.count, _row(vertex, order), ascii_text=order == "a")
    return _with_splat_colors(path, table)


def _parse_header(lines: list[str]) -> tuple[Literal["a", "<", ">"], list[_Element]]:
    """Return the byte order (``a`` for ASCII) and the elements."""
    orders: dict[str, Literal["a", "<", ">"]]
    orders = {"ascii": "a", "binary_little_endian": "<", "binary_big_endian": ">"}
    order: Literal["a", "<", ">"] | None = None
    elements: list[_Element] = []
    for words in (line.split() for line in lines):
        if words[:1] == ["format"]:
            order = orders[words[1]]
        elif words[:1] == ["element"]:
            elements.append(_Element(words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            kind = "list" if words[1] == "list" else TYPES[words[1]]
            elements[-1].properties.append((words[-1], kind))
    if order is None:
        raise ValueError
    return order, elements


def _body_start(data: bytes, end: int) -> int:
    """Return where the body begins; the first line shows how lines end: LF, CR LF or CR."""
    mark = data[3:5] if data[3:5] == b"\r\n" else data[3:4]
    return data.find(mark, end) + len(mark) if mark in (b"\r\n", b"\r") else data.find(b"\n", end) + 1


def _after(body: bytes, elements: list[_Element], order: Literal["a", "<", ">"]) -> bytes:
    """Return a body without the elements before the vertices."""
    if not elements:
        return body
    if order == "a":
        return _without_lines(body.lstrip(), sum(element.count for element in elements))
    return body[sum(element.count * _row(element, order).itemsize for element in elements) :]


def _without_lines(text: bytes, count: int) -> bytes:
    """Return a text without its first ``count`` lines; all are gone if there are fewer."""
    start = 0
    for _, end in zip(range(count), _LINE_END.finditer(text), strict=False):
        start = end.end()
    return text[start:]


def _row(element: _Element, order: Literal["a", "<", ">"]) -> np.dtype:
    """Return the type of one row of an element."""
    row = np.dtype(element.properties)
    return row if order == "a" else row.newbyteorder(order)


def _with_splat_colors(path: AnyPath, table: np.ndarray) -> np.ndarray:
    """Return the positions, normals and mean colours of Gaussian splats; other tables as they are."""
    names = set(table.dtype.names or ())
    if not set(_SPLAT) <= names or set(COLOR) & names:
        return table
    _log.warning("%s: its colours are the mean colours of Gaussian splats (f_dc_0 to f_dc_2)", path)
    others = [name for name in (*POSITION, *NORMAL) if name in names]
    out = np.empty(len(table), [(name, "f8") for name in (*others, *COLOR)])
    for name in others:
        out[name] = table[name]
    for color, coefficient in zip(COLOR, _SPLAT, strict=True):
        out[color] = np.clip(0.5 + _SPLAT_FACTOR * table[coefficient].astype(np.float64), 0.0, 1.0)
    return out
