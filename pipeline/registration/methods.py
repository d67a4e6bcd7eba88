"""The registration methods by name."""

from __future__ import annotations

from collections.abc import Callable

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import CeicpA, CeicpN
from pipeline.registration.ceicp_literal import CeicpLiteral
from pipeline.registration.ceicp_ml import CeicpMl
from pipeline.registration.ceicp_r import CeicpR
from pipeline.registration.fast_robust import FastRobustIcp
from pipeline.registration.ficp import Ficp
from pipeline.registration.hicp import Hicp
from pipeline.registration.icp import Icp
from pipeline.registration.kernel_correlation import KernelCorrelation
from pipeline.registration.mricp import Mricp
from pipeline.registration.picp import Picp
from pipeline.registration.ricp import Ricp
from pipeline.registration.trimmed import TrimmedIcp
from pipeline.registration.weighting import PairWeighting
from pipeline.types import PointCloud

MethodStart = Callable[[RegistrationConfig, PointCloud, PointCloud], PairWeighting]
"""A method's first state, from the config, the thinned source and the thinned target."""

METHODS: dict[str, MethodStart] = {
    "icp": lambda config, source, target: Icp(),
    "trimmed-icp": lambda config, source, target: TrimmedIcp(config.trim),
    "picp": Picp.starting,
    "ricp": lambda config, source, target: Ricp(config.seed),
    "mricp": Mricp.starting,
    "ficp": lambda config, source, target: Ficp(),
    "hicp": Hicp.starting,
    "ceicp-literal": lambda config, source, target: CeicpLiteral(config.gate_m, config.unit),
    "ceicp-n": lambda config, source, target: CeicpN(config.gate_m),
    "ceicp-a": CeicpA.starting,
    "ceicp-r": CeicpR.starting,
    "ceicp-ml": CeicpMl.starting,
    "kernel-correlation": KernelCorrelation.starting,
    "fast-robust-icp": FastRobustIcp.starting,
}
"""Every method that can be asked for."""
