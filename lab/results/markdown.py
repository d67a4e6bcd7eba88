"""Markdown tables and text from numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

Cell = str | float | int | None
Row = dict[str, Any]


def table(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """Return a table; cells that are not text yet are formatted by ``text``."""
    lines = [header, ["---"] * len(header), *([text(cell) for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def text(value: Cell) -> str:
    """Return a value as text: three significant digits; integers and values from 999.5 without decimals."""
    if value is None:
        return "–"
    if isinstance(value, str):
        return value.replace("|", "\\|")
    if isinstance(value, int) or abs(value) >= 999.5:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def percent(share: float | None, digits: int = 1) -> str:
    """Return a share from 0 to 1 in per cent; a dash for None."""
    return "–" if share is None else f"{100.0 * share:.{digits}f} %"


def change(before: float | None, after: float | None) -> str:
    """Return two values of a share from 0 to 1 as "12.3 → 45.6 %"; a dash if one is None."""
    return "–" if before is None or after is None else f"{100.0 * before:.1f} → {percent(after)}"


def listed(words: Sequence[str]) -> str:
    """Return words listed as in a sentence; "none" without any."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:]))) or "none"


def pivot(runs: Sequence[Row], row: str, columns: Sequence[str], write: Callable[[Row], str]) -> str:
    """Return a table with a row per value of ``row`` and a column per combination of ``columns``.

    ``write`` returns the text of a run's cell; a combination without a run gets a dash.
    """
    names = list(dict.fromkeys(run[row] for run in runs))
    groups = list(dict.fromkeys(tuple(run[column] for column in columns) for run in runs))
    found = {(run[row], tuple(run[column] for column in columns)): write(run) for run in runs}
    return table(
        (row, *(": ".join(group) for group in groups)),
        ((name, *(found.get((name, group)) for group in groups)) for name in names),
    )


def exhibit(claim: Row, title: str) -> str:
    """Return the first table of a claim whose title begins with ``title``, with its title and note."""
    found = next(table for table in claim["tables"] if table["title"].startswith(title))
    parts = (f"**{found['title']}**", table(found["header"], found["rows"]), found["note"])
    return "\n\n".join(filter(None, parts))
