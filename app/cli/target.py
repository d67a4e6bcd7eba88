"""``packetmesh target``: a calibration board to print."""

from __future__ import annotations

from pathlib import Path

from app.cli.text import say
from pipeline.config import Pattern


def target(
    out: Path,
    pattern: Pattern = "circles",
    columns: int = 11,
    rows: int = 9,
    spacing_mm: float = 35.0,
    pixel_mm: float | None = None,
) -> None:
    """Draw a calibration board true to scale, with a ruler to check the print.

    Args:
        out: A .pdf or .svg file to print at 100 %, or a .png to show in full size on a monitor.
        pattern: Circles in rows, circles in shifted rows, a chessboard, or a chessboard with markers.
        columns: Circles, or inner corners, in a row.
        rows: How many rows of them.
        spacing_mm: Pitch of the circles, or side of a square; half the pitch in a row if rows are shifted.
        pixel_mm: Side of the monitor's pixels: its width in mm over its width in pixels.
    """
    from pipeline.calibration.board import Board
    from pipeline.calibration.target import write_target

    board = write_target(Board(pattern, columns, rows, spacing_mm / 1000.0), out, pixel_mm)
    say(f"{out}: {board.title}")
    if pixel_mm is not None:
        say(f"Show it pixel by pixel; it is calibrated with --spacing-mm {1000.0 * board.spacing_m:.6g}")
    if board.pattern == "chessboard" and board.ambiguous:
        say(
            "It looks the same upside down; with one column more, several cameras would agree which way is up"
        )
