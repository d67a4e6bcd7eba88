"""Markdown from numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

Cell = str | float | int | None


def table(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """A table whose first column is text."""
    lines = [_line(header), _line(["---"] * len(header)), *(_line([cell(c) for c in row]) for row in rows)]
    return "\n".join(lines)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def cell(value: Cell) -> str:
    """A value of unknown kind: three significant digits, or all of a whole number."""
    if value is None:
        return "–"
    if isinstance(value, str):
        return value.replace("|", "\\|")
    if isinstance(value, int) or abs(value) >= 1000.0:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def percent(share: float | None, digits: int = 1) -> str:
    """A share from 0 to 1."""
    return "–" if share is None else f"{100.0 * share:.{digits}f} %"


def change(before: float | None, after: float | None, digits: int = 1) -> str:
    """How a share changed."""
    if before is None or after is None:
        return "–"
    return f"{100.0 * before:.{digits}f} → {percent(after, digits)}"


def exhibit(claim: dict[str, Any], title: str) -> str:
    """A claim's table whose title begins so, with title and note."""
    found = next(table for table in claim["tables"] if table["title"].startswith(title))
    return f"**{found['title']}**\n\n{table(found['header'], found['rows'])}\n\n{found['note']}".rstrip()
