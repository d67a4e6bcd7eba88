"""RVL, a lossless coding of depth images (A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017).

Values are read in raster order as alternating runs of zeros and of other values. Each run's length is
written and, for other values, the difference to the last nonzero value (initially 0), with its sign in the
lowest bit (0, -1, 1, -2, 2, ... become 0, 1, 2, 3, 4, ...). Every number is split into groups of three
bits, lowest first; a group and a bit that says whether more follow form a nibble. The paper fills 32-bit
words from the top; filling bytes, as here, is the same with less padding.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.types import ByteArray

_BROKEN = -1
_MOST_BITS = 18  # six nibbles: a difference has 17 bits
_RUN_BITS = 30


def encode(values: NDArray[np.uint16]) -> bytes:
    """Encode depths as an RVL stream, in the order of memory.

    Args:
        values: (...) depths in integer units, 0 where unknown.
    """
    row = np.ascontiguousarray(values, np.uint16).ravel()
    stream = np.zeros(4 * row.size + 16, np.uint8)
    return stream[: _encode(row, stream)].tobytes()


def decode(stream: ByteArray, count: int) -> NDArray[np.uint16]:
    """Decode the (count,) values of a complete stream.

    Raises:
        InputError: the stream does not have exactly that many values.
    """
    values, used_bytes = _read(stream, count)
    if len(values) < count or used_bytes != len(stream):
        raise _broken(stream, count)
    return values


def decode_start(stream: ByteArray, count: int) -> NDArray[np.uint16]:
    """Decode the (n,) values in the first bytes of a stream of ``count`` values, 0 <= n <= ``count``.

    Raises:
        InputError: no stream of that many values starts like this.
    """
    return _read(stream, count)[0]


def _read(stream: ByteArray, count: int) -> tuple[NDArray[np.uint16], int]:
    values = np.zeros(count, np.uint16)
    known, used_nibbles = _decode(np.ascontiguousarray(stream, np.uint8), values)
    if known == _BROKEN:
        raise _broken(stream, count)
    return values[:known], (used_nibbles + 1) // 2


def _broken(stream: ByteArray, count: int) -> InputError:
    return InputError(
        f"The {len(stream)} bytes are no RVL stream of {count} depths: a run or a value does not fit, "
        "or the end is missing; try to receive them again"
    )


def _compiled(function: Any) -> Any:
    return numba.njit(cache=True, nogil=True)(function)


@_compiled
def _encode(row: NDArray[np.uint16], stream: ByteArray) -> int:
    """Encode into ``stream``, which must be zero; returns the number of bytes."""
    nibbles = 0
    previous = 0
    index = 0
    while index < row.size:
        start = index
        while index < row.size and row[index] == 0:
            index += 1
        nibbles = _put(stream, nibbles, index - start)
        start = index
        while index < row.size and row[index] != 0:
            index += 1
        nibbles = _put(stream, nibbles, index - start)
        for position in range(start, index):
            difference = int(row[position]) - previous
            previous = int(row[position])
            nibbles = _put(stream, nibbles, (difference << 1) ^ (difference >> 63))
    return (nibbles + 1) // 2


@_compiled
def _put(stream: ByteArray, nibbles: int, number: int) -> int:
    """Write a number after ``nibbles`` nibbles; returns the new number of nibbles."""
    while True:
        nibble = number & 7
        number >>= 3
        if number:
            nibble |= 8
        stream[nibbles >> 1] |= nibble if nibbles & 1 else nibble << 4
        nibbles += 1
        if not number:
            return nibbles


@_compiled
def _decode(stream: ByteArray, values: NDArray[np.uint16]) -> tuple[int, int]:
    """Decode into ``values``, which must be zero; returns the count (or ``_BROKEN``) and the nibbles read."""
    previous = 0
    index = 0
    nibbles = 0
    while index < values.size:
        zeros, nibbles = _get(stream, nibbles, _RUN_BITS)
        if zeros > values.size - index:
            return _BROKEN, nibbles
        if zeros < 0:
            return (index if zeros == -1 else _BROKEN), nibbles
        index += zeros
        others, nibbles = _get(stream, nibbles, _RUN_BITS)
        if others > values.size - index or (others == 0 and index < values.size):
            return _BROKEN, nibbles
        if others < 0:
            return (index if others == -1 else _BROKEN), nibbles
        for _ in range(others):
            number, nibbles = _get(stream, nibbles, _MOST_BITS)
            if number < 0:
                return (index if number == -1 else _BROKEN), nibbles
            previous += (number >> 1) ^ -(number & 1)
            if not 0 < previous <= 65535:
                return _BROKEN, nibbles
            values[index] = previous
            index += 1
    return index, nibbles


@_compiled
def _get(stream: ByteArray, nibbles: int, most_bits: int) -> tuple[int, int]:
    """Read the number after ``nibbles`` nibbles; -1 if the stream ends within it, -2 if it is too long.

    If the stream ends within a number, the returned position is one nibble beyond the end.
    """
    number = 0
    shift = 0
    while nibbles < 2 * stream.size:
        if shift >= most_bits:
            return -2, nibbles
        byte = stream[nibbles >> 1]
        nibble = int(byte & 15 if nibbles & 1 else byte >> 4)
        nibbles += 1
        number |= (nibble & 7) << shift
        if nibble < 8:
            return number, nibbles
        shift += 3
    return -1, nibbles + 1
