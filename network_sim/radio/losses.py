"""Losses that are set: a share of the frames, each by itself or in bursts (SPEC 6.5)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from network_sim.config import LossConfig

LOSS_STREAM = 1
"""Keeps what is lost apart from whatever else is drawn from the same seed."""
_BLOCK = 1024


class LinkLosses:
    """Which frames get lost on each link, one after the other.

    Every link has a chain and a stream of its own, which depend on the seed and on its two nodes alone: what
    is lost on it does not change with what is sent elsewhere.
    """

    def __init__(self, config: LossConfig, seed: int) -> None:
        """With a share of 0 nothing is drawn."""
        self._config = config
        self._seed = seed
        self._links: dict[tuple[int, int], Iterator[bool]] = {}

    def lost(self, sender: int, receiver: int) -> bool:
        """Whether the link loses the frame that its sender sends next."""
        if not self._config.share:
            return False
        link = self._links.get((sender, receiver))
        if link is None:
            rng = np.random.default_rng((self._seed, LOSS_STREAM, sender, receiver))
            link = self._links[sender, receiver] = frames_lost(self._config, rng)
        return next(link)


def frames_lost(config: LossConfig, rng: np.random.Generator) -> Iterator[bool]:
    """Whether each frame of a link is lost: Gilbert's two states, of which one loses all and one nothing.

    After a loss the next frame is lost with probability 1 - p_bg, else with p_gb; p_bg = 1 / burst and
    p_gb = p_bg L / (1 - L) for a share L. Losses by chance alone are the same with bursts of 1 / (1 - L),
    and none are shorter: then frames would have to know of each other to avoid each other.
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
