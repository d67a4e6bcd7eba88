"""Adaptive binary arithmetic coding, compiled: the same function writes and reads.

A coder holds an interval of numbers below 2 ** 48 and narrows it by each bit's chance; ones are the lower
part. Whenever it is shorter than 2 ** 32 it writes the leading 16 bits of its lower end as a word, to which a
later carry may still add one; at the end the words become bytes. A reader does not know the bytes after the
end of its stream: it keeps the least and the greatest number that they could give, and stops at the first
bit that depends on them. So a stream that was cut gives all bits that its bytes determine, and none that is
wrong.

A model is written once, with ``code_bit`` and its companions: a writer passes the bits and gets them back, a
reader passes anything and gets the bits of the stream.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from pipeline.types import ByteArray

LOW, LENGTH, LEAST, MOST, POSITION, STOPPED, MEMORY = range(7)
"""Indices of a coder's (7,) int64 state: lower end and length of the interval, least and greatest distance
from the lower end that a reader's bytes can give, words written or bytes read, whether a reader stopped for
lack of bytes, and the sum of a slot's counts above which they are halved."""
WRITE, READ = True, None
"""Modes. Numba compiles each function for each of them, without the branches of the other; it does so only
for ``is None``, and a branch at run time would make a bit four times as slow."""
Mode = bool | None
_BYTES = 6
_ALL_BITS = (1 << 48) - 1
_SHORT = 1 << 32
ONE = 65_536
"""The chance of a bit that is certain."""
_LEAST_CHANCE = 64
"""Of either bit: no bit costs more than ten bits."""
BIT = 256
"""What a bit adds to the count of its kind."""
TRUST = 8
"""Bits that the counts of a table are worth at the beginning."""
_MEMORY = 40 * BIT
LONGEST = 17
"""Most binary digits of a number after its first."""

Counts = NDArray[np.int64]
"""(S, 2) weight of the zeros and the ones that each slot has seen; a slot's chance is the share of ones."""
Coder = NDArray[np.int64]
Words = NDArray[np.int64]
"""(W,) words that a writer writes after the first, each of 16 bits but for its carry."""
Stream = ByteArray | Words
"""What a reader reads, or a writer writes."""


def compiled(function: Any) -> Any:
    """Compile a function with numba; it is kept on disk and runs beside other threads."""
    return numba.njit(cache=True, nogil=True, error_model="numpy")(function)


def inlined(function: Any) -> Any:
    """Compile a function as part of each caller: numba counts references to arrays at a call, which takes
    longer than what the function does.
    """
    return numba.njit(inline="always", error_model="numpy")(function)


def counts_of(chances: NDArray[np.integer], trust: int = TRUST) -> Counts:
    """Return counts that start at these chances.

    Args:
        chances: (S,) chances of a one, 0 to ``ONE``.
        trust: number of bits that they count as.
    """
    ones = np.clip(chances.astype(np.int64), 1, ONE - 1) * (trust * BIT) // ONE
    return np.stack([trust * BIT - ones, ones], axis=1)


@compiled
def writer() -> Coder:
    """Return the state of a coder that writes a new stream."""
    coder = np.zeros(7, np.int64)
    coder[LENGTH] = _ALL_BITS + 1
    coder[MEMORY] = _MEMORY
    return coder


@compiled
def reader(stream: ByteArray) -> Coder:
    """Return the state of a coder that reads the (B,) bytes of a stream, or the first of them."""
    coder = writer()
    for position in range(_BYTES):
        known = position < stream.size
        coder[LEAST] = coder[LEAST] << 8 | (stream[position] if known else 0)
        coder[MOST] = coder[MOST] << 8 | (stream[position] if known else 255)
    coder[POSITION] = _BYTES
    return coder


