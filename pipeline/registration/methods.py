"""The registration methods by name."""

from __future__ import annotations

from collections.abc import Callable

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import CeicpA, CeicpN
from pipeline.registration.icp import Icp
from pipeline.registration.weighting import PairWeighting
from pipeline.types import PointCloud

MethodStart = Callable[[RegistrationConfig, PointCloud, PointCloud], PairWeighting]
"""A method's first state, from the config, the thinned source and the thinned target."""

METHODS: dict[str, MethodStart] = {
    "icp": lambda config, source, target: Icp(),
    "ceicp-n": lambda config, source, target: CeicpN(config.gate_m),
    "ceicp-a": CeicpA.starting,
}
"""Every method that can be asked for."""
