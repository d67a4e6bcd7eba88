"""Files of recorded links: text with columns of time, rate, round trip and loss, or other programs' files."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from network_sim.config import NetworkConfig
from network_sim.radio.link_columns import (
    EPOCH_S,
    FACTORS,
    HEADER,
    LIMITS,
    QUANTITIES,
    USUAL,
    USUAL_MBPS,
    Column,
    FloatArray,
    column_named,
    units_of,
)
from network_sim.radio.link_formats import other_link, refuse_capture
from network_sim.radio.link_trace import LinkTrace
from packetmesh.errors import InputError
from packetmesh.files import read_text

SHORTEST_S = 1e-7
"""Shortest time between rows: less than the time of a bit on links that can be simulated."""
HOLE_ROWS = 10.0
HOLE_S = 1.0
"""A step longer than both ``HOLE_S`` and ``HOLE_ROWS`` times the median step between rows is a hole."""
MOST_BYTES = 20_000_000
"""Largest size of a recording: half a million rows."""
_DECIMAL_COMMA = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the file: the text before its #, or its comment if it holds nothing else."""

    number: int
    text: str
    is_comment: bool


@dataclass(frozen=True, slots=True)
class Form:
    """How a file writes its rows."""

    separator: str | None
    """None is white space."""
    decimal_comma: bool
    ended: bool = False
    """Whether all rows have a separator at their end, after which there is no field."""

    def fields(self, text: str) -> list[str]:
        """Return the fields of a line."""
        parts = text.split() if self.separator is None else next(csv.reader([text], delimiter=self.separator))
        fields = [field.strip().strip('"') for field in parts]
        return fields[:-1] if self.ended and not fields[-1] else fields

    def number(self, field: str) -> float | None:
        """Return the number in a field; None if there is none."""
        try:
            if "_" in field:
                raise ValueError("Python reads 1_0 as 10")
            return float(field.replace(",", ".") if self.decimal_comma else field)
        except ValueError:
            return None


def read_link_trace(path: str | Path) -> LinkTrace:
    """Read a recorded link: columns of time, rate, round trip and share lost, or another program's file.

    A column of whole numbers is a mahimahi trace, JSON the output of iperf3 (``link_formats``). Else the
    columns are in s, Mbit/s, ms and 0 to 1 without a header; a header names quantities and units in any
    order. If a loss is above 2, all are in per cent; times since 1970 are in the unit that their size shows.
    Columns are separated by white space, commas, semicolons or tabs; decimal commas are recognised. Times
    rise from row to row and count from the first one. Lines may be blank. Text after a # is a comment, but
    the last comment above the rows is a header if it names the four quantities. A share between -1 and 0
    counts as 0: more packets arrived during the row than were sent in it.

    Raises:
        InputError: the file cannot be read or is a packet capture, has no rows, or a row has the wrong number
            of columns, a field that is no number, or a number out of range; a unit is in doubt; times do not
            rise; a hole in time leaves the link's state unknown; or all rates are 0.
    """
    return _read(path)[0]


def link_notes(config: NetworkConfig) -> list[str]:
    """Return a sentence for each recorded link of a config whose file is not in the usual form.

    Raises:
        InputError: as for ``read_link_trace``.
    """
    used = (config.mac.trace if config.mac.kind == "replay" else None, config.uplink.trace)
    street = config.scenario == "street-grid"
    notes = [_read(path)[1] for path in dict.fromkeys(used) if path is not None and not street]
    return [note for note in notes if note]


def _read(path: str | Path) -> tuple[LinkTrace, str]:
    """Return the recording, and a sentence about its form if that is not the usual one."""
    refuse_capture(path, MOST_BYTES)
    text = read_text(path, "recorded link", MOST_BYTES)
    other = other_link(text, str(path))
    if other is not None:
        return other
    lines = list(_lines(text))
    rows = [line for line in lines if not line.is_comment]
    if not rows:
        raise InputError(
            f"The recorded link {path} has no rows; try columns of {', '.join(_usual_columns())}"
        )
    form = _form(rows, str(path))
    header, rows = _header(lines, rows, form, str(path))
    usual: list[Column | None] = [Column(index, None) for index in range(len(QUANTITIES))]
    columns = usual if header is None else header
    order, width = _order(columns, str(path)), len(columns)
    named = [_unit_in(columns, index) for index in order]
    table: FloatArray = np.array([_row(form, line, width, order, str(path)) for line in rows]).T
    units = units_of(list(table), named, str(path))
    _check_ranges(table, units, rows, str(path))
    scaled = [values * FACTORS[index][units[index]] for index, values in enumerate(_from_zero(table))]
    numbers = [line.number for line in rows]
    _check_limits(scaled, units, numbers, str(path))
    _check_times(scaled[0], numbers, path)
    if not table[1].any():
        raise InputError(f"The recorded link {path} has a rate of 0 throughout; try another recording")
    trace = LinkTrace(scaled[0], 1e6 * scaled[1], 1e-3 * scaled[2], np.maximum(scaled[3], 0.0))
    note = _note(str(path), form, units, table[0][0], more=width > len(order))
    most = float(table[1].max())
    if named[1] is None and most > USUAL_MBPS:
        note = note or f"The recorded link {path} was read with rate in Mbit/s"
        note += f" (up to {most:g}); if that is wrong, name the unit in a header"
    return trace, note


