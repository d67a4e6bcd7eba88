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

import numba
import numpy as np
from numpy.typing import NDArray

from pipeline.types import ByteArray

LOW, LENGTH, LEAST, MOST, POSITION, STOPPED, MEMORY, BODY = range(8)
"""Places in a coder's state: lower end and length of the interval, least and greatest distance from the lower
end that a reader's bytes can give, place of the next word or byte, whether a reader stopped for lack of
bytes, the sum of a slot's counts above which they are halved, and the place of the first word or byte."""
COUNTS = 8
"""Place of the first slot's counts, which end where the body begins."""
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

Coder = NDArray[np.int64]
"""(N,) one array with all of a coder's state: the places above, then for each slot the weights of the zeros
and the ones that it has seen (its chance is the share of ones), then a writer's words, each of 16 bits but
for its carry, or a reader's bytes."""


compiled = numba.njit(cache=True, nogil=True, error_model="numpy", _nrt=False)  # type: ignore[call-overload]
"""Compile once, with caching, without the interpreter's lock and without counts of the references to arrays,
which take longer than what a function does here; such a function creates no array."""
compiled_with_arrays = numba.njit(cache=True, nogil=True, error_model="numpy")
"""The same for functions that create arrays."""
inlined = numba.njit(inline="always", error_model="numpy")
"""Compile a function as a part of each of its callers."""


def counts_of(chances: NDArray[np.integer], trust: int = TRUST) -> NDArray[np.int64]:
    """Return (2 S,) counts that start at these chances.

    Args:
        chances: (S,) chances of a one, 0 to ``ONE``.
        trust: number of bits that they count as.
    """
    ones = np.clip(chances.astype(np.int64), 1, ONE - 1) * (trust * BIT) // ONE
    return np.stack([trust * BIT - ones, ones], axis=1).ravel()


@compiled_with_arrays
def writer(counts: NDArray[np.int64], most_words: int) -> Coder:
    """Return a coder that writes a new stream of at most so many words."""
    body = COUNTS + counts.size
    coder = np.empty(body + most_words + 2, np.int64)
    coder[:COUNTS] = 0
    coder[LENGTH] = _ALL_BITS + 1
    coder[MEMORY] = _MEMORY
    coder[BODY] = coder[POSITION] = body
    coder[COUNTS:body] = counts
    return coder


@compiled_with_arrays
def reader(counts: NDArray[np.int64], stream: ByteArray) -> Coder:
    """Return a coder that reads the (B,) bytes of a stream, or the first of them."""
    body = COUNTS + counts.size
    coder = np.empty(body + stream.size, np.int64)
    coder[:body] = writer(counts, 0)[:body]
    coder[body:] = stream
    for position in range(body, body + _BYTES):
        known = position < coder.size
        coder[LEAST] = coder[LEAST] << 8 | (coder[position] if known else 0)
        coder[MOST] = coder[MOST] << 8 | (coder[position] if known else 255)
    coder[POSITION] = body + _BYTES
    return coder


@compiled
def code_bit(mode: Mode, coder: Coder, slot: int, bit: bool) -> bool:
    """Code a bit by the chance of a slot, and count it there."""
    place = COUNTS + 2 * slot
    zeros, ones = coder[place], coder[place + 1]
    chance = min(max(ones * ONE // (zeros + ones), _LEAST_CHANCE), ONE - _LEAST_CHANCE)
    bit = _code(mode, coder, chance, bit)
    if zeros + ones > coder[MEMORY]:
        zeros, ones = (zeros + 1) // 2, (ones + 1) // 2
    coder[place], coder[place + 1] = (zeros, ones + BIT) if bit else (zeros + BIT, ones)
    return bit


@inlined
def code_digits(mode: Mode, coder: Coder, count: int, number: int) -> int:
    """Code the lowest ``count`` binary digits of a number, highest first, ones and zeros equally likely."""
    coded = 0
    for place in range(count - 1, -1, -1):
        coded = coded << 1 | _code(mode, coder, ONE // 2, (number >> place) & 1 == 1)
    return coded


@compiled
def code_number(mode: Mode, coder: Coder, slot: int, number: int) -> int:
    """Code a number from 1 to 2 ** 18 - 1 as Elias' gamma code, in the ``2 * LONGEST`` slots from ``slot``.

    Slots of the first half tell whether the number has more digits, those of the second its second digit.
    """
    digits = 0
    while digits < LONGEST and code_bit(mode, coder, slot + digits, number >> (digits + 1) > 0):
        digits += 1
    return code_lower_digits(mode, coder, slot + LONGEST, digits, number)


@inlined
def code_lower_digits(mode: Mode, coder: Coder, slot: int, digits: int, number: int) -> int:
    """Code the ``digits`` digits after a number's first, the highest in slot ``slot + digits - 1``."""
    coded = 1
    if digits > 0:
        second = code_bit(mode, coder, slot + digits - 1, (number >> (digits - 1)) & 1 == 1)
        coded = (2 | second) << (digits - 1) | code_digits(mode, coder, digits - 1, number)
    return coded


@compiled_with_arrays
def finish(coder: Coder) -> ByteArray:
    """Return the (B,) bytes of the words, and the fewest after them that determine all bits."""
    for count in range(_BYTES + 1):
        unknown = _ALL_BITS >> (8 * count)
        number = (coder[LOW] + unknown) & ~unknown
        if number + unknown < coder[LOW] + coder[LENGTH]:
            break
    words = coder[POSITION] - coder[BODY]
    stream = np.empty(2 * words + count, np.uint8)
    for place in range(count):
        stream[2 * words + place] = (number >> (40 - 8 * place)) & 255
    carry = number >> 48
    for place in range(words - 1, -1, -1):
        word = coder[coder[BODY] + 1 + place] + carry
        stream[2 * place], stream[2 * place + 1] = (word >> 8) & 255, word & 255
        carry = word >> 16
    return stream


@compiled
def _code(mode: Mode, coder: Coder, chance: int, bit: bool) -> bool:
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
                known = position < coder.size
                least = least << 8 | (coder[position] if known else 0)
                most = most << 8 | (coder[position] if known else 255)
                position += 1
        coder[LEAST], coder[MOST] = least, most
    else:
        low = coder[LOW] + skipped
        coder[position] += low >> 48
        coder[position + 1] = (low & _ALL_BITS) >> 32
        coder[LOW] = (low << 16 if short else low) & _ALL_BITS
        position += short
    coder[POSITION] = position
    return bit
