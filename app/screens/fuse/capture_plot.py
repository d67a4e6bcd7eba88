"""The capture-range map as a grid of buttons: green where a method arrives, red where it does not."""

from __future__ import annotations

from app.screens.fuse.view import CAPTURE_SHIFTS_M, CAPTURE_TURNS_DEG, SUCCESS_M, CaptureView
from app.tables import number

REACHED, MISSED = "#bfe6d6", "#f3cdc8"
_PRESS = (
    "[...document.querySelectorAll('button')].find(b => b.textContent === this.dataset.cell && b !== this)"
    "?.click()"
)
"""Presses the panel's own button of the same name, as HTML cannot talk to the server by itself."""


def cell_name(turn_deg: float, shift_m: float) -> str:
    """Name of a start of the map."""
    return f"{turn_deg:.0f}° {100 * shift_m:.0f} cm"


def capture_html(view: CaptureView, lane: int) -> str:
    """Rows of rotations, columns of translations; each cell says how far from the truth it ends."""
    heads = "".join(f"<th>{100 * shift_m:.0f} cm</th>" for shift_m in CAPTURE_SHIFTS_M)
    lines = [f"<tr><th></th>{heads}</tr>"]
    for row, turn_deg in enumerate(CAPTURE_TURNS_DEG):
        cells = "".join(
            _cell(cell_name(turn_deg, shift_m), float(view.errors_m[lane, row, column]))
            for column, shift_m in enumerate(CAPTURE_SHIFTS_M)
        )
        lines.append(f"<tr><th>{turn_deg:.0f}°</th>{cells}</tr>")
    return (
        "<div style='padding: 0 0.8em 0.5em; font-size: 12px'>"
        f"{capture_sentence(view)} Cells of <b>{view.labels[lane]}</b>: end error in cm; press one to race "
        "from there."
        f"<table style='width: 100%; border-spacing: 2px; table-layout: fixed'>{''.join(lines)}</table></div>"
    )


def capture_sentence(view: CaptureView) -> str:
    """How many starts every method arrives from."""
    counts = (view.errors_m < SUCCESS_M).sum(axis=(1, 2))
    starts = view.errors_m[0].size
    reached = ", ".join(f"{label} {count}" for label, count in zip(view.labels, counts, strict=True))
    return f"Of {starts} starts, so many end within {100 * SUCCESS_M:.0f} cm: {reached}."


def _cell(name: str, error_m: float) -> str:
    arrived = error_m < SUCCESS_M
    look = (
        f"width: 100%; padding: 3px 0; border: 1px solid #999; border-radius: 3px; cursor: pointer; "
        f"color: #222; font-size: 12px; background: {REACHED if arrived else MISSED}"
    )
    text = f"{'✓' if arrived else '✗'} {number(error_m, 1 if error_m < 0.1 else 0, scale=100.0)}"
    return (
        f'<td><button data-cell="{name}" title="{name}: ends {number(error_m, 1, "cm", 100.0)} off" '
        f'style="{look}" onclick="{_PRESS}">{text}</button></td>'
    )
