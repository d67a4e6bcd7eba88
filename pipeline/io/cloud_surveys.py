"""Readers of survey formats, LAS, LAZ and E57, with libraries of the extra ``clouds``."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import PurePath
from types import ModuleType

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_las_units import metres_per_axis
from pipeline.io.cloud_table import COLOR, POSITION, Layout, check_count, truncated
from pipeline.types import AnyPath

_E57_POSITION = ("cartesianX", "cartesianY", "cartesianZ")
_E57_COLORS = ("colorRed", "colorGreen", "colorBlue")
_DAMAGED = "The point cloud {} is truncated or damaged; try to copy or export it again"


def parse_las(path: AnyPath, data: bytes, layout: Layout) -> np.ndarray:
    """Read the points of a LAS or LAZ file; 16-bit colours are reduced to 8 bits, all-black ones left out.

    Positions are converted to metres if the file's coordinate system has another unit, unless
    ``layout.header_unit`` is False.

    Raises:
        InputError: the extra is not installed, the file is damaged, or its coordinates are degrees.
    """
    laspy = _library("laspy", path)
    if not _las_records_fit(data):
        raise InputError(_DAMAGED.format(path))
    try:
        with laspy.open(io.BytesIO(data)) as reader:
            check_count(path, reader.header.point_count)
            points, count = reader.read(), reader.header.point_count
            records = [*reader.header.vlrs, *(reader.evlrs or ())]
        if len(points) < count:  # laspy returns the points of a truncated file without an error
            raise truncated(path, len(points), count)
        xyz = np.stack([np.asarray(points[name], np.float64) for name in ("x", "y", "z")], axis=1)
        named = set(points.point_format.dimension_names)
        rgb = None
        if set(COLOR) <= named:
            rgb = np.stack([np.asarray(points[name]) for name in COLOR], axis=1)
    except InputError:
        raise
    except Exception:  # a parser fails on damaged data in more ways than can be listed
        raise InputError(_DAMAGED.format(path)) from None
    if layout.header_unit:
        xyz *= metres_per_axis(path, records)
    if rgb is not None and not rgb.any():
        rgb = None
    if rgb is not None and rgb.max(initial=0) > 255:
        rgb = rgb >> 8
    return _table(xyz, rgb)


def parse_e57(path: AnyPath, data: bytes) -> np.ndarray:
    """Read the points of all scans of an E57 file, each transformed by its pose.

    Raises:
        InputError: the extra is not installed, or the file is damaged.
    """
    pye57 = _library("pye57", path)
    try:
        with pye57.E57(str(path)) as file:
            check_count(path, sum(file.get_header(k).point_count for k in range(file.scan_count)))
            scans = [
                file.read_scan(k, ignore_missing_fields=True, colors=_colored(file, k))
                for k in range(file.scan_count)
            ]
        xyz = _joined(scans, _E57_POSITION)
        rgb = _joined(scans, _E57_COLORS) if all(set(_E57_COLORS) <= scan.keys() for scan in scans) else None
    except InputError:
        raise
    except Exception:  # libE57 raises one type for all errors
        raise InputError(_DAMAGED.format(path)) from None
    return _table(xyz, rgb)


def _las_records_fit(data: bytes) -> bool:
    """Return whether a file is long enough for its variable length records (LAS 1.4, tables 3, 5 and 7)."""
    if len(data) < 227:
        return False
    header_bytes, records = (
        int.from_bytes(data[at : at + size], "little") for at, size in ((94, 2), (100, 4))
    )
    further = 0
    if data[25] >= 4 and len(data) >= 247:
        further = int.from_bytes(data[243:247], "little")
    return header_bytes + 54 * records + 60 * further <= len(data)


def _joined(scans: Sequence[dict[str, np.ndarray]], names: Sequence[str]) -> np.ndarray:
    """Return three columns of all scans as (N, 3)."""
    return np.concatenate([np.stack([scan[name] for name in names], axis=1) for scan in scans])


def _colored(file: object, scan: int) -> bool:
    """Return whether the points of a scan have colours."""
    return set(_E57_COLORS) <= set(file.get_header(scan).point_fields)  # type: ignore[attr-defined]


def _library(name: str, path: AnyPath) -> ModuleType:
    """Import the reader's module."""
    try:
        return __import__(name)
    except ImportError:
        suffix = PurePath(path).suffix
        raise InputError(
            f"The point cloud {path} takes a reader of {suffix} files that is not installed; "
            "try pip install 'packetmesh[clouds]'"
        ) from None


def _table(xyz: np.ndarray, rgb: np.ndarray | None) -> np.ndarray:
    """Combine positions and colours in a structured array."""
    table = np.empty(len(xyz), [(n, "f8") for n in POSITION] + [(n, "u1") for n in COLOR if rgb is not None])
    for name, column in zip(POSITION, np.asarray(xyz).T, strict=True):
        table[name] = column
    if rgb is not None:
        for name, column in zip(COLOR, np.asarray(rgb).T, strict=True):
            table[name] = column
    return table