def _usual_columns() -> list[str]:
    return [f"{name} in {unit}" for name, unit in zip(QUANTITIES, (*USUAL[:3], "0 to 1"), strict=True)]


def _lines(text: str) -> Iterable[Line]:
    for number, whole in enumerate(text.splitlines(), 1):
        row, _, comment = whole.partition("#")
        if row.strip():
            yield Line(number, row.strip(), False)
        elif comment.strip():
            yield Line(number, comment.strip(), True)


def _form(rows: Sequence[Line], path: str) -> Form:
    """Return how the rows are written; the first row may be a header."""
    below = rows[1:] or rows
    line = next((row for row in below if "," in row.text), below[-1])
    for separator in (";", "\t"):
        if separator in line.text:
            return Form(separator, decimal_comma="," in line.text, ended=_ended(below, separator))
    if "," not in line.text:
        return Form(None, decimal_comma=False)
    if len(line.text.split()) > 1 and all(map(_DECIMAL_COMMA.fullmatch, line.text.split())):
        return Form(None, decimal_comma=True)
    form, usual = Form(",", decimal_comma=False, ended=_ended(below, ",")), len(QUANTITIES)
    count, titles = len(form.fields(line.text)), form.fields(rows[0].text)
    titled = len(titles) == count and form.number(titles[0]) is None
    if usual < count <= 2 * usual and not titled:
        raise InputError(
            f"{path}, line {line.number} has {count} columns; try {usual}, or semicolons between columns "
            "if commas are decimal"
        )
    return form


def _ended(rows: Sequence[Line], separator: str) -> bool:
    return all(row.text.endswith(separator) for row in rows)


def _header(
    lines: Sequence[Line], rows: list[Line], form: Form, path: str
) -> tuple[list[Column | None] | None, list[Line]]:
    """Return the columns that a header names, or None without one, and the rows below it."""
    first, where = rows[0], f"{path}, line {rows[0].number}"
    width = len(form.fields(rows[-1].text))
    if all(form.number(field) is None for field in form.fields(first.text)):
        if len(rows) == 1:
            raise InputError(f"The recorded link {path} has no rows below its header; try another recording")
        titles = _titles(first.text, form)
        columns = _named_columns(titles, where)
        missing = [name for index, name in enumerate(QUANTITIES) if index not in _quantities(columns)]
        if missing or len(titles) != width:
            found = f"not found: {', '.join(missing)}" if missing else f"the rows have {width} columns"
            hint = f"try a header such as: {HEADER} ({found})"
            raise InputError(f"{where} does not name the four columns; {hint}")
        return columns, rows[1:]
    above = [line for line in lines if line.is_comment and line.number < first.number]
    if above:
        titles = _titles(above[-1].text, form)
        known = [_plainly_named(title, f"{path}, line {above[-1].number}") for title in titles]
        if len(titles) == width and set(_quantities(known)) == set(range(len(QUANTITIES))):
            return [column_named(title, f"{path}, line {above[-1].number}") for title in titles], rows
    return None, rows


def _titles(text: str, form: Form) -> list[str]:
    """Return the titles in a header; a unit in brackets belongs to the title before it."""
    joined = re.sub(r"\s+(?=[\[(])", "", text)
    return form.fields(joined)


def _quantities(columns: Iterable[Column | None]) -> list[int]:
    return [column.quantity for column in columns if column is not None]


def _named_columns(titles: Sequence[str], where: str) -> list[Column | None]:
    """Return the columns that titles name; an ambiguous title counts as None if the others name all four.

    Raises:
        InputError: a title is ambiguous, and the others do not name all four quantities.
    """
    columns = [_plainly_named(title, where) for title in titles]
    if set(_quantities(columns)) == set(range(len(QUANTITIES))):
        return columns
    return [column_named(title, where) for title in titles]


def _plainly_named(title: str, where: str) -> Column | None:
    """Return the column that a title names; None if it names none or is ambiguous."""
    try:
        return column_named(title, where)
    except InputError:
        return None


