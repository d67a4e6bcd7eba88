"""Random numbers for backoffs, drawn in blocks: a call for each would dominate the run time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

_BLOCK = 4096


def random_below(most: int, rng: np.random.Generator) -> Iterator[int]:
    """Random numbers below a power of two; their lowest bits are those of smaller windows."""
    while True:
        yield from rng.integers(0, most, size=_BLOCK).tolist()
