"""Readers of points as text, separated by blanks, tabs, commas or semicolons: XYZ, TXT, ASC, CSV, PTS."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_columns import (
    UNUSED,
    checked_width,
    guessed_columns,
    log_columns,
    table_named,
)
from pipeline.io.cloud_decimals import Dialect, dialect_of, split_titles
from pipeline.io.cloud_header import Header, header_of, named_axes, names_degrees, no_position
from pipeline.io.cloud_table import COLOR, POSITION, Layout, check_count, truncated
from pipeline.types import AnyPath, FloatArray

_log = logging.getLogger(__name__)

MOST_COLUMNS = 1000
_GRID_TITLES = ("ncols", "nrows", "north:", "dsaa")
"""First words of grids of heights: ESRI, GRASS, Surfer."""
_COMMENTS = ("#", "//", "%")
_HEADER_LINES = 50
"""Lines without numbers that may be above the table."""
_SEPARATORS = re.compile(r"[\s,;|\"]+")
_FORTRAN = re.compile(r"(?<=\d)[dD](?=[-+]\d\d)")
_BRACKETS = "[](){}"
"""Marks around the numbers of a point, as Python and NumPy print them."""
_COLMAP = "POINT3D_ID, X, Y, Z, R, G, B"
"""Comment above points3D.txt of COLMAP, whose lines end with a list of any length."""
_NOT_A_NUMBER = (
    "",
    "nan",
    "null",
    "none",
    "na",
    "n/a",
    "-nan",
    "nan(ind)",
    "-nan(ind)",
    "1.#qnan",
    "-1.#ind",
)
_PTS = {4: (*POSITION, UNUSED), 7: (*POSITION, UNUSED, *COLOR)}
"""Columns of Leica's PTS with an intensity."""


@dataclass(frozen=True, slots=True)
class _Lines:
    """The lines of a text by their purpose."""

    comments: list[str]
    """Comments above the numbers, without their marks."""
    titles: list[str]
    """Other lines above the numbers."""
    numbers: list[str]
    counted: bool
    """Whether a line states the number of points."""


def parse_text(path: AnyPath, data: bytes, layout: Layout) -> np.ndarray:
    """Read the points as a structured array.

    Titles in the last line above the numbers, also in a comment, name the columns (``header_of``). Without
    them the columns are guessed (``guessed_columns``). Decimal commas are read where something else
    separates the numbers. A reading that is not obvious is logged; a doubtful one is an error.

    Args:
        path: name of the file.
        data: content of the file.
        layout: columns as the user names them, and whether a unit in the titles counts.

    Raises:
        InputError: the file is not such text, its lines differ in length, its columns or decimal marks are
            in doubt, or there are too many points.
    """
    lines = _lines_of(path, _plain_numbers(_decoded(path, data)))
    if not lines.numbers:
        raise InputError(f"The point cloud {path} has no lines of three numbers or more; try another file")
    check_count(path, len(lines.numbers))
    dialect = dialect_of(path, lines.numbers)
    width = len(dialect.cells(lines.numbers[:1])[0])
    if width > MOST_COLUMNS:
        raise InputError(f"The point cloud {path} has {width} columns; try one with a point on each line")
    if layout.columns is None and any(line.startswith(_COLMAP) for line in lines.comments):
        names = (UNUSED, *POSITION, *COLOR)
        log_columns(path, (*names, UNUSED), [*_COLMAP.split(", "), "the list of observations"])
        return _table(path, lines.numbers, dialect, names, more=True)
    if layout.columns is not None:
        checked_width(path, layout.columns, width)
        return _table(path, lines.numbers, dialect, layout.columns, more=True)
    if lines.titles and lines.titles[0].lower().split()[0] in _GRID_TITLES:
        raise InputError(f"{path} is a grid of heights and no list of points; try to export it as x y z")
    header = _header(path, lines, dialect, width)
    if header is None:
        return _guessed(path, lines, dialect, width)
    if not header.plain or dialect.decimal_comma:
        log_columns(path, header.names, header.titles, dialect.decimal_comma)
    table = _table(path, lines.numbers, dialect, header.names)
    metres = header.metres_per_unit
    if layout.header_unit and metres is not None and metres != 1.0:
        _log.warning(
            "%s: its titles say that a unit is %.7g m; x, y, z are converted to metres", path, metres
        )
        for name in POSITION:
            table[name] *= metres
    return table


def _decoded(path: AnyPath, data: bytes) -> str:
    """Return the text of a file in UTF-8, UTF-16 with a byte order mark, or Windows-1252.

    Raises:
        InputError: it is no text.
    """
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if encoding == "utf-8-sig" or all(c.isprintable() or c.isspace() for c in text[:10_000]):
            return text
    raise InputError(f"The point cloud {path} is not a text file; try to export it as PLY")


def _plain_numbers(text: str) -> str:
    """Write Fortran's exponents (1.0D+02) with e; remove apostrophes and no-break spaces that mark thousands.

    No-break spaces count as such marks only where blanks do not separate the numbers.
    """
    text = _FORTRAN.sub("e", text)
    marks = "'\u2019" + ("\u00a0\u202f" if ";" in text or "\t" in text else "")
    if not any(mark in text for mark in marks):
        return text
    return re.sub(rf"(?<=\d)[{marks}](?=\d{{3}})", "", text)


