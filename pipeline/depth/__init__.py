"""Inferred depth: network, metric alignment with the sensor, completion, confidence and errors (SPEC 3)."""

from pipeline.depth.alignment import AlignmentResult, align_depth
from pipeline.depth.completion import CompletedDepth, complete
from pipeline.depth.confidence import JudgedDepth, judge
from pipeline.depth.conventions import Convention, Overrides
from pipeline.depth.inference import DepthNetwork
from pipeline.depth.metrics import DepthErrors, depth_errors
from pipeline.depth.own_completion import OwnCompletion, completed_by

__all__ = [
    "AlignmentResult",
    "CompletedDepth",
    "Convention",
    "DepthErrors",
    "DepthNetwork",
    "JudgedDepth",
    "Overrides",
    "OwnCompletion",
    "align_depth",
    "complete",
    "completed_by",
    "depth_errors",
    "judge",
]
