"""Moments of a bag: which messages of several image topics belong together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import FloatArray, IntArray

LARGEST_GAP_S = 0.05
"""Largest time difference of images that count as simultaneous: more than one frame at 30 Hz."""


class Timed(Protocol):
    """A topic with the times of its messages."""

    @property
    def name(self) -> str: ...
    @property
    def stamps_s(self) -> FloatArray:
        """(N,) times in the headers."""
        ...

    @property
    def recorded_ns(self) -> IntArray:
        """(N,) times at which the messages came into the bag."""
        ...


def times_of(topics: Sequence[Timed]) -> tuple[list[FloatArray], tuple[str, ...]]:
    """Return (N,) times of the messages of each topic, seconds, and a note if headers lack them.

    They are the times in the headers. If one header has no time, or all headers of a topic have the same
    time, they are the times at which the messages of all topics came into the bag.
    """
    unstamped = [topic for topic in topics if not _stamped(topic.stamps_s)]
    if not unstamped:
        return [topic.stamps_s for topic in topics], ()
    first = unstamped[0]
    least_s, most_s = float(first.stamps_s.min()), float(first.stamps_s.max())
    if least_s == most_s:
        what = f"All headers of {first.name} have " + (f"the time {most_s:g} s" if most_s else "no time")
    else:
        what = f"Some headers of {first.name} have no time"
    note = f"{what}: the times at which the messages came into the bag are used"
    return [np.array(topic.recorded_ns, np.float64) * 1e-9 for topic in topics], (note,)


def _stamped(stamps_s: FloatArray) -> bool:
    return bool((stamps_s > 0).all() and (len(stamps_s) == 1 or np.ptp(stamps_s) > 0))


def moments_of(path: Path, times_s: Sequence[FloatArray]) -> IntArray:
    """Return (moments, topics) indices of the messages of every moment, in order of the first topic's time.

    No message is in two moments.

    Args:
        path: the bag.
        times_s: (N,) times of each topic's messages; the first topic gives the moments.

    Raises:
        InputError: the topics have no messages of one time.
    """
    nearest, chosen_s, together = _together(path, times_s)
    apart = _apart(chosen_s, together)
    found: IntArray = nearest[apart[np.argsort(chosen_s[apart, 0], kind="stable")]]
    return found


def moments_from_middle(path: Path, times_s: Sequence[FloatArray]) -> IntArray:
    """Return the moments of ``_together``, ascending by their distance from the middle of the bag.

    Args:
        path: the bag.
        times_s: (N,) times of each topic's messages; the first topic gives the moments.

    Raises:
        InputError: the topics have no messages of one time.
    """
    nearest, _, together = _together(path, times_s)
    found: IntArray = nearest[together[np.abs(together - len(nearest) / 2).argsort(kind="stable")]]
    return found


def _together(path: Path, times_s: Sequence[FloatArray]) -> tuple[IntArray, FloatArray, IntArray]:
    """Return (N, topics) indices of the messages nearest to those of the first topic, and their times.

    The times are in seconds. Also returns the indices of the rows whose messages are of one moment.

    Raises:
        InputError: there is no such row.
    """
    nearest = np.stack([_nearest(own_s, times_s[0]) for own_s in times_s], axis=1)
    chosen_s = np.stack([own_s[at] for own_s, at in zip(times_s, nearest.T, strict=True)], axis=1)
    gaps_s = np.ptp(chosen_s, axis=1)
    together = np.flatnonzero(gaps_s <= LARGEST_GAP_S)
    if not len(together):
        raise InputError(
            f"The images of the bag {path} are never less than {gaps_s.min():.3g} s apart, more than the "
            f"{LARGEST_GAP_S:g} s of one moment; try to record with the cameras' clocks set alike"
        )
    return nearest, chosen_s, together


def _apart(chosen_s: FloatArray, together: IntArray) -> IntArray:
    """Return the moments, ascending, so that no two share a message; those with closer messages are kept."""
    taken: set[tuple[int, float]] = set()
    kept = []
    for moment in together[np.argsort(np.ptp(chosen_s[together], axis=1), kind="stable")]:
        times = set(enumerate(chosen_s[moment].tolist()))
        if not taken & times:
            taken |= times
            kept.append(moment)
    return np.sort(np.array(kept))


def _nearest(times_s: FloatArray, wanted_s: FloatArray) -> IntArray:
    """Return the (M,) indices of the times nearest to (M,) other times; the earlier of two equally near."""
    order = np.argsort(times_s, kind="stable")
    ascending = times_s[order]
    after = np.searchsorted(ascending, wanted_s).clip(1, max(1, len(ascending) - 1))
    around = np.stack([after - 1, after.clip(max=len(ascending) - 1)])
    closer = np.abs(ascending[around] - wanted_s).argmin(axis=0)
    found: IntArray = order[around[closer, np.arange(len(wanted_s))]]
    return found
