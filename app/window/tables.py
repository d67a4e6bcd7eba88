"""HTML of small tables of numbers, in which a click on a name shows its explanation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeAlias

from app.compute.records import ColorBar, MeshView
from app.drawing.colors import css
from app.web.markup import Markup

_CELL = "padding: 2px 8px 2px 0; vertical-align: top;"
_VALUE = Markup('<td style="{} text-align: right; font-variant-numeric: tabular-nums">{}</td>')

WAITING, UNKNOWN = "…", "–"
"""Texts for a value that is not computed yet, and for one that is unknown."""

Row: TypeAlias = tuple[str, ...]
"""One quantity: its name, its explanation in a sentence, and for each column its value with the unit."""
Head: TypeAlias = str | tuple[str, str]
"""A column's head, or the head and its explanation in a sentence."""

TRUTH_ROWS = (
    (
        "F-score 5 cm",
        "Harmonic mean of coverage and accuracy within 5 cm of the true surface.",
        "f_score_5cm",
        "%",
    ),
    (
        "Depth error",
        "Median depth error of the rays that hit, against the truth.",
        "median_depth_error_m",
        "mm",
    ),
)
"""Comparison with the true surface: name, explanation, key in ``MeshView.truth``, and unit."""
PER_UNIT = {"%": 100.0, "mm": 1000.0}
"""Factors from the stored values (shares, metres) to the units shown."""


def term(name: str, hint: str) -> Markup:
    """Return HTML of a word whose explanation opens on a click (``hint.js``)."""
    return Markup('<button type="button" class="packetmesh-term" data-hint="{}">{}</button>').format(
        hint, name
    )


def table(
    rows: Sequence[Row], columns: Sequence[Head] = (), colors: Sequence[tuple[int, int, int]] = ()
) -> Markup:
    """Return HTML of rows of numbers; ``columns`` are heads of the values, in ``colors`` (RGB) if given."""
    lines = []
    if columns:
        names = [one if isinstance(one, str) else term(*one) for one in columns]
        inks = [f" color: {css(color)};" for color in colors] or [""] * len(names)
        heads = _joined(
            Markup('<th style="{} text-align: right;{}">{}</th>').format(_CELL, ink, name)
            for name, ink in zip(names, inks, strict=True)
        )
        lines.append(Markup("<tr><th></th>{}</tr>").format(heads))
    for name, hint, *values in rows:
        cells = _joined(_VALUE.format(_CELL, value) for value in values)
        text = term(name, hint)
        lines.append(Markup('<tr><td style="{}">{}</td>{}</tr>').format(_CELL, text, cells))
    return Markup(
        '<div class="packetmesh-numbers" '
        'style="padding: 0 0.8em 0.8em 0.8em; font-size: 13px; overflow-x: auto">'
        '<table style="border-collapse: collapse; width: 100%">{}</table></div>'
    ).format(_joined(lines))


def bar_html(bar: ColorBar) -> Markup:
    """Return HTML of a colour bar over its labels."""
    gradient = ", ".join(css(stop) for stop in bar.stops)
    ends = _joined(Markup("<span>{}</span>").format(label) for label in bar.labels)
    return Markup(
        '<div style="height: 0.7em; background: linear-gradient(to right, {}); border-radius: 2px; '
        'margin-top: 0.3em"></div><div style="display: flex; justify-content: space-between">{}</div>'
    ).format(gradient, ends)


def command_html(command: str) -> Markup:
    """Return HTML of a command line that one click selects or copies (``page.js``)."""
    look = (
        "margin: 0; padding: 0.8em; white-space: pre-wrap; overflow-wrap: anywhere; font-size: 12px; "
        "user-select: all; border: 1px solid #bbb; border-radius: 4px"
    )
    return Markup(
        '<div style="padding: 0 0.8em 0.8em 0.8em"><pre style="{}">{}</pre>'
        '<button style="margin-top: 0.5em; padding: 0.2em 1em" data-packetmesh-copy>Copy</button></div>'
    ).format(look, command)


def _joined(parts: Iterable[str]) -> Markup:
    return Markup("").join(parts)


def number(value: float | None, digits: int = 1, unit: str = "", scale: float = 1.0) -> str:
    """Return a value times ``scale`` with its unit; a dash if it is unknown (None or NaN)."""
    if value is None or value != value:
        return UNKNOWN
    return f"{value * scale:,.{digits}f}{unit and ' '}{unit}"


def truth_rows(meshes: Sequence[MeshView | None], missing: str = WAITING) -> list[Row]:
    """Return the rows that compare surfaces with the true one; ``missing`` stands for a missing surface."""

    def value(mesh: MeshView | None, key: str, unit: str) -> str:
        if mesh is None:
            return missing
        return WAITING if mesh.truth is None else number(mesh.truth.get(key), 1, unit, PER_UNIT[unit])

    return [
        (name, hint, *(value(mesh, key, unit) for mesh in meshes)) for name, hint, key, unit in TRUTH_ROWS
    ]
