"""Separators and decimal marks of point tables in text."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from packetmesh.errors import InputError
from pipeline.types import AnyPath

SAMPLE_LINES = 10_000
"""Lines from which the separator and the decimal mark are found."""
_EXPONENT = r"(?:[eE][-+]?\d+)?"
_COMMA = re.compile(rf"[-+]?\d*,\d+{_EXPONENT}")
_WHOLE = re.compile(rf"[-+]?\d+{_EXPONENT}")
_GROUPS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?")
_DOT_GROUPS = re.compile(r"[-+]?[1-9]\d{0,2}(?:\.\d{3})+,\d+")
_LEADING_ZERO = re.compile(r"0\d+")
_QUOTED = re.compile(r'"[^"]*"')


@dataclass(frozen=True, slots=True)
class Dialect:
    """How the numbers of a text are separated and written."""

    separator: str | None
    """None for blanks and tabs."""
    quoted: bool
    decimal_comma: bool
    thousands: str = ""
    """Mark between groups of three digits."""

    def cells(self, lines: Iterable[str]) -> list[list[str]]:
        """Return the cells of each line, with a point as decimal mark."""
        if self.quoted:
            rows = csv.reader(lines, delimiter=self.separator or " ", skipinitialspace=True)
            return [[self._plain(cell) for cell in row] for row in rows]
        return [self._plain(line).split(self.separator) for line in lines]

    def _plain(self, text: str) -> str:
        if self.thousands:
            text = text.replace(self.thousands, "")
        return text.replace(",", ".") if self.decimal_comma else text


def dialect_of(path: AnyPath, lines: Sequence[str]) -> Dialect:
    """Find the dialect of lines with numbers.

    Raises:
        InputError: a comma may be a decimal mark or a separator.
    """
    sample = lines[:SAMPLE_LINES]
    quoted = any('"' in line for line in sample)
    outside = [_QUOTED.sub("q", line) for line in sample] if quoted else sample
    separator = next((mark for mark in ";|" if all(mark in line for line in outside)), None)
    if separator is None and _by_tabs(outside):
        separator = "\t"
    commas = separator is None and all("," in line for line in outside)
    if commas and (quoted or not all(_decimal_words(line.split()) for line in outside)):
        separator = ","
    plain = Dialect(separator, quoted, decimal_comma=False)
    if not any("," in line for line in sample) or (separator == "," and not quoted):
        if separator == "," and _cut_decimals(plain.cells(sample)):
            raise _doubt(path, "its commas seem to be decimal marks as well as separators")
        return plain
    return _with_decimals(path, plain, [cell.strip() for row in plain.cells(sample) for cell in row])


def split_titles(line: str, dialect: Dialect, width: int) -> list[str]:
    """Return the titles in a line above a table; the separator of the numbers is tried before others.

    A separator at the end of every line of numbers makes an empty last column, which may lack a title.
    """
    tries = [
        next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        for separator in (dialect.separator, ",", ";", "\t", "|")
        if separator is not None and separator in line
    ]
    joined = re.sub(r"\s+(?=[\[(])", "", line)
    tries += [line.split(), joined.split(), re.split(r"\s{2,}", line.strip())]
    return next((row for row in tries if len(row) == width), tries[0])


def _by_tabs(lines: Sequence[str]) -> bool:
    """Return whether one tab stands between any two cells; otherwise tabs count as blanks."""
    counts = {line.rstrip("\t").count("\t") for line in lines}
    return len(counts) == 1 and counts.pop() >= 2 and not any("\t\t" in line for line in lines)


def _decimal_words(words: list[str]) -> bool:
    """Return whether words separated by blanks are numbers with decimal commas."""
    commas = [word for word in words if "," in word]
    return (
        len(words) >= 3
        and len(commas) > 0
        and all(_COMMA.fullmatch(word) for word in commas)
        and not any("." in word for word in words)
    )


def _cut_decimals(rows: Sequence[Sequence[str]]) -> bool:
    """Return whether whole numbers begin with 0, as the digits after a decimal comma do."""
    cells = [cell.strip() for row in rows for cell in row]
    return not any("." in cell for cell in cells) and any(_LEADING_ZERO.fullmatch(cell) for cell in cells)


def _with_decimals(path: AnyPath, plain: Dialect, cells: Sequence[str]) -> Dialect:
    """Return the dialect with the meaning of the commas inside the numbers.

    Raises:
        InputError: the commas may be decimal marks or mark thousands.
    """
    commas = [cell for cell in cells if "," in cell]
    decimal = [cell for cell in commas if _COMMA.fullmatch(cell) and not _GROUPS.fullmatch(cell)]
    dots = [cell for cell in commas if _DOT_GROUPS.fullmatch(cell)]
    groups = [cell for cell in commas if _GROUPS.fullmatch(cell)]
    surely_groups = [cell for cell in groups if "." in cell or cell.count(",") > 1]
    if (decimal or dots) and not surely_groups:
        return Dialect(plain.separator, plain.quoted, decimal_comma=True, thousands="." if dots else "")
    if surely_groups and not (decimal or dots):
        return Dialect(plain.separator, plain.quoted, decimal_comma=False, thousands=",")
    if groups and not surely_groups and not any(_WHOLE.fullmatch(cell) for cell in cells):
        return Dialect(plain.separator, plain.quoted, decimal_comma=True)
    if not groups:
        return plain
    example = (surely_groups or groups)[0]
    raise _doubt(path, f"its commas may be decimal marks or mark thousands, as in {example}")


def _doubt(path: AnyPath, why: str) -> InputError:
    return InputError(
        f"The numbers of the point cloud {path} cannot be read without doubt: {why}; try to export it with "
        "'.' as the decimal mark and without marks for thousands"
    )