def _lines_of(path: AnyPath, text: str) -> _Lines:
    """Sort the lines; a line with a count must be followed by as many lines of numbers."""
    comments: list[str] = []
    titles: list[str] = []
    numbers: list[str] = []
    left: int | None = None  # lines of numbers that the last count still promises
    for line in text.splitlines():
        plain = line.strip()
        if plain.startswith(tuple(_BRACKETS)) and _has_numbers(inside := plain.strip(_BRACKETS + ", ")):
            plain = line = inside
        if not plain:
            continue
        if plain.startswith(_COMMENTS):
            if not numbers:
                comments.append(plain.lstrip("#/% "))
        elif plain.isdigit() and (left == 0 if numbers else left is None):
            left = int(plain)
            check_count(path, left)
        elif not numbers and not _has_numbers(plain):
            titles.append(plain)
            if len(titles) > _HEADER_LINES:
                break
        elif left == 0:
            raise InputError(
                f"The point cloud {path} has more lines of numbers than its first line counts; try to "
                "correct or to remove that line"
            )
        else:
            numbers.append(line.lstrip().rstrip(" \r\n"))
            left = None if left is None else left - 1
    if left:
        raise truncated(path, len(numbers), len(numbers) + left)
    return _Lines(comments, titles, numbers, left is not None)


def _has_numbers(line: str) -> bool:
    """Return whether a line has three numbers or more."""
    count = 0
    for word in _SEPARATORS.split(line):
        count += _is_number(word)
        if count == 3:
            return True
    return False


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _header(path: AnyPath, lines: _Lines, dialect: Dialect, width: int) -> Header | None:
    """Return the fields and the unit that the titles of the columns name; None without titles.

    Raises:
        InputError: the titles do not name x, y and z, or do not fit the columns.
    """
    open_end = width > 3 and not dialect.cells(lines.numbers[:1])[0][-1].strip()
    for line in reversed(lines.titles):
        titles = split_titles(line, dialect, width)
        if len(titles) == width - 1 and open_end:
            titles = [*titles, ""]
        if len(titles) == width:
            header = header_of(path, titles)
            if header is None:
                raise no_position(path, titles)
            return header
        if named_axes(titles) >= 2:
            raise InputError(
                f"The point cloud {path} has {len(titles)} titles ({line[:80]}) above {width} columns; try "
                "--columns with a name for each column, for example x,y,z,_"
            )
    for line in reversed(lines.comments):
        titles = split_titles(line, dialect, width)
        if len(titles) == width:
            header = header_of(path, titles)
            if header is not None:
                return header
            if names_degrees(titles):
                raise no_position(path, titles)
    if lines.titles:
        _log.warning(
            "%s: its first line, %s, is no title of %d columns and not read",
            path,
            lines.titles[0][:80],
            width,
        )
    return None


def _guessed(path: AnyPath, lines: _Lines, dialect: Dialect, width: int) -> np.ndarray:
    """Return the table of columns without titles; columns of words are not used."""
    first = dialect.cells(lines.numbers[:1])[0]
    while first and not first[-1].strip():  # a separator at the end of the line
        first = first[:-1]
    places = [k for k, cell in enumerate(first) if _is_number(cell) or cell.strip().lower() in _NOT_A_NUMBER]
    if len(places) < 3:
        raise InputError(f"The point cloud {path} has no lines of three numbers or more; try another file")
    rows = _numbers(path, lines.numbers, dialect, width, places)
    pts = PurePath(path).suffix.lower() == ".pts" and len(places) == width
    if pts and lines.counted and width not in (3, 4, 6, 7):
        raise InputError(
            f"The point cloud {path} has {width} columns, and a PTS file has 3, 4, 6 or 7; try --columns "
            "x,y,z,_ with a name for each column"
        )
    found = _PTS[width] if pts and width in _PTS else guessed_columns(path, rows, places)
    names = [UNUSED] * width
    for place, name in zip(places, found, strict=True):
        names[place] = name
    if (UNUSED in names and not pts) or dialect.decimal_comma:
        log_columns(path, names, decimal_comma=dialect.decimal_comma)
    return table_named(rows, found)


def _table(
    path: AnyPath, lines: Sequence[str], dialect: Dialect, names: Sequence[str], more: bool = False
) -> np.ndarray:
    """Return the table of the named columns; with ``more``, lines may have more columns than names."""
    places = [k for k, name in enumerate(names) if name != UNUSED]
    rows = _numbers(path, lines, dialect, len(names), places, more)
    return table_named(rows, [names[k] for k in places])


def _numbers(
    path: AnyPath,
    lines: Sequence[str],
    dialect: Dialect,
    width: int,
    places: Sequence[int],
    more: bool = False,
) -> FloatArray:
    """Return (N, len(places)) numbers: the cells at ``places`` of N lines of ``width`` cells, or ``more``.

    Empty cells and words such as null are NaN.
    """
    cells = dialect.cells(lines)
    if any(len(row) < width if more else len(row) != width for row in cells):
        raise _not_numbers(path, width)
    picked = [[row[k] for k in places] for row in cells] if more or len(places) < width else cells
    try:
        return np.array(picked, dtype=np.float64)
    except ValueError:
        picked = [["nan" if c.strip().lower() in _NOT_A_NUMBER else c for c in row] for row in picked]
    try:
        return np.array(picked, dtype=np.float64)
    except ValueError:
        raise _not_numbers(path, width) from None


def _not_numbers(path: AnyPath, width: int) -> InputError:
    return InputError(
        f"The point cloud {path} has a line that is not {width} numbers; try to export it again, or "
        "--columns with the columns that every line has"
    )
