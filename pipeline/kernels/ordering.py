"""Sorting of many whole numbers, such as grid cells or mesh edges."""

from __future__ import annotations

import numba
import numpy as np

from pipeline.types import IntArray

_DIGIT_BITS = 11
"""Bits of a key sorted per round: the counts fit into a core's first-level cache."""


def stable_order(keys: IntArray) -> IntArray:
    """Return (N,) rows sorted by their (N,) keys, all 0 or more; rows with equal keys keep their order.

    Radix sort from the last digit: for keys with few digits it takes a third of the time of NumPy's
    ``argsort`` (``tests/benchmarks/ordering.py``), which compares keys.
    """
    return _radix_order(np.ascontiguousarray(keys, np.int64), int(keys.max(initial=0)))


@numba.njit(cache=True, nogil=True)
def _radix_order(keys, greatest):  # type: ignore[no-untyped-def]
    order = np.arange(len(keys))
    previous = np.empty_like(order)
    begins = np.empty(1 << _DIGIT_BITS, np.int64)
    for shift in range(0, 63, _DIGIT_BITS):
        if greatest >> shift == 0:
            break
        order, previous = previous, order
        begins[:] = 0
        for key in keys:
            begins[_digit(key, shift)] += 1
        total = 0
        for digit in range(len(begins)):
            count = begins[digit]
            begins[digit] = total
            total += count
        for row in previous:
            digit = _digit(keys[row], shift)
            order[begins[digit]] = row
            begins[digit] += 1
    return order


@numba.njit(cache=True, nogil=True)
def _digit(key, shift):  # type: ignore[no-untyped-def]
    return (key >> shift) & ((1 << _DIGIT_BITS) - 1)
