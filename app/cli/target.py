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
    dictionary: str = "",
    tag_spacing: float = 0.3,
    pixel_mm: float | None = None,
) -> None:
    """Draw a calibration board true to scale, with a ruler to check the print.

    Args:
        out: A .pdf or .svg file to print at 100 %, or a .png to show on a monitor without scaling.
        pattern: Circles in rows, circles in shifted rows, a chessboard, a chessboard with markers, or
            Kalibr's grid of AprilTags.
        columns: Circles, inner corners or AprilTags in a row.
        rows: Number of rows.
        spacing_mm: Pitch of the circles, or side of a square or of an AprilTag; half the pitch in a row if
            rows are shifted.
        dictionary: Dictionary of a ChArUco board's markers, such as 4X4_50; 5X5_1000 without it.
        tag_spacing: AprilGrid: the gap between two tags, divided by the side of a tag.
        pixel_mm: Pixel pitch of the monitor in mm: its width in mm divided by its width in pixels.
    """
    from pipeline.calibration.board import Board
    from pipeline.calibration.target import write_target

    board = Board(pattern, columns, rows, spacing_mm / 1000.0, dictionary, tag_spacing)
    board = write_target(board, out, pixel_mm)
    say(f"{out}: {board.title}")
    if pixel_mm is not None:
        gap = f" --tag-spacing {board.tag_spacing:.6g}" if board.pattern == "aprilgrid" else ""
        say(f"Show it without scaling, and calibrate with --spacing-mm {1000.0 * board.spacing_m:.6g}{gap}")
    if board.pattern == "chessboard" and board.ambiguous:
        say(
            "The board looks the same upside down; for several cameras add one column, so that they "
            "agree on its orientation"
        )
