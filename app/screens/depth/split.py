"""Two pictures of the same view in one, divided by a vertical line."""

from __future__ import annotations

from pipeline.types import ByteArray

LINE_PX = 3


def split(left: ByteArray, right: ByteArray, share: float) -> ByteArray:
    """One picture left of the line, the other right of it.

    Args:
        left: (H, W, 3) RGB.
        right: (H, W, 3) RGB.
        share: of the width that shows ``left``, 0 to 1; at both ends there is no line.

    Returns:
        (H, W, 3), with a white line edged in black.
    """
    width = left.shape[1]
    column = round(share * width)
    rgb = right.copy()
    rgb[:, :column] = left[:, :column]
    if 0 < column < width:
        start = min(max(0, column - 1), max(0, width - LINE_PX))
        rgb[:, start : start + LINE_PX] = 0
        rgb[:, column : column + 1] = 255
    return rgb
