"""Model of a tile of levels: which slot each bit of a pixel is coded with (SPEC 13), compiled.

A tile holds the index of each pixel's level, 0 where nothing was measured. Row after row, a pixel codes
whether it was measured, by which of six neighbours were; then its difference to the median edge detector's
prediction from the pixels to its left and above (JPEG-LS), by three things: how much these neighbours differ
among each other, how far their mean lies from the prediction (a flat, noisy surface is predicted best by a
mean, an edge by the detector), and whether the row rises or falls.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.delivery.arithmetic import (
    LONGEST,
    STOPPED,
    Coder,
    Mode,
    code_bit,
    code_digits,
    code_lower_digits,
    compiled,
    inlined,
)

Indices = NDArray[np.int32]

_ACTIVITIES, _OFFSETS, _TRENDS = 11, 7, 3
_CONTEXTS = _ACTIVITIES * _OFFSETS * _TRENDS
_LONE = _ACTIVITIES - 1
"""Activity of a pixel with one known neighbour."""
_FINE = 3
"""First binary digits whose slots depend on the whole context; those of later ones on the activity only."""
_DIFFERS = 64
_RISES = _DIFFERS + _CONTEXTS
_LONGER = _RISES + _CONTEXTS
_MUCH_LONGER = _LONGER + _FINE * _CONTEXTS
_SECOND_DIGIT = _MUCH_LONGER + LONGEST * _ACTIVITIES
SLOTS = _SECOND_DIGIT + LONGEST * _ACTIVITIES
"""Number of slots of the model: those of the mask first, then those of the values."""
MOST_WORDS_PER_PIXEL = 16
BROKEN = -1


@compiled
def code_tile(mode: Mode, coder: Coder, tile: Indices, level_count: int) -> int:
    """Code a tile: write it, or read it into ``tile``.

    Args:
        mode: ``WRITE`` or ``READ``.
        coder: writer, with ``MOST_WORDS_PER_PIXEL`` for each pixel, or reader; with ``SLOTS`` slots.
        tile: (h, w) indices of levels, from 1, 0 where nothing was measured; a reader writes them.
        level_count: number of the image's levels.

    Returns:
        The number of pixels coded, less than all if a reader's bytes end early; ``BROKEN`` if a reader finds
        a level that does not exist.
    """
    height, width = tile.shape
    digits = 0
    while level_count >> digits > 0:
        digits += 1
    last = 0
    for row in range(height):
        for column in range(width):
            slot = _mask_slot(tile, row, column)
            measured = code_bit(mode, coder, slot, tile[row, column] > 0)
            index = 0
            if measured:
                index = _code_index(mode, coder, tile, row, column, last, digits)
            if coder[STOPPED]:
                tile[row, column] = 0
                return row * width + column
            if measured and not 0 < index <= level_count:
                tile[row, column] = 0
                return BROKEN
            tile[row, column] = index
            last = index or last
    return height * width


@inlined
def _code_index(
    mode: Mode,
    coder: Coder,
    tile: Indices,
    row: int,
    column: int,
    last: int,
    digits: int,
) -> int:
    """Code the index of a measured pixel.

    Args:
        mode: and what follows, as for ``code_tile``.
        last: index of the measured pixel before it, 0 for none.
        digits: binary digits of an index without a prediction.
    """
    prediction, activity = _predict(tile, row, column, last)
    if prediction == 0:
        index = code_digits(mode, coder, digits, tile[row, column])
    else:
        context = _context(tile, row, column, prediction, activity)
        difference = tile[row, column] - prediction
        index = prediction
        if code_bit(mode, coder, _DIFFERS + context, difference != 0):
            rises = code_bit(mode, coder, _RISES + context, difference > 0)
            size = _code_size(mode, coder, context, activity, abs(difference))
            index = prediction + size if rises else prediction - size
    return index


@inlined
def _code_size(mode: Mode, coder: Coder, context: int, activity: int, size: int) -> int:
    """Code a difference's size, at least 1, as its number of binary digits and all but the first of them."""
    digits = 0
    longer = True
    while longer and digits < LONGEST:
        slot = _LONGER + _FINE * context + digits
        if digits >= _FINE:
            slot = _MUCH_LONGER + LONGEST * activity + digits
        longer = code_bit(mode, coder, slot, size >> (digits + 1) > 0)
        digits += longer
    return code_lower_digits(mode, coder, _SECOND_DIGIT + LONGEST * activity, digits, size)


@compiled
def _mask_slot(tile: Indices, row: int, column: int) -> int:
    """Return which of six neighbours were measured, as a number; beyond the tile the nearest one counts."""
    left, above = _at(tile, row, column - 1) > 0, _at(tile, row - 1, column) > 0
    far_left = _at(tile, row, column - 2) > 0 if column > 1 else left
    far_above = _at(tile, row - 2, column) > 0 if row > 1 else above
    above_left, above_right = _at(tile, row - 1, column - 1) > 0, _at(tile, row - 1, column + 1) > 0
    return left + 2 * above + 4 * above_left + 8 * above_right + 16 * far_left + 32 * far_above


@compiled
def _predict(tile: Indices, row: int, column: int, last: int) -> tuple[int, int]:
    """Return the predicted index, 0 for none, and the neighbours' activity in eleven classes."""
    left, above = _at(tile, row, column - 1), _at(tile, row - 1, column)
    corner, right = _at(tile, row - 1, column - 1), _at(tile, row - 1, column + 1)
    if left > 0 and above > 0:
        if corner == 0:
            return (left + above) // 2, _activity(2 * abs(left - above))
        differences = abs(left - corner) + abs(above - corner) + (abs(right - above) if right > 0 else 0)
        low, high = min(left, above), max(left, above)
        if corner >= high:
            return low, _activity(differences)
        if corner <= low:
            return high, _activity(differences)
        return left + above - corner, _activity(differences)
    for neighbour in (left, above, corner, right, last):
        if neighbour > 0:
            return neighbour, _LONE
    return 0, _LONE


@compiled
def _activity(differences: int) -> int:
    """Return the class, 0 to 9, of a sum of differences."""
    if differences < 4:
        return differences
    for step, limit in enumerate((6, 9, 15, 31, 81)):
        if differences < limit:
            return 4 + step
    return 9


@compiled
def _context(tile: Indices, row: int, column: int, prediction: int, activity: int) -> int:
    """Return the number of the context of a pixel's difference to the prediction."""
    left, above = _at(tile, row, column - 1), _at(tile, row - 1, column)
    far_left, right = _at(tile, row, column - 2), _at(tile, row - 1, column + 1)
    trend = 0
    if left > 0 and far_left > 0 and left != far_left:
        trend = 1 if left > far_left else 2
    left, above = left or prediction, above or prediction
    offset = left + (far_left or left) + above + (right or above) - 4 * prediction
    size = abs(offset)
    step = int(size >= 1) + int(size >= 3) + int(size >= 6)
    signed = step if offset >= 0 else _OFFSETS - step
    return (activity * _OFFSETS + signed) * _TRENDS + trend


@inlined
def _at(tile: Indices, row: int, column: int) -> int:
    """Return the index at a pixel that is already coded; 0 outside the tile."""
    if row < 0 or column < 0 or column >= tile.shape[1]:
        return 0
    return tile[row, column]
