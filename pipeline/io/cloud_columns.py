"""Columns of point tables: names given by a user, and a guess from the numbers where nothing names them."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_table import COLOR, NORMAL, POSITION
from pipeline.types import AnyPath, BoolArray, FloatArray

_log = logging.getLogger(__name__)

UNUSED = "_"
_OPTION_NAMES = {name: name for name in (*POSITION, *NORMAL, *COLOR)} | {
    "r": "red", "g": "green", "b": "blue", "i": UNUSED, "t": UNUSED, UNUSED: UNUSED,
}  # fmt: skip
_UNIT_TOLERANCE = 0.02
"""Largest deviation of a triple's length from 1 with which it is read as a normal."""
_CLEARER = 0.3
"""Three columns are colours if they correlate by so much more than any other three whole-number columns."""
_OPAQUE = 255
"""Value of an alpha channel after the colours."""
_TIME_ROWS = 20
"""Fewer rows do not show whether a column rises like a time."""
_TIME_SHARE = 0.5
"""A rising column with a larger share of distinct values is taken for a time or a row number."""
_FARTHEST_ON_EARTH = 1e8
_LARGEST_DEGREES = 0.02
_UPRIGHT = 100.0
"""A cloud less than ``_LARGEST_DEGREES`` wide and this many times as high has degrees in x and y."""


