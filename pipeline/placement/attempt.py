"""Registration of one pair of nodes, and whether both cameras' measurements confirm it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels import geometry
from pipeline.placement.agreement import NOTHING_SHARED, Agreement
from pipeline.placement.edges import PoseEdge, registration_information
from pipeline.placement.samples import NodeSample, both_ways
from pipeline.registration import register
from pipeline.registration.anywhere import register_anywhere
from pipeline.registration.neighbourhood import Normals
from pipeline.types import FloatArray, PointCloud, RegistrationResult

LEAST_OVERLAP = 0.05
"""Least share of two nodes' points that the other camera can judge, for their agreement to count."""
LEAST_AGREEMENT = 0.4
"""A node with a given pose is excluded if a smaller share of its shared measurements is within 2 %."""
SURE_OVERLAP, SURE_AGREEMENT = 0.15, 0.88
"""Least overlap and agreement of a pose found without a first guess; a given one with less gets a warning.
At correct poses, nodes of rendered rigs reach .92 to .98 and those of a real SR300 .92 to .99; 3 degrees and
6 cm off .09 to .54; in another room up to .72; with one corner mistaken for the opposite .86."""
WIDER_GATES = 2.0, 4.0
"""Multiples of the configured gate, tried if given poses lead to a contradiction with the measurements."""
LEAST_ODDS, MOST_ODDS = 0.1, 100.0
"""Bounds of an edge's strength, the odds that a shared measurement agrees."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """The registration of one pair of nodes."""

    source: int
    target: int
    given: bool
    """Whether it started from given poses."""
    result: RegistrationResult
    """Its steps are without their pairs."""
    agreement: Agreement
    edge: PoseEdge | None
    """Evidence for the pose graph; None if the registration failed or degenerated."""

    @property
    def link(self) -> tuple[int, int]:
        """Source and target."""
        return self.source, self.target


def accepted(found: Agreement, given: bool) -> bool:
    """Return whether the measurements confirm a pose or, from given poses, do not contradict it."""
    return not less(found, LEAST_AGREEMENT) if given else confirmed(found)


def less(found: Agreement, least: float) -> bool:
    """Return whether the overlap is large enough and the agreement below ``least``."""
    return found.overlap_share >= LEAST_OVERLAP and found.within_2pct_share < least


def confirmed(found: Agreement) -> bool:
    """Return whether overlap and agreement are those of a right pose."""
    return found.overlap_share >= SURE_OVERLAP and found.within_2pct_share >= SURE_AGREEMENT


def score(found: Agreement) -> float:
    """Score a pose found from anywhere: its agreement, or 0 if the overlap is too small."""
    return found.within_2pct_share if found.overlap_share >= SURE_OVERLAP else 0.0


def strength(found: Agreement) -> float:
    """Return the odds that a shared measurement agrees: one with .96 weighs more than two with .9."""
    if not found.shared:
        return LEAST_ODDS
    odds = found.within / max(1, found.shared - found.within)
    return float(np.clip(odds, LEAST_ODDS, MOST_ODDS))


def attempt_given(
    source: NodeSample,
    target: NodeSample,
    link: tuple[int, int],
    config: RegistrationConfig,
    T_init: FloatArray,
) -> Attempt:
    """Register a node to another from a start pose; if the measurements contradict the result, try wider
    gates.
    """

    def work() -> RegistrationResult:
        result = register(source.cloud, target.cloud, config, T_init)
        if less(both_ways(source, target, result.T_target_source), LEAST_AGREEMENT):
            for gate_m in (times * config.gate_m for times in WIDER_GATES):
                wider = register(source.cloud, target.cloud, replace(config, gate_m=gate_m), T_init)
                if confirmed(both_ways(source, target, wider.T_target_source)):
                    return wider
        return result

    return _attempt(source, target, link, (source.cloud, target.cloud), True, work, T_init)


def attempt_anywhere(
    source: NodeSample,
    target: NodeSample,
    link: tuple[int, int],
    clouds: tuple[PointCloud, PointCloud],
    config: RegistrationConfig,
    thorough: bool,
) -> Attempt:
    """Register a node to another without a start pose.

    Args:
        source, target: the two nodes.
        link: their numbers.
        clouds: their whole clouds, for the features.
        config: settings of the registration.
        thorough: whether a second size of features is tried.
    """

    def judged(T_target_source: FloatArray) -> float:
        return score(both_ways(source, target, T_target_source))

    def work() -> RegistrationResult:
        return register_anywhere(*clouds, config, judged, SURE_AGREEMENT, thorough)

    T_given = geometry.inverse(target.frame.T_world_camera) @ source.frame.T_world_camera
    return _attempt(source, target, link, clouds, False, work, T_given)


def _attempt(
    source: NodeSample,
    target: NodeSample,
    link: tuple[int, int],
    clouds: tuple[PointCloud, PointCloud],
    given: bool,
    work: Callable[[], RegistrationResult],
    T_without: FloatArray,
) -> Attempt:
    """Run a registration and judge its result; if it fails, the pose is ``T_without``."""
    try:
        result = work()
    except ReconstructionError as error:
        failed = RegistrationResult(T_without, (), False, str(error))
        return Attempt(*link, given, failed, NOTHING_SHARED, None)
    found = both_ways(source, target, result.T_target_source)
    edge = None
    if result.steps and not result.stop_reason.startswith("degenerate"):
        moving, fixed = clouds
        here, there = result.steps[-1].pairs.T
        normals = (
            Normals(moving.points_m, moving.normals).at(here),
            Normals(fixed.points_m, fixed.normals).at(there),
        )
        information = registration_information(result, moving.points_m, *normals)
        accepts = accepted(found, given)
        edge = PoseEdge(*link, result.T_target_source, information, strength(found), accepts)
    return Attempt(*link, given, _without_pairs(result), found, edge)


def _without_pairs(result: RegistrationResult) -> RegistrationResult:
    """Return a result whose steps have no pairs: those of all steps would be some 10 MB."""
    pairs, nothing = np.empty((0, 2), np.intp), np.empty(0)
    steps = (replace(step, pairs=pairs, weights=nothing, distances_m=nothing) for step in result.steps)
    return replace(result, steps=tuple(steps))
