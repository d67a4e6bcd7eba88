"""Configured losses: a share of the frames is lost, independently or in bursts (SPEC 6.5)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from network_sim.config import LossConfig

LOSS_STREAM = 1
"""Number of this random stream, so that losses are independent of other draws from the same seed."""
_BLOCK = 1024


class LinkLosses:
    """Sequence of lost and received frames on each link.

    Every link has its own Markov chain and random stream, which depend only on the seed and the link's two
    nodes: its losses do not change with traffic on other links.
    """

    def __init__(self, config: LossConfig, seed: int) -> None:
        """Prepare the links; with a loss share of 0 nothing is drawn."""
        self._config = config
        self._seed = seed
        self._links: dict[tuple[int, int], Iterator[bool]] = {}

    def lost(self, sender: int, receiver: int) -> bool:
        """Return whether the link loses the next frame of this sender."""
        if not self._config.share:
            return False
        link = self._links.get((sender, receiver))
        if link is None:
            rng = np.random.default_rng((self._seed, LOSS_STREAM, sender, receiver))
            link = self._links[sender, receiver] = frames_lost(self._config, rng)
        return next(link)


def frames_lost(config: LossConfig, rng: np.random.Generator) -> Iterator[bool]:
    """Yield whether each frame of a link is lost: Gilbert's model, with a bad state that loses all frames.

    After a loss the next frame is lost with probability 1 - p_bg, else with p_gb; p_bg = 1 / burst and
    p_gb = p_bg L / (1 - L) for a loss share L. Independent losses have a mean burst of 1 / (1 - L); shorter
    bursts would need negatively correlated losses, so they are raised to this value.
    """
    share = config.share
    goes_on = max(1.0 - 1.0 / config.burst_packets, share)
    begins = (1.0 - goes_on) * share / (1.0 - share) if share < 1.0 else 1.0
    lost = bool(rng.random() < share)
    yield lost
    while True:
        for draw in rng.random(_BLOCK).tolist():
            lost = draw < (goes_on if lost else begins)
            yield lost