def parse_columns(text: str) -> tuple[str, ...]:
    """Return the field of each column from text such as ``x,y,z,_,r,g,b``; ``_`` is a column without use.

    Raises:
        InputError: a name is unknown or given twice, or names of a position, normal or colour are missing.
    """
    words = [word.strip().lower() for word in text.replace(" ", ",").split(",") if word.strip()]
    unknown = next((word for word in words if word not in _OPTION_NAMES), None)
    if unknown is not None:
        raise InputError(
            f"The columns {text} name '{unknown}', which is none of x, y, z, nx, ny, nz, r, g, b, i, t and _ "
            "for a column without use; try, for example, x,y,z,_,r,g,b"
        )
    names = tuple(_OPTION_NAMES[word] for word in words)
    twice = next((name for name in names if name != UNUSED and names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"The columns {text} name {twice} twice; try _ for the one without use")
    for group in (POSITION, NORMAL, COLOR):
        count = sum(name in names for name in group)
        if count not in (0, 3) or (group is POSITION and count == 0):
            raise InputError(f"The columns {text} do not name all of {', '.join(group)}; try x,y,z,_")
    return names


def checked_width(path: AnyPath, names: Sequence[str], width: int) -> tuple[str, ...]:
    """Return names for all columns of a file; those after the last given name have no use.

    Raises:
        InputError: more names than columns.
    """
    if len(names) > width:
        raise InputError(
            f"The point cloud {path} has {width} columns, and --columns names {len(names)}; try one for each"
        )
    return (*names, *([UNUSED] * (width - len(names))))


def guessed_columns(path: AnyPath, rows: FloatArray, places: Sequence[int] | None = None) -> tuple[str, ...]:
    """Return the fields of (N, W) numbers without names, guessed from their values.

    The first three columns are the position. Three columns of vectors of length one are normals, three
    columns of whole numbers up to 255 colours.

    Args:
        path: the file.
        rows: (N, W) numbers.
        places: (W,) positions of these columns in the file, if it has other columns too.

    Raises:
        InputError: the numbers may mean different things.
    """
    width = rows.shape[1]
    places = range(width) if places is None else places
    normal = next((k for k in range(3, width - 2) if _unit_vectors(rows[:, k : k + 3])), None)
    others = [k for k in range(3, width) if normal is None or not normal <= k < normal + 3]
    _check_position(path, rows, others, places)
    names = [*POSITION, *([UNUSED] * (width - 3))]
    if normal is not None:
        names[normal : normal + 3] = NORMAL
    color = _colors_at(path, rows, others, places)
    if color is not None:
        names[color : color + 3] = COLOR
    return tuple(names)


def log_columns(
    path: AnyPath, names: Sequence[str], titles: Sequence[str] | None = None, decimal_comma: bool = False
) -> None:
    """Log the field as which each column is read.

    Args:
        path: the file.
        names: field of each column.
        titles: the columns' titles in the file.
        decimal_comma: whether commas are decimal marks in the file.
    """
    parts = ["commas are decimal marks"] if decimal_comma else []
    for group, phrase in ((POSITION, "x, y, z are"), (NORMAL, "the normals are"), (COLOR, "the colours are")):
        if set(group) <= set(names):
            parts.append(f"{phrase} {_places([list(names).index(name) for name in group], titles)}")
    unused = [k for k, name in enumerate(names) if name == UNUSED]
    if len(unused) > 4:
        parts.append(f"the other {len(unused)} columns are not used")
    elif unused:
        parts.append(f"{_places(unused, titles)} {'is' if len(unused) == 1 else 'are'} not used")
    _log.warning("%s: %s (--columns names them otherwise)", path, "; ".join(parts))


def table_of_columns(path: AnyPath, rows: FloatArray, given: tuple[str, ...] | None) -> np.ndarray:
    """Convert (N, 3 or more) numbers to a structured array, by the given or else by guessed columns.

    Raises:
        InputError: the numbers may mean different things, or there are more names than columns.
    """
    if given is not None:
        return table_named(rows, checked_width(path, given, rows.shape[1]))
    names = guessed_columns(path, rows)
    if UNUSED in names:
        log_columns(path, names)
    return table_named(rows, names)


def table_named(rows: FloatArray, names: Sequence[str]) -> np.ndarray:
    """Return a structured array; its colours are integers if all are whole and any exceeds 1, else floats."""
    used = [(name, k) for k, name in enumerate(names) if name != UNUSED]
    colors = rows[:, [k for name, k in used if name in COLOR]]
    whole = colors.size > 0 and bool(np.all(colors == np.rint(colors))) and colors.max() > 1
    kinds = [(name, "i8" if whole and name in COLOR else "f8") for name, _ in used]
    table = np.empty(len(rows), kinds)
    for name, k in used:
        table[name] = rows[:, k]
    return table


def check_degrees(
    path: AnyPath, points: FloatArray, option: str = "--columns x,y,z if they are metres"
) -> None:
    """Raise an InputError if x and y of (N, 3) points look like latitude and longitude."""
    finite = points[np.isfinite(points).all(axis=1)]
    if len(finite) < _TIME_ROWS:
        return
    low, high = finite.min(axis=0), finite.max(axis=0)
    across, up = float((high - low)[:2].max()), float(high[2] - low[2])
    on_earth = bool((np.abs(finite[:, :2]) <= 180.0).all()) and float(np.abs(finite[:, :2]).max()) > 1.0
    if on_earth and 0.0 < across < _LARGEST_DEGREES and up > _UPRIGHT * across:
        raise InputError(
            f"The first two coordinates in {path} look like latitude and longitude in degrees, which are no "
            f"lengths; try to export it in metres (UTM), or {option}"
        )


def _unit_vectors(triple: FloatArray) -> bool:
    return bool(np.all(np.abs(np.linalg.norm(triple, axis=1) - 1.0) < _UNIT_TOLERANCE))


def _whole(column: FloatArray) -> bool:
    return bool(np.all(column == np.rint(column)))


def _check_position(path: AnyPath, rows: FloatArray, others: list[int], places: Sequence[int]) -> None:
    """Raise an InputError if the first three of more columns may not be the position."""
    if not others:
        check_degrees(path, rows[:, :3])
        return
    first = rows[:, 0]
    rises = len(first) >= _TIME_ROWS and bool(np.all(np.diff(first) >= 0.0))
    if rises and len(np.unique(first)) > _TIME_SHARE * len(first):
        raise _doubt(path, places, f"column {places[0] + 1} rises from line to line like a time", 1)
    if np.median(np.abs(first)) > _FARTHEST_ON_EARTH:
        raise _doubt(path, places, f"column {places[0] + 1} is too large for a position", 1)
    fractional = [k for k in range(3 + len(others)) if k < rows.shape[1] and not _whole(rows[:, k])]
    for count in (1, 2):
        leading = all(_whole(rows[:, k]) for k in range(count))
        following = [k for k in range(count, count + 3) if k in fractional and (k < 3 or k in others)]
        if leading and len(following) == 3:
            what = f"{_places(places[:count], None)} {'has' if count == 1 else 'have'}"
            raise _doubt(path, places, f"{what} whole numbers like a row or ring, others not", count)
    check_degrees(path, rows[:, :3])


def _doubt(path: AnyPath, places: Sequence[int], why: str, before: int) -> InputError:
    """Return the error for a position that may begin ``before`` columns later."""
    later = _option([*([UNUSED] * before), *POSITION], places)
    return InputError(
        f"The point cloud {path} does not say what its columns are, and {why}; try --columns {later} or "
        f"--columns {_option(POSITION, places)}, whichever is right"
    )


def _option(names: Sequence[str], places: Sequence[int]) -> str:
    """Return the value of --columns for names of the columns at some places of the file."""
    columns = [UNUSED] * (places[-1] + 1)
    for name, place in zip(names, places, strict=False):
        columns[place] = name
    return ",".join(columns)


def _colors_at(path: AnyPath, rows: FloatArray, others: list[int], places: Sequence[int]) -> int | None:
    """Return the first of the three columns that are colours; None if there are none.

    Raises:
        InputError: more than three adjacent columns may be colours, and no three are clearly likelier.
    """
    byte = [k for k in others if _whole(rows[:, k]) and rows[:, k].min() >= 0 and rows[:, k].max() <= 255]
    starts = [k for k in byte if k + 1 in byte and k + 2 in byte]
    if len(starts) < 2:
        return starts[0] if starts else None
    apart = [start for start in starts if start + 1 not in starts and start - 1 not in starts]
    if apart and apart[0] == starts[0]:
        return starts[0]
    if len(starts) == 2 and bool(np.all(rows[:, starts[1] + 2] == _OPAQUE)):
        return starts[0]
    alike = {start: _likeness(rows[:, start : start + 3]) for start in starts}
    best, second = sorted(starts, key=lambda start: -alike[start])[:2]
    if alike[best] - alike[second] < _CLEARER:
        orders = [["_"] * rows.shape[1] for _ in (0, 1)]
        for order, start in zip(orders, sorted((best, second)), strict=True):
            order[:3], order[start : start + 3] = POSITION, "rgb"
        raise InputError(
            f"The point cloud {path} has more than three adjacent columns that may be colours; try --columns "
            f"{_option(orders[0], places)} or --columns {_option(orders[1], places)}, whichever is right"
        )
    return best


def _likeness(triple: FloatArray) -> float:
    """Return the least correlation of any two of three columns; constant ones are alike to each other."""
    constant: BoolArray = np.ptp(triple, axis=0) == 0.0
    if constant.any():
        return 1.0 if constant.all() else 0.0
    return float(np.corrcoef(triple.T).min())


def _places(places: Sequence[int], titles: Sequence[str] | None) -> str:
    """Return text such as ``columns 2 to 4 (X [m], Y [m], Z [m])``; columns are counted from 1."""
    numbers = [str(k + 1) for k in places]
    if len(places) == 1:
        text = f"column {numbers[0]}"
    elif len(places) > 2 and list(places) == list(range(places[0], places[-1] + 1)):
        text = f"columns {numbers[0]} to {numbers[-1]}"
    else:
        text = f"columns {', '.join(numbers[:-1])} and {numbers[-1]}"
    return text if titles is None else f"{text} ({', '.join(titles[k] for k in places)})"
