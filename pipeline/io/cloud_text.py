"""Readers of points as text, separated by blanks, tabs, commas or semicolons: XYZ, TXT, ASC, CSV, PTS."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_table import COLOR, NORMAL, POSITION, check_count, number_rows, truncated
from pipeline.types import AnyPath

_NAMES = {"r": "red", "g": "green", "b": "blue", "normal_x": "nx", "normal_y": "ny", "normal_z": "nz"}
MOST_COLUMNS = 1000
_UNIT_TOLERANCE = 0.02
"""Largest deviation of a triple's length from 1 with which it is read as a normal."""


def parse_text(path: AnyPath, data: bytes) -> np.ndarray:
    """Read the points as a structured array.

    A first line of words names the columns (x, y, z, r, g, b, nx, ny, nz in any order). Without it the first
    three columns are the position; further triples are normals if their lengths are one, or colours if they
    are integers up to 255. Other columns are ignored, as are lines that begin with # or //.

    Raises:
        InputError: the file is not such text, its lines differ in length, or there are too many points.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"The point cloud {path} is not a text file; try to export it as PLY") from None
    for separator in ",;\t":
        text = text.replace(separator, " ")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(("#", "//"))]
    names = None
    if lines and not _is_number(lines[0].split()[0]):
        names = [_NAMES.get(word, word) for word in lines.pop(0).lower().replace('"', "").split()]
    if not lines or len(lines[0].split()) < 3:
        raise InputError(f"The point cloud {path} has no lines of three numbers or more; try another file")
    check_count(path, len(lines))
    width = len(lines[0].split())
    if width > MOST_COLUMNS:
        raise InputError(f"The point cloud {path} has {width} columns; try one with a point on each line")
    rows = number_rows(path, "\n".join(lines).encode(), len(lines), width)
    if names is not None and len(names) == width:
        twice = [name for name in (*POSITION, *NORMAL, *COLOR) if names.count(name) > 1]
        if twice:
            raise InputError(f"The point cloud {path} has two columns {twice[0]}; try to name one otherwise")
        return _table(rows, names)
    return table_of_columns(rows)


def table_of_columns(rows: np.ndarray) -> np.ndarray:
    """Convert (N, 3 or more) numbers to a structured array; guess which columns are normals or colours."""
    return _table(rows, _guessed(rows))


def parse_pts(path: AnyPath, data: bytes) -> np.ndarray:
    """Read Leica's PTS: a line with the number of points, then x, y, z, intensity and optionally r, g, b.

    Raises:
        InputError: the file is not such text, or ends before its last point.
    """
    first, _, rest = data.partition(b"\n")
    if not first.strip().isdigit():
        return parse_text(path, data)  # many PTS files lack the first line
    count = int(first)
    check_count(path, count)
    lines = [line for line in rest.splitlines() if line.strip()]
    if len(lines) < count:
        raise truncated(path, len(lines), count)
    width = len(lines[0].split()) if lines else 0
    if width not in (3, 4, 6, 7):
        raise InputError(f"The point cloud {path} has {width} columns; a PTS file has 3, 4, 6 or 7")
    rows = number_rows(path, rest, count, width)
    colors = list(COLOR) if width >= 6 else []
    return _table(rows, [*POSITION, *(["intensity"] if width in (4, 7) else []), *colors])


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _guessed(rows: np.ndarray) -> list[str]:
    """Guess the names of the columns from their values."""
    names = list(POSITION)
    for start in range(3, rows.shape[1] - 2, 3):
        triple = rows[:, start : start + 3]
        lengths = np.linalg.norm(triple, axis=1)
        if "nx" not in names and np.all(np.abs(lengths - 1.0) < _UNIT_TOLERANCE):
            names += NORMAL
        elif "red" not in names and np.all((triple >= 0) & (triple <= 255) & (triple == np.rint(triple))):
            names += COLOR
        else:
            names += [f"column_{start + k}" for k in range(3)]
    return names + [f"column_{k}" for k in range(len(names), rows.shape[1])]


def _table(rows: np.ndarray, names: list[str]) -> np.ndarray:
    """Return a structured array; integer colours get an integer type, which marks them as 0 to 255."""
    kinds = dict.fromkeys(names, "f8")
    places = [place for place, name in enumerate(names) if name in COLOR]
    if places and np.all(rows[:, places] == np.rint(rows[:, places])) and rows[:, places].max() > 1:
        kinds |= {names[place]: "i8" for place in places}
    table = np.empty(len(rows), list(kinds.items()))
    for name, column in zip(names, rows.T, strict=True):
        table[name] = column
    return table
