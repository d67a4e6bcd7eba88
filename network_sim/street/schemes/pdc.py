"""PDC: the collector requests each image with a probability that falls with the images of its cell.

This is our reconstruction (SPEC 6.2) of the scheme "on longer time scales" with "only localised decisions" of
Bruno & Nurchis (arXiv 1311.6013). We take the thresholds as images of a cell per control period, and count at
the collector, to which all access points are wired.
"""

from __future__ import annotations

import numpy as np

from network_sim.config import SchemeConfig
from network_sim.street.schemes.scheme import Scheme
from network_sim.types import to_ns

FLOOR = 0.02
"""Least probability of a request."""
DECREASE = 0.7
"""Factor of the probability where more than r_H images per control period were received."""
INCREASE = 0.1
"""Summand of the probability where fewer than r_L images per control period were received."""


def probabilities(rates: np.ndarray, config: SchemeConfig) -> np.ndarray:
    """Compute request probabilities p: 1 up to r_L, then linear to r_H, then just enough to cover a cell.

    Args:
        rates: (C,) mean number of images offered in a control period.
        config: Thresholds, validity and control period.
    """
    once = config.control_s / config.validity_s
    at_high = once / config.r_high
    slope = (rates - config.r_low) / (config.r_high - config.r_low)
    between = 1.0 + slope * (at_high - 1.0)
    above = once / np.maximum(rates, config.r_high)
    chosen = np.where(rates <= config.r_low, 1.0, np.where(rates >= config.r_high, above, between))
    return np.clip(chosen, FLOOR, 1.0)


def adapted(previous: np.ndarray, rates: np.ndarray, config: SchemeConfig) -> np.ndarray:
    """Compute each cell's next p: times DECREASE above r_H received images, plus INCREASE below r_L."""
    fewer = np.where(rates > config.r_high, previous * DECREASE, previous)
    return np.clip(np.where(rates < config.r_low, fewer + INCREASE, fewer), FLOOR, 1.0)


class Pdc(Scheme):
    """The scheme PDC, with counts of images by cell and control period over the observation period."""

    def __init__(self, config: SchemeConfig, cells: int, rng: np.random.Generator) -> None:
        """Start with probability 1 for all cells, which have numbers below ``cells``."""
        self.config = config
        self.probabilities = np.ones(cells)
        self._rng = rng
        self._control_ns = to_ns(config.control_s)
        self._counts = np.zeros(
            (max(1, round(config.observation_s / config.control_s)), cells), dtype=np.int64
        )
        self._period = 0
        self._by_received = config.name == "pdc-received"

    def chosen(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Return the indices of the images to request, oldest first."""
        self._advance(now_ns)
        if not self._by_received:
            np.add.at(self._counts[self._period % len(self._counts)], cells, 1)
        return np.flatnonzero(self._rng.random(len(cells)) < self.probabilities[cells]).tolist()

    def received(self, cell: int, now_ns: int) -> None:
        """Count an image that arrived (pdc-received only)."""
        if self._by_received:
            self._advance(now_ns)
            self._counts[self._period % len(self._counts), cell] += 1

    def _advance(self, now_ns: int) -> None:
        """Update the probabilities at the end of every control period that has passed."""
        while self._period < now_ns // self._control_ns:
            self._period += 1
            rates = self._counts.sum(axis=0) / min(self._period, len(self._counts))
            self._counts[self._period % len(self._counts)] = 0
            if self._by_received:
                self.probabilities = adapted(self.probabilities, rates, self.config)
            else:
                self.probabilities = probabilities(rates, self.config)
