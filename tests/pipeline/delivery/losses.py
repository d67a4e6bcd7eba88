"""Packets lost as on real links."""

import numpy as np


def bursts(count: int, share: float, rng: np.random.Generator, mean_burst: float = 8) -> np.ndarray:
    """(count,) lost packets of a Gilbert-Elliott link that loses all in its bad state (SPEC 6.5)."""
    leaves_bad = 1 / mean_burst
    enters_bad = leaves_bad * share / (1 - share)
    lost = np.zeros(count, bool)
    bad = rng.random() < share
    for index, chance in enumerate(rng.random(count)):
        bad = chance >= leaves_bad if bad else chance < enters_bad
        lost[index] = bad
    return lost
