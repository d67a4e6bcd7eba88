"""Tables of named columns, into which the reader of every format converts a cloud."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import AnyPath, PointCloud

_log = logging.getLogger(__name__)

MAX_POINTS = 20_000_000
FARTHEST, MOST_FAR_SHARE = 1e12, 0.1
"""If a larger share of points than MOST_FAR_SHARE is beyond FARTHEST (in any unit), the file was misread."""
POSITION, NORMAL, COLOR = ("x", "y", "z"), ("nx", "ny", "nz"), ("red", "green", "blue")
LABEL = "source"
_BYTE = 255


@dataclass(frozen=True, slots=True)
class Layout:
    """A user's options for the columns and the unit of a table."""

    columns: tuple[str, ...] | None = None
    """Field of each column (``parse_columns``); None finds them in the file."""
    header_unit: bool = True
    """Whether positions are converted to metres if the file names another unit."""


def cloud_of(path: AnyPath, table: np.ndarray) -> PointCloud:
    """Convert a structured array whose fields are named as in PLY files to a cloud.

    Floating-point colours range from 0 to 1 unless one is larger; colours above 255 have 16 bits. Points that
    are not finite are left out.

    Raises:
        InputError: x, y or z is missing, or no point is finite.
    """
    points_m = columns(table, POSITION, np.float64)
    if points_m is None:
        raise InputError(f"The point cloud {path} has no x, y, z; try a file with positions")
    colors = columns(table, COLOR, np.float64)
    if colors is not None:
        largest = np.nanmax(colors, initial=0.0)
        if largest > _BYTE:
            colors = colors // 256.0
        elif table["red"].dtype.kind == "f":
            colors = np.rint(colors * (255.0 if largest <= 1.0 else 1.0))
    source = columns(table, (LABEL,), np.uint8)
    cloud = PointCloud(
        points_m=points_m,
        colors=None if colors is None else np.clip(np.nan_to_num(colors), 0, 255).astype(np.uint8),
        normals=columns(table, NORMAL, np.float64),
        source=None if source is None else source[:, 0],
    )
    finite = np.isfinite(points_m).all(axis=1)
    if not finite.any():
        raise InputError(f"The point cloud {path} holds no point with finite coordinates; try another file")
    if (np.abs(points_m[finite]) > FARTHEST).any(axis=1).mean() > MOST_FAR_SHARE:
        raise InputError(
            f"The numbers in the point cloud {path} are no positions, as if their bytes were in another "
            "order; try to export it again"
        )
    if finite.all():
        return cloud
    _log.warning("%d points of %s are left out: their coordinates are not finite", np.sum(~finite), path)
    return cloud.select(finite)


def columns(table: np.ndarray, names: tuple[str, ...], dtype: type) -> np.ndarray | None:
    """Return the named fields as (N, len(names)); None unless the table has all of them."""
    if not set(names) <= set(table.dtype.names or ()):
        return None
    return np.stack([table[name].astype(dtype) for name in names], axis=1)


def check_count(path: AnyPath, count: int) -> None:
    """Raise an InputError for more than ``MAX_POINTS`` points."""
    if count > MAX_POINTS:
        raise InputError(
            f"The point cloud {path} has {count} points, more than the {MAX_POINTS // 10**6} million that "
            "are read; try to thin it"
        )


def truncated(path: AnyPath, there: int, count: int) -> InputError:
    """Return the error for a file that ends before its last point."""
    return InputError(
        f"The point cloud {path} ends after {there} of its {count} points; try to copy or export it again"
    )


def table_of(path: AnyPath, body: bytes, count: int, dtype: np.dtype, ascii_text: bool) -> np.ndarray:
    """Return ``count`` rows of a structured array from a file's body: lines of numbers, or binary rows.

    Raises:
        InputError: there are fewer rows, or a line has too few numbers.
    """
    if not ascii_text:
        there = len(body) // dtype.itemsize
        if there < count:
            raise truncated(path, there, count)
        return np.frombuffer(body, dtype, count)
    names = dtype.names or ()
    widths = [int(np.prod(dtype[name].shape)) for name in names]
    rows = number_rows(path, body, count, sum(widths))
    table = np.empty(count, dtype)
    with np.errstate(invalid="ignore"):
        for name, width, end in zip(names, widths, np.cumsum(widths), strict=True):
            table[name] = rows[:, end - 1] if width == 1 else rows[:, end - width : end]
    return table


def number_rows(path: AnyPath, body: bytes, count: int, width: int) -> np.ndarray:
    """Read (count, width) float64 numbers from the first lines that are not blank.

    Raises:
        InputError: there are fewer lines, or a line has fewer than ``width`` numbers.
    """
    lines = [line for line in body.splitlines() if line.strip()][:count]
    if len(lines) < count:
        raise truncated(path, len(lines), count)
    try:
        rows = np.array([line.split()[:width] for line in lines], dtype=np.float64)
    except ValueError:
        rows = np.empty(0)
    if rows.shape != (count, width):
        raise InputError(
            f"The point cloud {path} has a line that is not {width} numbers; try to export it again"
        )
    return rows
