"""Placement of a recording's keyframes, whose poses tracking and loops have found."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import combinations
from operator import add

from pipeline.kernels.geometry import inverse
from pipeline.nodes import NodeClouds
from pipeline.placement.agreement import NOTHING_SHARED, Agreement, agreement
from pipeline.placement.outcome import NodeAgreement, NodeVerdict, Placement
from pipeline.types import RgbdFrame


def place_walked(frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds]) -> Placement:
    """Return the given poses, and the agreement of the measurements of each pair of views that share some.

    Args:
        frames: the images, with their final poses.
        nodes: their clouds.
    """
    found = {
        (source, target): _both_ways(frames, nodes, source, target)
        for target, source in combinations(range(len(frames)), 2)
    }
    sharing = {pair: one for pair, one in found.items() if one.shared}
    verdicts = tuple(
        NodeVerdict(
            frame.name, True, reduce(add, (one for pair, one in sharing.items() if k in pair), NOTHING_SHARED)
        )
        for k, frame in enumerate(frames)
    )
    names = [frame.name for frame in frames]
    agreements = tuple(NodeAgreement(names[i], names[j], one) for (i, j), one in sharing.items())
    return Placement((), tuple(frame.T_world_camera for frame in frames), verdicts, agreements)


def _both_ways(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], source: int, target: int
) -> Agreement:
    """Return the agreement of two views, in the points of both."""
    shared = NOTHING_SHARED
    for one, other in ((source, target), (target, source)):
        T_other_one = inverse(frames[other].T_world_camera) @ frames[one].T_world_camera
        shared += agreement(nodes[one].sensor, T_other_one, frames[other].intrinsics, frames[other].depth)
    return shared
