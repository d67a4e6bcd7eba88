"""Placement of the cameras' name labels without overlaps."""

from __future__ import annotations

import numpy as np

from pipeline.types import FloatArray, IntArray

LETTER_PX, LINE_PX = 6.2, 20.0
"""Width of a letter in a label on the screen, and height of the label."""


def lifts(at_px: FloatArray, letters: IntArray, fixed: int) -> FloatArray:
    """Return how far labels must move in one direction, up or down, so that none overlaps another.

    Args:
        at_px: (N, 2) middle of each label's edge: to the right, and along the direction of the move.
        letters: (N,) number of letters of each label.
        fixed: number of labels at the start that do not move.

    Returns:
        (N - fixed,) moves of the other labels, px; at least 0.
    """
    widths_px = LETTER_PX * letters
    from_px, at_px = at_px, at_px.copy()
    placed = list(range(fixed))
    for row in sorted(range(fixed, len(at_px)), key=lambda one: float(at_px[one, 1])):
        for other in sorted(placed, key=lambda one: float(at_px[one, 1])):
            apart_px = np.abs(at_px[row] - at_px[other])
            if apart_px[0] < 0.5 * (widths_px[row] + widths_px[other]) and apart_px[1] < LINE_PX:
                at_px[row, 1] = at_px[other, 1] + LINE_PX
        placed.append(row)
    lifted_px: FloatArray = at_px[fixed:, 1] - from_px[fixed:, 1]
    return lifted_px
