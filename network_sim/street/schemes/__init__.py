"""Schemes that choose which images of passing vehicles are collected (our reconstruction, SPEC 6.2).

They follow Bruno & Nurchis, "Efficient data collection in multimedia vehicular sensing platforms" (arXiv
1311.6013), of which only the abstract and the first lines could be read. WORTH is ours.
"""

from __future__ import annotations

import numpy as np

from network_sim.config import SchemeConfig
from network_sim.street.schemes.greedy import Greedy
from network_sim.street.schemes.pdc import Pdc
from network_sim.street.schemes.scheme import Baseline, Scheme
from network_sim.street.schemes.worth import Worth
from network_sim.types import to_ns


def make_scheme(config: SchemeConfig, cells: int, rng: np.random.Generator) -> Scheme:
    """Create the scheme ``config.name`` for cell numbers below ``cells``; ``rng`` draws PDC's requests."""
    if config.name == "baseline":
        return Baseline()
    if config.name == "greedy":
        return Greedy(to_ns(config.validity_s), config.k)
    if config.name == "worth":
        return Worth(config)
    return Pdc(config, cells, rng)