def _order(header: Sequence[Column | None], path: str) -> list[int]:
    """Return the index of the column of each quantity."""
    found = _quantities(header)
    for quantity, name in enumerate(QUANTITIES):
        if found.count(quantity) != 1:
            raise InputError(f"The header of {path} names {name} twice; try to rename one of these columns")
    places = {column.quantity: index for index, column in enumerate(header) if column is not None}
    return [places[quantity] for quantity in range(len(QUANTITIES))]


def _unit_in(header: Sequence[Column | None], index: int) -> str | None:
    column = header[index]
    return None if column is None else column.unit


def _row(form: Form, line: Line, width: int, order: Sequence[int], path: str) -> list[float]:
    fields, where = form.fields(line.text), f"{path}, line {line.number}"
    if len(fields) != width:
        count = f"{len(fields)} column{'s' * (len(fields) != 1)}"
        raise InputError(f"{where} has {count}; try {width}: {', '.join(_usual_columns())}")
    row = []
    for name, index in zip(_usual_columns(), order, strict=True):
        value = form.number(fields[index])
        if value is None:
            raise InputError(f"{where} has '{fields[index]}' as {name}; try a number, or # before a comment")
        if not math.isfinite(value):
            raise InputError(f"{where} has {fields[index]} as {name}; try a finite number")
        row.append(value)
    return row


def _check_ranges(table: FloatArray, units: Sequence[str], rows: Sequence[Line], path: str) -> None:
    """Raise if a time, rate or round trip is negative, or a loss is not a share from -1 to 1."""
    whole = 1.0 / FACTORS[-1][units[-1]]
    for index, (name, values) in enumerate(zip(QUANTITIES, table, strict=True)):
        least, most, hint = 0.0, math.inf, "0 or more"
        if index == len(QUANTITIES) - 1:
            least, most, hint = -whole, whole, f"0 to {whole:g}"
        wrong = (values < least) | (values > most)
        if wrong.any():
            row = int(np.argmax(wrong))
            found = f"{path}, line {rows[row].number} has {values[row]:g} as {name}"
            raise InputError(f"{found} in {units[index]}; try {hint}")


def _check_limits(scaled: Sequence[FloatArray], units: Sequence[str], lines: list[int], path: str) -> None:
    """Raise if a time, rate or round trip is outside ``LIMITS``."""
    for name, unit, usual, values, (least, most) in zip(
        QUANTITIES, units, USUAL, scaled, LIMITS, strict=False
    ):
        wrong = (values > most) | ((values > 0.0) & (values < least))
        if wrong.any():
            row = int(np.argmax(wrong))
            found = f"{path}, line {lines[row]} has a {name} of {values[row]:g} {usual}, read in {unit}"
            raise InputError(f"{found}; try to check the number and the header's unit")


def _from_zero(table: FloatArray) -> list[FloatArray]:
    """Return the columns with times from the first row on, in the file's unit, so that none is rounded."""
    return [table[0] - table[0][0], *table[1:]]


def _check_times(t_s: FloatArray, lines: list[int], path: str | Path) -> None:
    if len(t_s) < 2:
        return
    steps_s = np.diff(t_s)
    if (steps_s < SHORTEST_S).any():
        row = int(np.argmax(steps_s < SHORTEST_S)) + 1
        step_s, where = float(steps_s[row - 1]), f"{path}, line {lines[row]}"
        if step_s < 0.0:
            raise InputError(f"{where} is {-step_s:g} s before the row above; try rows in order of time")
        if step_s == 0.0:
            raise InputError(f"{where} has the time of the row above; try one row for each time")
        raise InputError(f"{where} comes {step_s:g} s after the row above; try to check the unit of time")
    usual_s = float(np.median(steps_s))
    holes = steps_s > max(HOLE_S, HOLE_ROWS * usual_s)
    if holes.any():
        row = int(np.argmax(holes)) + 1
        raise InputError(
            f"{path}, line {lines[row]} comes {steps_s[row - 1]:g} s after the row before, and most rows are "
            f"{usual_s:g} s apart; try to cut the recording at this hole"
        )


def _note(path: str, form: Form, units: Sequence[str], first: float, more: bool) -> str:
    """Return how the file was read, where that is not the usual form; empty if it is."""
    since_1970 = EPOCH_S[0] < first * FACTORS[0][units[0]] < EPOCH_S[1]
    parts = [
        f"{name} in {unit}{' since 1970' if since_1970 and name == 'time' else ''}"
        for name, unit, usual in zip(QUANTITIES, units, USUAL, strict=True)
        if unit != usual or (since_1970 and name == "time")
    ]
    if form.decimal_comma:
        parts.append("decimal commas")
    if more:
        parts.append("other columns left out")
    return f"The recorded link {path} was read with {', '.join(parts)}" if parts else ""
