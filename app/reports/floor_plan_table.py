"""Right column of a floor plan: the table of positions, the scale bar and the meaning of the colours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from app.reports.paper import Area, Color, Line, Shape, Words, box
from pipeline.types import FloatArray

TABLE_MM = 92.0
ROW_MM = 4.4
MOST_PRESENT = 6
"""Most present cameras in the table."""
LONGEST_BAR_MM = 60.0
INK, SOFT = (20, 24, 28), (90, 100, 110)
HEADINGS = ("camera", "x", "y", "height", "pan", "tilt", "on")
ENDS_MM = (0.0, 28.0, 39.0, 53.0, 64.0, 75.0, 77.5)
"""Left ends of the first and last column, right ends of those with numbers."""
NOTES = (
    "x, y and height of the lens in metres, height above the floor. Pan: from the",
    "x axis, counter-clockwise from above. Tilt: below 0° the camera looks down.",
)


def table(
    rows: Sequence[Sequence[str]], new: int, sink_m: FloatArray, left_mm: float, top_mm: float
) -> tuple[list[Shape], float]:
    """Draw the positions.

    Args:
        rows: cells of each camera, the new ones first.
        new: number of new cameras.
        sink_m: (2,) x and y of the sink.
        left_mm: left end on the paper.
        top_mm: upper end.

    Returns:
        The shapes, and the height on the paper below them.
    """
    shown = [*rows[: new + MOST_PRESENT], ("sink", *(f"{value + 0.0:.2f}" for value in sink_m))]
    shapes: list[Shape] = [*_line(HEADINGS, left_mm, top_mm + 3.0, INK, bold=True)]
    base_mm = top_mm + 3.0
    for number, row in enumerate(shown):
        if number in (0, new, len(shown) - 1):
            at_mm = base_mm + 1.4
            ends_mm = np.array([[left_mm, at_mm], [left_mm + TABLE_MM, at_mm]])
            shapes.append(Line(ends_mm, SOFT, 0.15))
        base_mm += ROW_MM
        shapes += _line(row, left_mm, base_mm, INK if number < new else SOFT, bold=False)
    left_out = len(rows) - new - MOST_PRESENT
    notes = NOTES if left_out <= 0 else (*NOTES, f"{left_out} more present cameras are only drawn.")
    base_mm += 2.0
    for note in notes:
        base_mm += 3.6
        shapes.append(Words(left_mm, base_mm, note, 2.5, SOFT))
    return shapes, base_mm


def _line(cells: Sequence[str], left_mm: float, base_mm: float, color: Color, bold: bool) -> Iterator[Words]:
    for column, (cell, end_mm) in enumerate(zip(cells, ENDS_MM, strict=False)):
        anchor = "start" if column in (0, len(ENDS_MM) - 1) else "end"
        yield Words(left_mm + end_mm, base_mm, cell, 2.8, color, anchor, bold)  # type: ignore[arg-type]


def legend(
    meanings: Sequence[tuple[str, Color]], scale: int, left_mm: float, top_mm: float
) -> Iterator[Shape]:
    """Yield the scale bar, and a patch of each colour with its meaning."""
    lengths_m = [first * 10.0**power for power in range(-1, 6) for first in (1, 2, 5)]
    length_m = max(one for one in lengths_m if 1000.0 * one / scale <= LONGEST_BAR_MM)
    length_mm, base_mm = 1000.0 * length_m / scale, top_mm + 11.0
    half_mm = 0.5 * length_mm
    yield Area((box(left_mm, base_mm - 1.6, left_mm + half_mm, base_mm),), INK)
    yield Area(
        (box(left_mm + half_mm, base_mm - 1.6, left_mm + length_mm, base_mm),), (255, 255, 255), 1.0, INK
    )
    yield Words(left_mm, base_mm - 2.6, "0", 2.6, INK)
    yield Words(left_mm + length_mm, base_mm - 2.6, f"{length_m:g} m", 2.6, INK, "middle")
    yield Words(
        left_mm,
        base_mm + 4.2,
        f"This bar is {length_mm:g} mm long if the scale of the print is right.",
        2.5,
        SOFT,
    )
    base_mm += 6.0
    for meaning, color in meanings:
        base_mm += 4.6
        yield Area((box(left_mm, base_mm - 2.6, left_mm + 4.0, base_mm + 0.2),), color)
        yield Words(left_mm + 6.0, base_mm, meaning, 2.7, INK)
