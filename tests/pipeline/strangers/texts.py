"""The room's points as text in dialects of spreadsheets, scanners and loggers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from pipeline.types import PointCloud


def write_comma(path: Path, cloud: PointCloud) -> None:
    """Titles, commas, points as decimal marks; metres to four digits, with colours."""
    _write(path, ["X,Y,Z,R,G,B"], (_row(point, ",") + "," + _whole(rgb, ",") for point, rgb in _rows(cloud)))


def write_semicolon(path: Path, cloud: PointCloud) -> None:
    """A spreadsheet where commas are decimal marks; with a byte order mark and Windows' line ends."""
    lines = (_row(point, ";").replace(".", ",") + ";" + _whole(rgb, ";") for point, rgb in _rows(cloud))
    text = "\r\n".join(["x;y;z;red;green;blue", *lines])
    path.write_bytes(text.encode("utf-8-sig"))


def write_tab_mm(path: Path, cloud: PointCloud) -> None:
    """Tabs, and millimetres that the titles name."""
    lines = (_row(1000.0 * point, "\t", 1) for point, _ in _rows(cloud))
    _write(path, ["X [mm]\tY [mm]\tZ [mm]"], lines)


def write_pts(path: Path, cloud: PointCloud) -> None:
    """Leica's PTS: the number of points, then x, y, z, an intensity from -2048 to 2047, and colours."""
    lines = (
        f"{_row(point, ' ', 6)} {8 * int(rgb[1]) - 1024} {_whole(rgb, ' ')}" for point, rgb in _rows(cloud)
    )
    _write(path, [str(len(cloud))], lines)


def write_time_first(path: Path, cloud: PointCloud) -> None:
    """A logger's table: titles in a comment, the time before the position, the intensity after it."""
    lines = (
        f"{1700000000.0 + 1e-4 * k:.4f} {_row(point, ' ')} {int(rgb[0])}"
        for k, (point, rgb) in enumerate(_rows(cloud))
    )
    _write(path, ["# time x y z intensity"], lines)


def _rows(cloud: PointCloud) -> Iterable[tuple[np.ndarray, np.ndarray]]:
    return zip(cloud.points_m, cloud.colors, strict=True)


def _row(point: np.ndarray, separator: str, digits: int = 4) -> str:
    return separator.join(f"{value:.{digits}f}" for value in point)


def _whole(rgb: np.ndarray, separator: str) -> str:
    return separator.join(str(int(value)) for value in rgb)


def _write(path: Path, head: list[str], lines: Iterable[str]) -> None:
    path.write_text("\n".join([*head, *lines]) + "\n")
