"""The choice of a few cameras out of many: greedy with exchanges, and how far from the best it can be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.types import BoolArray, FloatArray, IntArray

MOST_EXCHANGES = 20
"""Most cameras that are exchanged after the greedy choice."""
WORTH = 1e-9
"""Relative gain below which an exchange changes nothing."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Chosen candidates, the most useful first."""

    rows: tuple[int, ...]
    gains: FloatArray
    """(k, T) chance of each to be the first of them that measures each target."""
    best_at_most: float
    """Upper bound on the gain of any choice of as many candidates."""

    @property
    def gain(self) -> float:
        """Expected number of targets that are measured by at least one of them."""
        return float(self.gains.sum())


def choose(chance: FloatArray, allowed: BoolArray, place: IntArray, count: int) -> Choice:
    """Choose candidates that together measure as many targets as possible.

    The expected number of targets that at least one candidate measures is monotone and submodular. With at
    most one camera at a place, the greedy choice has at least half of the best (Fisher, Nemhauser and Wolsey
    1978). After it, single candidates are exchanged while that gains. The bound on the best is the smaller
    of the ``count`` largest single gains, and of the gain plus the ``count`` largest further gains (Minoux
    1978).

    Args:
        chance: (C, T) chance of each candidate to measure each target.
        allowed: (C,) True for candidates that may be chosen.
        place: (C,) number of each candidate's place, at which one camera may stand.
        count: number of candidates; fewer are chosen if no other adds anything.
    """
    rows: list[int] = []
    for _ in range(count):
        row, gain = _best(chance, allowed, place, rows)
        if gain <= 0.0:
            break
        rows.append(row)
    for _ in range(MOST_EXCHANGES):
        exchanged = _exchanged(chance, allowed, place, rows)
        if exchanged is None:
            break
        rows = exchanged
    ordered = _ordered(chance, rows)
    best_at_most = min(
        _largest(chance, allowed, [], count),
        _total(chance, rows) + _largest(chance, allowed, rows, count),
    )
    return Choice(tuple(ordered), _steps(chance, ordered), best_at_most)


def _missed(chance: FloatArray, rows: list[int]) -> FloatArray:
    """Return (T,) chances that none of the candidates measures each target."""
    return np.prod(1.0 - chance[rows], axis=0, dtype=float)


def _total(chance: FloatArray, rows: list[int]) -> float:
    return float(chance.shape[1] - _missed(chance, rows).sum())


def _largest(chance: FloatArray, allowed: BoolArray, rows: list[int], count: int) -> float:
    """Return the sum of the ``count`` largest gains that single candidates add to the chosen ones."""
    gains = np.where(allowed, chance @ _missed(chance, rows), 0.0)
    return float(np.sort(gains)[::-1][:count].sum())


def _best(chance: FloatArray, allowed: BoolArray, place: IntArray, rows: list[int]) -> tuple[int, float]:
    """Return the candidate that adds most to the chosen ones, and how much."""
    gains = np.where(allowed, chance @ _missed(chance, rows), 0.0)
    gains[np.isin(place, place[rows])] = 0.0
    row = int(np.argmax(gains))
    return row, float(gains[row])


def _exchanged(chance: FloatArray, allowed: BoolArray, place: IntArray, rows: list[int]) -> list[int] | None:
    """Return the choice after the best exchange of one candidate; None if no exchange gains."""
    best, most = None, _total(chance, rows) * (1.0 + WORTH)
    for index in range(len(rows)):
        others = rows[:index] + rows[index + 1 :]
        row, gain = _best(chance, allowed, place, others)
        total = _total(chance, others) + gain
        if total > most:
            best, most = [*others, row], total
    return best


def _ordered(chance: FloatArray, rows: list[int]) -> list[int]:
    """Return the chosen candidates, each the one that adds most to those before it."""
    left = np.zeros(len(chance), bool)
    ordered: list[int] = []
    left[rows] = True
    for _ in rows:
        row, _ = _best(chance, left, np.arange(len(chance)), ordered)
        ordered.append(row)
        left[row] = False
    return ordered


def _steps(chance: FloatArray, ordered: list[int]) -> FloatArray:
    missed = [_missed(chance, ordered[:k]) for k in range(len(ordered) + 1)]
    return -np.diff(missed, axis=0)
