"""Units of a LAS file's coordinates, from the coordinate system in its header."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import AnyPath, FloatArray

_log = logging.getLogger(__name__)

_TOKEN = re.compile(r'(\w+)\s*[\[(]|"([^"]*)"|([-+]?\d[-+\d.eE]*)|([\])])')
_PROJECTED = ("PROJCS", "PROJCRS")
_VERTICAL = ("VERT_CS", "VERTCS", "VERTCRS")
_GEOGRAPHIC = ("GEOGCS", "GEOGCRS", "GEODCRS")
_UNITS = ("UNIT", "LENGTHUNIT")
_MODEL_KEY, _SYSTEM_KEY, _UNIT_KEY, _HEIGHT_UNIT_KEY = 1024, 3072, 3076, 4099
_GEOGRAPHIC_MODEL = 2
_EPSG_UNITS = {9001: 1.0, 9002: 0.3048, 9003: 1200.0 / 3937.0}
"""Length of units in metres by their EPSG code: metre, foot, US survey foot."""
_IN_METRES = (range(32601, 32761), range(25828, 25839), range(26901, 26924), range(3857, 3858))
"""EPSG codes of coordinate systems in metres: UTM and web Mercator."""


def metres_per_axis(path: AnyPath, records: Iterable[Any]) -> FloatArray:
    """Return (3,) the length of a unit of x, y and z in metres; other units than metres are logged.

    Without a named unit, x and y are in metres, and heights are in the unit of x and y.

    Args:
        path: the file.
        records: variable length records as laspy reads them.

    Raises:
        InputError: the coordinates are latitude and longitude.
    """
    across, up = None, None
    for record in records:
        if hasattr(record, "geo_keys"):
            keys = {key.id: key.value_offset for key in record.geo_keys}
            across, up = _units_of_keys(path, keys)
        elif record.record_id == 2112 and hasattr(record, "string"):
            across, up = _units_of_wkt(path, record.string)
            break
    metres = np.array([across or 1.0, across or 1.0, up or across or 1.0])
    if (metres != 1.0).any():
        same = metres[0] == metres[2]
        _log.warning(
            "%s: its coordinate system says that a unit is %.7g m%s; x, y, z are converted to metres "
            "(--metres-per-unit names another unit)",
            path,
            metres[0],
            "" if same else f", and {metres[2]:.7g} m in height",
        )
    return metres


def _units_of_keys(path: AnyPath, keys: dict[int, int]) -> tuple[float | None, float | None]:
    """Return the units of x and y and of heights, in metres, from GeoTIFF keys; None if unknown."""
    if keys.get(_MODEL_KEY) == _GEOGRAPHIC_MODEL:
        raise _degrees(path)
    across, up = (_EPSG_UNITS.get(keys.get(key, 0)) for key in (_UNIT_KEY, _HEIGHT_UNIT_KEY))
    code = keys.get(_SYSTEM_KEY)
    if across is None and code is not None and not any(code in codes for codes in _IN_METRES):
        _log.warning(
            "%s: its coordinate system is EPSG:%d, whose unit the file does not name; it is taken for "
            "the metre (--metres-per-unit names another unit)",
            path,
            code,
        )
    return across, up


def _units_of_wkt(path: AnyPath, text: str) -> tuple[float | None, float | None]:
    """Return the units of x and y and of heights, in metres, from well-known text; None if unknown."""
    inside: list[str] = []
    seen: set[str] = set()
    across, up = None, None
    for name, _, number, closing in _TOKEN.findall(text):
        if name:
            inside.append(name.upper())
            seen.add(name.upper())
        elif closing:
            inside = inside[:-1]
        elif number and inside and inside[-1] in _UNITS:
            owner = next((part for part in inside[-2::-1] if part != "AXIS"), "")
            if owner in _PROJECTED and across is None:
                across = float(number)
            elif owner in _VERTICAL and up is None:
                up = float(number)
    if seen & set(_GEOGRAPHIC) and not seen & set(_PROJECTED):
        raise _degrees(path)
    return across, up


def _degrees(path: AnyPath) -> InputError:
    return InputError(
        f"The coordinate system of {path} is latitude and longitude in degrees, which are no lengths; try to "
        "export it in metres (UTM), or --metres-per-unit if its numbers are lengths"
    )
