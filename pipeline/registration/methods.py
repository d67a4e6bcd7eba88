"""The registration methods by name."""

from __future__ import annotations

from collections.abc import Callable

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import CeicpA, CeicpN
from pipeline.registration.icp import Icp
from pipeline.registration.weighting import PairWeighting
from pipeline.types import PointCloud

WEIGHTINGS: dict[str, Callable[[RegistrationConfig, PointCloud], PairWeighting]] = {
    "icp": lambda config, target: Icp(),
    "ceicp-n": lambda config, target: CeicpN(config.gate_m),
    "ceicp-a": CeicpA.starting,
}
"""Every method's first state, from the config and the thinned target cloud."""