@compiled
def code_bit(mode: Mode, coder: Coder, stream: Stream, counts: Counts, slot: int, bit: bool) -> bool:
    """Code a bit by the chance of a slot, and count it there."""
    zeros, ones = counts[slot, 0], counts[slot, 1]
    chance = min(max(ones * ONE // (zeros + ones), _LEAST_CHANCE), ONE - _LEAST_CHANCE)
    bit = _code(mode, coder, stream, chance, bit)
    if zeros + ones > coder[MEMORY]:
        zeros, ones = (zeros + 1) // 2, (ones + 1) // 2
    counts[slot, 0], counts[slot, 1] = (zeros, ones + BIT) if bit else (zeros + BIT, ones)
    return bit


@inlined
def code_digits(mode: Mode, coder: Coder, stream: Stream, count: int, number: int) -> int:
    """Code the lowest ``count`` binary digits of a number, highest first, ones and zeros equally likely."""
    coded = 0
    for place in range(count - 1, -1, -1):
        coded = coded << 1 | _code(mode, coder, stream, ONE // 2, (number >> place) & 1 == 1)
    return coded


@compiled
def code_number(mode: Mode, coder: Coder, stream: Stream, counts: Counts, slot: int, number: int) -> int:
    """Code a number from 1 to 2 ** 18 - 1 as Elias' gamma code, in the ``2 * LONGEST`` slots from ``slot``.

    Slots of the first half tell whether the number has more digits, those of the second its second digit.
    """
    digits = 0
    while digits < LONGEST and code_bit(
        mode, coder, stream, counts, slot + digits, number >> (digits + 1) > 0
    ):
        digits += 1
    return code_lower_digits(mode, coder, stream, counts, slot + LONGEST, digits, number)


@inlined
def code_lower_digits(
    mode: Mode, coder: Coder, stream: Stream, counts: Counts, slot: int, digits: int, number: int
) -> int:
    """Code the ``digits`` digits after a number's first, the highest in slot ``slot + digits - 1``."""
    coded = 1
    if digits > 0:
        second = code_bit(mode, coder, stream, counts, slot + digits - 1, (number >> (digits - 1)) & 1 == 1)
        coded = (2 | second) << (digits - 1) | code_digits(mode, coder, stream, digits - 1, number)
    return coded


@compiled
def finish(coder: Coder, words: Words) -> ByteArray:
    """Return the (B,) bytes of the words, and the fewest after them that determine all bits."""
    for count in range(_BYTES + 1):
        unknown = _ALL_BITS >> (8 * count)
        number = (coder[LOW] + unknown) & ~unknown
        if number + unknown < coder[LOW] + coder[LENGTH]:
            break
    size = 2 * coder[POSITION] + count
    stream = np.empty(size, np.uint8)
    for place in range(count):
        stream[size - count + place] = (number >> (40 - 8 * place)) & 255
    carry = number >> 48
    for place in range(coder[POSITION], 0, -1):
        word = words[place] + carry
        stream[2 * place - 2], stream[2 * place - 1] = (word >> 8) & 255, word & 255
        carry = word >> 16
    return stream


@compiled
def _code(mode: Mode, coder: Coder, stream: Stream, chance: int, bit: bool) -> bool:
    """Code a bit whose chance of being a one is ``chance`` of ``ONE``."""
    length, position = coder[LENGTH], coder[POSITION]
    bound = (length >> 16) * chance
    if mode is None:
        bit = coder[MOST] < bound
        coder[STOPPED] |= bit != (coder[LEAST] < bound)
    length = bound if bit else length - bound
    skipped = 0 if bit else bound
    short = length < _SHORT
    coder[LENGTH] = length << 16 if short else length
    if mode is None:
        least, most = coder[LEAST] - skipped, coder[MOST] - skipped
        if short:
            for _ in range(2):
                known = position < stream.size
                least = least << 8 | (stream[position] if known else 0)
                most = most << 8 | (stream[position] if known else 255)
                position += 1
        coder[LEAST], coder[MOST] = least, most
    else:
        low = coder[LOW] + skipped
        stream[position] += low >> 48
        stream[position + 1] = (low & _ALL_BITS) >> 32
        coder[LOW] = (low << 16 if short else low) & _ALL_BITS
        position += short
    coder[POSITION] = position
    return bit
