"""Columns of a recorded link: their quantities and units, from a header or from the values."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError

FloatArray = NDArray[np.float64]

QUANTITIES = ("time", "rate", "round trip", "loss")
USUAL = ("s", "Mbit/s", "ms", "share")
"""Units of a file without a header."""
FACTORS: tuple[dict[str, float], ...] = (
    {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    {
        "bit/s": 1e-6,
        "kbit/s": 1e-3,
        "Mbit/s": 1.0,
        "Gbit/s": 1e3,
        "B/s": 8e-6,
        "kB/s": 8e-3,
        "MB/s": 8.0,
        "GB/s": 8e3,
    },
    {"s": 1e3, "ms": 1.0, "us": 1e-3, "ns": 1e-6},
    {"share": 1.0, "per cent": 1e-2},
)
"""Factors from every unit to the usual one, by quantity."""
HEADER = "time_s rate_mbit/s rtt_ms loss_share"
"""Example of a header, for error messages."""
_WORDS = (  # "loss_rate" is a loss, and "round_trip_time" is not a time
    (3, r"(packet[ _-]*)?(loss|lost|plr)"),
    (2, r"(rtt|round[ _-]*trip([ _-]*time)?|ping)"),
    (1, r"(data[ _-]*|bit[ _-]*)?(rate|bandwidth|throughput|goodput|capacity|bw)"),
    (0, r"(elapsed([ _-]*time)?|unix([ _-]*time)?|epoch|time[ _-]*stamp|time|date|ts|t(?![a-z]))"),
)
_ONE_WAY = re.compile(r"latency|delay|owd", re.IGNORECASE)
_TIME_UNIT = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "µs", "μs", "usec", "micros", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanoseconds"), "ns"),
}
_RATE_UNIT = re.compile(r"([kmg]?)(bits?|bytes?|b)(ps|/s|/sec|pers|persec|persecond)", re.IGNORECASE)
LIMITS = ((0.0, 1e9), (1e-6, 1e9), (0.0, 1e9))
"""Least and most time, rate above 0 and round trip, in the usual units."""
EPOCH_S = (9e8, 5e9)
"""Seconds since 1970 from 1998 to 2128."""
USUAL_MBPS = 300.0
"""Largest rate that is read in Mbit/s without a note to the user, if no header gives the unit."""
FAST_MBPS, SLOW_STEP_S, SHORT_MS, LONG_MS = 1000.0, 5.0, 1.0, 5000.0
"""Limits of rate, step in time, and short and long round trip, beyond which another unit is as likely."""
MOST_SHARE = 2.0
"""A loss between 1 and this may be a wrong share, or a small percentage."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a header."""

    quantity: int
    """Index in ``QUANTITIES``."""
    unit: str | None
    """Key of ``FACTORS``; None if the header has none."""


def column_named(title: str, where: str) -> Column | None:
    """Return the quantity and unit that a column's title names; None if it names no quantity.

    Raises:
        InputError: the quantity is known, but not the unit; or the title is a one-way latency.
    """
    for quantity, word in _WORDS:
        found = re.match(word, title.strip(), re.IGNORECASE)
        if found:
            return Column(quantity, _unit(quantity, title.strip()[found.end() :], f"{where} has '{title}'"))
    if title.lower() in _TIME_UNIT:
        return Column(0, _TIME_UNIT[title.lower()])
    if _ONE_WAY.search(title):
        raise InputError(
            f"{where} has '{title}': one way or both? Try rtt_ms for a round trip (twice one way)"
        )
    return None


def _unit(quantity: int, text: str, where: str) -> str | None:
    """Return the unit in the part of a title after the quantity, such as ``_kbit/s``; None without one."""
    word = re.sub(r"[\s_\[\](){}.-]", "", text).removeprefix("/").removeprefix("in")
    if quantity == 3:
        if word.lower() in ("%", "percent", "pct", "percentage", "rate%", "ratepercent", "ratepct"):
            return "per cent"
        if word.lower() in ("share", "ratio", "fraction", "probability", "prob", "p"):
            return "share"
        unit = None if word.lower() in ("", "rate") else "?"
    elif quantity == 1:
        unit = _rate_unit(word, where) if word else None
    else:
        unit = _TIME_UNIT.get(word.lower(), "?") if word else None
    if unit == "?":
        raise InputError(f"{where}, whose unit is unknown; try one of {', '.join(FACTORS[quantity])}")
    return unit


def _rate_unit(word: str, where: str) -> str:
    found = _RATE_UNIT.fullmatch(word)
    if found is None:
        return "?"
    prefix, unit, per = found.groups()
    factor = {"": "", "k": "k", "m": "M", "g": "G"}[prefix.lower()]
    if unit == "B" and per.isupper():
        raise InputError(f"{where}: bits or bytes? Try {factor}bit/s or {factor}B/s")
    return f"{factor}B/s" if unit == "B" or unit.lower().startswith("byte") else f"{factor}bit/s"


def units_of(columns: Sequence[FloatArray], named: Sequence[str | None], path: str) -> list[str]:
    """Return the unit of every quantity: as named in the header, or as the values show.

    Args:
        columns: values of time, rate, round trip and loss, each (T,).
        named: units in the header; None without one.
        path: the file, for messages.

    Raises:
        InputError: the values may be in the usual unit or another; a header settles it.
    """
    guesses = (_time_unit, _rate_guess, _round_trip_unit, _loss_unit)
    return [unit or guess(values, path) for unit, guess, values in zip(named, guesses, columns, strict=True)]


def _doubt(path: str, what: str, units: str, header: str) -> InputError:
    return InputError(
        f"The recorded link {path} has {what}: in {units}? Write a header as its first line to settle this, "
        f"for example: {header}"
    )


def _time_unit(t: FloatArray, path: str) -> str:
    for unit, factor in FACTORS[0].items():
        if EPOCH_S[0] < t[0] * factor < EPOCH_S[1]:
            return unit
    step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    if step >= SLOW_STEP_S:
        what = f"rows that are {step:g} apart"
        raise _doubt(path, what, "seconds or milliseconds", HEADER.replace("time_s", "time_ms"))
    return "s"


def _rate_guess(rate: FloatArray, path: str) -> str:
    most = float(rate.max())
    if most > FAST_MBPS:
        header = HEADER.replace("mbit", "kbit")
        raise _doubt(path, f"rates up to {most:g}", "Mbit/s, kbit/s or bit/s", header)
    return "Mbit/s"


def _round_trip_unit(round_trip: FloatArray, path: str) -> str:
    most = float(round_trip.max())
    if 0.0 < most < SHORT_MS:
        what = f"round trips of at most {most:g}"
        raise _doubt(path, what, "milliseconds or seconds", HEADER.replace("rtt_ms", "rtt_s"))
    if float(np.median(round_trip)) > LONG_MS:
        what = f"round trips of {float(np.median(round_trip)):g}"
        raise _doubt(path, what, "milliseconds or microseconds", HEADER.replace("rtt_ms", "rtt_us"))
    return "ms"


def _loss_unit(loss: FloatArray, path: str) -> str:
    most = float(loss.max())
    if 1.0 < most <= MOST_SHARE:
        raise _doubt(path, f"losses up to {most:g}", "per cent or shares", HEADER.replace("share", "percent"))
    return "per cent" if most > 1.0 else "share"
