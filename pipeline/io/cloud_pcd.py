"""Reader of PCD files, the format of the Point Cloud Library, up to 0.7: ASCII, binary and compressed."""

from __future__ import annotations

import numba
import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES
from pipeline.io.cloud_table import COLOR, NORMAL, POSITION, check_count, table_of, truncated
from pipeline.types import AnyPath

_MAX_HEADER_BYTES = 10_000
_TYPES = {
    ("F", 4): "<f4", ("F", 8): "<f8", ("I", 1): "<i1", ("I", 2): "<i2", ("I", 4): "<i4", ("I", 8): "<i8",
    ("U", 1): "<u1", ("U", 2): "<u2", ("U", 4): "<u4", ("U", 8): "<u8",
}  # fmt: skip
_OUR_NAMES = {"normal_x": "nx", "normal_y": "ny", "normal_z": "nz"}


def parse_pcd(path: AnyPath, data: bytes) -> np.ndarray:
    """Read the points as a structured array with the field names of PLY files; packed colours are unpacked.

    Raises:
        InputError: the file is truncated, damaged, no PCD file, or has too many points.
    """
    mark = data.find(b"\nDATA ", 0, _MAX_HEADER_BYTES)
    start = data.find(b"\n", mark + 1) + 1
    if mark < 0 or start == 0:
        raise InputError(f"The point cloud {path} is not a PCD file; try to export it as PLY")
    header = _header(data[:start].decode("ascii", "replace"))
    kind = " ".join(header["DATA"])
    try:
        count, dtype = _layout(header)
    except (KeyError, ValueError, IndexError):
        kind = ""
    if kind not in ("ascii", "binary", "binary_compressed"):
        raise InputError(f"The point cloud {path} has an unusual PCD header; try to export it as PLY")
    check_count(path, count)
    if kind == "binary_compressed":
        return _unpacked(_compressed(path, data[start:], count, dtype))
    return _unpacked(table_of(path, data[start:], count, dtype, ascii_text=kind == "ascii"))


def _compressed(path: AnyPath, body: bytes, count: int, dtype: np.dtype) -> np.ndarray:
    """Read a compressed body: two sizes, then the fields one after the other, packed with LZF."""
    whole = count * dtype.itemsize
    packed_bytes, unpacked_bytes = np.frombuffer(body[:8], "<u4") if len(body) >= 8 else (0, -1)
    if unpacked_bytes != whole or whole > MAX_GEOMETRY_BYTES:
        raise InputError(
            f"The point cloud {path} is damaged: its {count} points take {whole} bytes, and it says "
            f"{unpacked_bytes}; try to copy or export it again"
        )
    if len(body) < 8 + packed_bytes:
        raise truncated(path, 0, count)
    columns = np.empty(whole, np.uint8)
    if _lzf_unpacked(np.frombuffer(body, np.uint8, int(packed_bytes), 8), columns) != whole:
        raise InputError(f"The point cloud {path} is damaged; try to copy or export it again")
    table, start = np.empty(count, dtype), 0
    for name in dtype.names or ():
        end = start + count * dtype[name].itemsize
        table[name] = columns[start:end].view(dtype[name].base).reshape(table[name].shape)
        start = end
    return table


@numba.njit(cache=True, nogil=True)
def _lzf_unpacked(packed, out):  # type: ignore[no-untyped-def]
    """Unpack Marc Lehmann's LZF: literal runs and copies from up to 8 KB back; returns the bytes written."""
    read = written = 0
    while read < len(packed):
        control = packed[read]
        read += 1
        if control < 32:
            length = control + 1
            if read + length > len(packed) or written + length > len(out):
                return -1
            out[written : written + length] = packed[read : read + length]
            read += length
        else:
            length = (control >> 5) + 2
            if length == 9:
                if read >= len(packed):
                    return -1
                length += packed[read]
                read += 1
            if read >= len(packed):
                return -1
            back = written - ((control & 31) << 8) - packed[read] - 1
            read += 1
            if back < 0 or written + length > len(out):
                return -1
            for k in range(length):  # source and target may overlap
                out[written + k] = out[back + k]
        written += length
    return written


def _header(text: str) -> dict[str, list[str]]:
    rows = [line.split() for line in text.splitlines()]
    return {row[0]: row[1:] for row in rows if row and not row[0].startswith("#")}


def _layout(header: dict[str, list[str]]) -> tuple[int, np.dtype]:
    """Return the number of points and their layout; ``_`` is padding and may occur several times."""
    names = header["FIELDS"]
    repeats = [int(word) for word in header.get("COUNT", ["1"] * len(names))]
    kinds = [_TYPES[kind, int(size)] for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
    fields = [
        (_OUR_NAMES.get(name, name) if name != "_" else f"_{place}", kind, (repeat,) if repeat > 1 else ())
        for place, (name, kind, repeat) in enumerate(zip(names, kinds, repeats, strict=True))
    ]
    if "POINTS" in header:
        count = int(header["POINTS"][0])
    else:
        count = int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
    if count < 0 or min(repeats) < 1 or sum(repeats) > 1000:
        raise ValueError
    return count, np.dtype(fields)


def _unpacked(table: np.ndarray) -> np.ndarray:
    """Replace ``rgb`` or ``rgba``, four bytes often declared as a float, by red, green and blue."""
    names = table.dtype.names or ()
    packed = next((name for name in ("rgb", "rgba") if name in names), None)
    if packed is None or table.dtype[packed].itemsize != 4:
        return table
    bits = np.ascontiguousarray(table[packed]).view("<u4")
    others = [name for name in (*POSITION, *NORMAL) if name in names]
    out = np.empty(
        len(table), [(name, table.dtype[name]) for name in others] + [(name, "u1") for name in COLOR]
    )
    for name in others:
        out[name] = table[name]
    for name, shift in zip(COLOR, (16, 8, 0), strict=True):
        out[name] = (bits >> shift) & 255
    return out
