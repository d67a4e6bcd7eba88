"""Inferred depth: the network, its metric alignment with the sensor, and its errors (SPEC 3)."""

from pipeline.depth.alignment import AlignmentResult, align_depth
from pipeline.depth.conventions import Convention, Overrides
from pipeline.depth.inference import DepthNetwork
from pipeline.depth.metrics import DepthErrors, depth_errors
from pipeline.depth.trust import Trust, judge

__all__ = [
    "AlignmentResult",
    "Convention",
    "DepthErrors",
    "DepthNetwork",
    "Overrides",
    "Trust",
    "align_depth",
    "depth_errors",
    "judge",
]
