"""Erasure code against lost packets: any k of its symbols determine the k source symbols.

A systematic Cauchy Reed-Solomon code over GF(2^16) (Bloemer et al., "An XOR-Based Erasure-Resilient Coding
Scheme", 1995): symbols 0 to k-1 are the source; symbol i >= k is the sum over j of source j / (i + j), where
addition is exclusive or. Every square submatrix is invertible, so any k symbols suffice.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

_POLYNOMIAL = 0x1100B  # x^16 + x^12 + x^3 + x + 1, primitive
_ORDER = (1 << 16) - 1

Words = NDArray[np.uint16]


def repair_symbols(source: Words, ids: NDArray[np.integer]) -> Words:
    """Return (n, T) symbols with numbers ``ids`` (n,), each from k to 65535, of (k, T) ``source`` symbols."""
    return _weighted_sums(_cauchy(ids, np.arange(len(source))), source, *_tables())


def recover(source_count: int, ids: NDArray[np.integer], symbols: Words) -> Words | None:
    """Return the (k, T) source symbols, or None if there are too few symbols.

    Args:
        source_count: number k of source symbols.
        ids: (n,) numbers of the symbols, all different.
        symbols: (n, T) received symbols.
    """
    if len(ids) < source_count:
        return None
    given = ids < source_count
    source = np.zeros((source_count, symbols.shape[1]), np.uint16)
    source[ids[given]] = symbols[given]
    missing = np.setdiff1d(np.arange(source_count), ids[given])
    if missing.size:
        repair_ids, repair = ids[~given][: missing.size], symbols[~given][: missing.size]
        rest = repair ^ repair_symbols(source, repair_ids)
        source[missing] = _solve(_cauchy(repair_ids, missing), rest, *_tables())
    return source


def _cauchy(rows: NDArray[np.integer], columns: NDArray[np.integer]) -> Words:
    exponentials, logarithms = _tables()
    return exponentials[_ORDER - logarithms[rows[:, None] ^ columns[None, :]]]


@lru_cache(maxsize=1)
def _tables() -> tuple[Words, NDArray[np.int32]]:
    """Return the powers of x, repeated twice, and logarithms to base x; that of 0 is never used."""
    powers = np.empty(2 * _ORDER, np.uint16)
    logarithms = np.zeros(_ORDER + 1, np.int32)
    _fill(powers, logarithms)
    return powers, logarithms


def _compiled(function: Any) -> Any:
    return numba.njit(cache=True, nogil=True)(function)


@_compiled
def _fill(powers: Words, logarithms: NDArray[np.int32]) -> None:
    value = 1
    for exponent in range(_ORDER):
        powers[exponent] = powers[exponent + _ORDER] = value
        logarithms[value] = exponent
        value <<= 1
        if value > _ORDER:
            value ^= _POLYNOMIAL


@_compiled
def _add(target: Words, factor: int, symbol: Words, powers: Words, logarithms: NDArray[np.int32]) -> None:
    """Add ``factor`` times ``symbol`` to ``target``, in GF(2^16)."""
    if factor == 0:
        return
    shift = logarithms[factor]
    for position in range(symbol.size):
        word = symbol[position]
        if word:
            target[position] ^= powers[shift + logarithms[word]]


@_compiled
def _weighted_sums(matrix: Words, symbols: Words, powers: Words, logarithms: NDArray[np.int32]) -> Words:
    sums = np.zeros((matrix.shape[0], symbols.shape[1]), np.uint16)
    for row in range(matrix.shape[0]):
        for column in range(matrix.shape[1]):
            _add(sums[row], matrix[row, column], symbols[column], powers, logarithms)
    return sums


@_compiled
def _solve(matrix: Words, sums: Words, powers: Words, logarithms: NDArray[np.int32]) -> Words:
    """Solve by Gauss-Jordan elimination, in place; a Cauchy matrix never has a zero pivot."""
    size = matrix.shape[0]
    for pivot in range(size):
        inverse = powers[_ORDER - logarithms[matrix[pivot, pivot]]]
        for row in range(size):
            if row != pivot and matrix[row, pivot]:
                factor = powers[logarithms[matrix[row, pivot]] + logarithms[inverse]]
                _add(matrix[row], factor, matrix[pivot], powers, logarithms)
                _add(sums[row], factor, sums[pivot], powers, logarithms)
    for pivot in range(size):
        inverse = powers[_ORDER - logarithms[matrix[pivot, pivot]]]
        scaled = np.zeros_like(sums[pivot])
        _add(scaled, inverse, sums[pivot], powers, logarithms)
        sums[pivot] = scaled
    return sums
