"""Titles of the columns of point tables: their fields, as many programs name them, and their unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.recfunctions import rename_fields

from packetmesh.errors import InputError
from pipeline.io.cloud_columns import UNUSED
from pipeline.io.cloud_table import COLOR, NORMAL, POSITION
from pipeline.types import AnyPath

METRES = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 1.0),
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), 1e-3),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), 1e-2),
    "dm": 0.1,
    **dict.fromkeys(("km", "kilometer", "kilometers", "kilometre", "kilometres"), 1e3),
    **dict.fromkeys(("in", "inch", "inches"), 0.0254),
    **dict.fromkeys(("ft", "foot", "feet", "ift", "ftint"), 0.3048),
    **dict.fromkeys(("usft", "ftus", "sft", "ussurveyfoot", "ussurveyfeet"), 1200.0 / 3937.0),
    **dict.fromkeys(("yd", "yard", "yards"), 0.9144),
}
"""Length of a unit in metres, by its name in a title, without blanks and marks."""
_ANGLES = ("deg", "degree", "degrees", "°", "rad", "gon", "dd")
_DEGREES = ("lat", "latitude", "lon", "long", "lng", "longitude")
_BRACKET = re.compile(r"[\[({]([^\])}]*)[\])}]")
_SUFFIX = re.compile(rf"[\s_./]({'|'.join(sorted(METRES, key=len, reverse=True))})$")
_MARKS = re.compile(r"[\s_\-:./'\"]+")


def _aliases() -> dict[str, str]:
    """Return the field of each title, in lower case without blanks and marks."""
    found: dict[str, str] = {}
    for axis, (name, place) in enumerate(zip("xyz", ("0", "1", "2"), strict=True)):
        for word in ("coordinate", "coord", "pos", "position", "point", "points", "cartesian"):
            found |= {f"{word}{name}": POSITION[axis], f"{name}{word}": POSITION[axis]}
        found |= {f"points{place}": POSITION[axis], f"pointsmxyz{place}": POSITION[axis]}
        for word in (f"n{name}", f"normal{name}", f"normals{name}", f"{name}normal", f"normals{place}"):
            found[word] = NORMAL[axis]
    for channel, (letter, name) in enumerate(zip("rgb", COLOR, strict=True)):
        for word in (
            letter,
            name,
            f"{letter}f",
            f"diffuse{name}",
            *(f"{c}{n}" for c in ("color", "colour") for n in (letter, name)),
        ):
            found[word] = COLOR[channel]
    found |= dict.fromkeys(("east", "easting", "eastings", "rechtswert"), "x")
    found |= dict.fromkeys(("north", "northing", "northings", "hochwert"), "y")
    found |= dict.fromkeys(("elevation", "elev", "height", "altitude", "höhe", "hoehe"), "z")
    return found | {"rot": "red", "grün": "green", "gruen": "green", "blau": "blue"}


_ALIASES = _aliases()


@dataclass(frozen=True, slots=True)
class Header:
    """Fields and unit of a table's columns, from their titles."""

    titles: tuple[str, ...]
    """The titles as they are in the file."""
    names: tuple[str, ...]
    """Field of each column, ``_`` for one without use."""
    metres_per_unit: float | None
    """Metres per unit of the position; None if no title has a known unit."""

    @property
    def plain(self) -> bool:
        """Whether every column is used and has its plain name, so that there is nothing to explain."""
        usual = {*POSITION, *NORMAL, *COLOR, "r", "g", "b", "normal_x", "normal_y", "normal_z"}
        return UNUSED not in self.names and all(title.lower() in usual for title in self.titles)


def header_of(path: AnyPath, titles: Sequence[str]) -> Header | None:
    """Return the fields and the unit that the titles name; None if they do not name x, y and z.

    Raises:
        InputError: two columns have the same name, or the position's units differ or are angles.
    """
    titles = [title.strip().strip("\"'").strip() for title in titles]
    units = [_split(title) for title in titles]
    names = [_field(word) for word, _ in units]
    plain = [word.strip() for word, _ in units]
    for field in (*POSITION, *NORMAL, *COLOR):
        places = [k for k, name in enumerate(names) if name == field]
        exact = [k for k in places if plain[k] == field]
        if len(places) > 1 and len(exact) != 1:
            listed = " and ".join(titles[k] for k in places[:2])
            raise InputError(
                f"The point cloud {path} has two columns {field}, {listed}; try --columns with the one "
                "to use and _ for the other"
            )
        for k in places:
            names[k] = field if k == (exact or places)[0] else UNUSED
    if not set(POSITION) <= set(names):
        return None
    whole = {name for group in (POSITION, NORMAL, COLOR) if set(group) <= set(names) for name in group}
    metres = _unit(path, [(titles[k], units[k][1]) for k in map(names.index, POSITION)])
    return Header(tuple(titles), tuple(name if name in whole else UNUSED for name in names), metres)


def with_plain_names(table: np.ndarray) -> np.ndarray:
    """Return a structured array with PLY's names for fields of other names: X, n_x, diffuse_red."""
    names = table.dtype.names or ()
    plain = {name: name for name in names}
    for group in (POSITION, NORMAL, COLOR):
        others = [[name for name in names if _field(name) == field] for field in group]
        if not set(group) & set(names) and all(len(same) == 1 for same in others):
            plain |= {same[0]: field for same, field in zip(others, group, strict=True)}
    return rename_fields(table, plain)


def no_position(path: AnyPath, titles: Sequence[str]) -> InputError:
    """Return the error for titles that do not name x, y and z."""
    listed = ", ".join(titles[:12])
    if names_degrees(titles):
        return InputError(
            f"The point cloud {path} has latitude and longitude ({listed}), which are angles and no x, y, z; "
            "try to export it in metres, for example in UTM coordinates"
        )
    return InputError(
        f"The point cloud {path} has no x, y, z among the titles of its columns ({listed}); try --columns, "
        "for example --columns x,y,z,_ with _ for a column without use"
    )


def names_degrees(titles: Sequence[str]) -> bool:
    """Return whether the titles name a latitude or longitude."""
    return any(_MARKS.sub("", _split(title)[0]) in _DEGREES for title in titles)


def named_axes(titles: Sequence[str]) -> int:
    """Return how many of x, y and z are among the titles."""
    return len({_field(_split(title)[0]) for title in titles} & set(POSITION))


def _split(title: str) -> tuple[str, str | None]:
    """Return a title in lower case without its unit, and the unit."""
    text = title.lower().strip().strip("\"'").strip()
    bracket = _BRACKET.search(text)
    if bracket is not None:
        return _BRACKET.sub("", text).strip(), _MARKS.sub("", bracket[1])
    suffix = _SUFFIX.search(text)
    if suffix is not None and _field(text[: suffix.start()]) in POSITION:
        return text[: suffix.start()], suffix[1]
    return text, None


def _field(word: str) -> str | None:
    """Return the field that a title without its unit names."""
    key = _MARKS.sub("", word.lower())
    return key if key in POSITION else _ALIASES.get(key)


def _unit(path: AnyPath, titled: list[tuple[str, str | None]]) -> float | None:
    """Return the unit of the position in metres; None if no title has a known unit.

    Raises:
        InputError: the units are angles, or differ.
    """
    if any(unit in _ANGLES for _, unit in titled):
        raise no_position(path, ["latitude", "longitude", *(title for title, _ in titled)])
    metres = {METRES.get(unit) if unit else None for _, unit in titled}
    if len(metres) > 1:
        raise InputError(
            f"x, y and z in {path} have different units ({', '.join(title for title, _ in titled)}); try to "
            "export them in one unit"
        )
    return metres.pop()
