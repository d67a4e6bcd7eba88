"""Registration of one pair of nodes, and whether both cameras' measurements confirm it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.placement.agreement import NOTHING_SHARED, Agreement
from pipeline.placement.samples import NodeSample, both_ways
from pipeline.placement.views import Views
from pipeline.registration import register
from pipeline.registration.finding.poses import same
from pipeline.registration.finding.search import Found, search
from pipeline.registration.finding.starts import Start
from pipeline.registration.finding.verdict import Verdict
from pipeline.registration.graph.edges import WEAK_SHARE, PoseEdge, registration_information
from pipeline.registration.neighbourhood import Normals
from pipeline.registration.observability import OPEN_SHARE
from pipeline.types import FloatArray, RegistrationResult

LEAST_OVERLAP = 0.05
"""Least share of two nodes' points that the other camera can judge, for their agreement to count."""
LEAST_AGREEMENT = 0.4
"""A node with a given pose is excluded if a smaller share of its shared measurements is within 2 %."""
SURE_OVERLAP, SURE_AGREEMENT = 0.15, 0.88
"""Least overlap and agreement for which the answer of a wider gate is taken; a node with less agreement gets
a warning. Measured agreements: nodes of rendered rigs at correct poses .92 to .98, those of a real SR300 .92
to .99; 3 degrees and 6 cm off .09 to .54; in another room up to .72; with a corner taken for the opposite
one .86."""
FOUND_AGREEMENT = 0.75
"""A smaller agreement refutes a pose that a search found; walls placed on other walls agree less."""
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
    """Result; its steps have no pairs, weights and distances."""
    agreement: Agreement
    """Agreement of both nodes' points at the result's pose; ``NOTHING_SHARED`` if the registration failed."""
    edge: PoseEdge | None
    """Evidence for the pose graph; None if the registration failed, degenerated or is in doubt."""
    verdict: Verdict | None = None
    """Verdict on a pose that a search found; None for given poses and if the search found none."""
    score: float = 0.0
    """Score of the evidence for a pose that a search found, 0 to 1; else 0."""

    @property
    def link(self) -> tuple[int, int]:
        """Source and target."""
        return self.source, self.target

    @property
    def holds(self) -> bool:
        """Whether there is an edge that the measurements do not contradict."""
        return self.edge is not None and self.edge.agrees

    @property
    def refuted(self) -> bool:
        """Whether the measurements contradict the result of a registration from given poses."""
        return less(self.agreement, LEAST_AGREEMENT)


def less(found: Agreement, least: float) -> bool:
    """Return whether the overlap is large enough and the agreement below ``least``."""
    return found.overlap_share >= LEAST_OVERLAP and found.within_2pct_share < least


def confirmed(found: Agreement) -> bool:
    """Return whether overlap and agreement are those of a right pose."""
    return found.overlap_share >= SURE_OVERLAP and found.within_2pct_share >= SURE_AGREEMENT


def odds(share: float) -> float:
    """Return the odds share / (1 - share), within ``LEAST_ODDS`` and ``MOST_ODDS``.

    An edge with a share of .96 weighs more than two with .9.
    """
    return float(np.clip(share / max(1.0 - share, 1e-9), LEAST_ODDS, MOST_ODDS))


def attempt_given(
    source: NodeSample,
    target: NodeSample,
    link: tuple[int, int],
    config: RegistrationConfig,
    T_init: FloatArray,
) -> Attempt:
    """Register a node to another from their given poses; if the measurements contradict the result, try wider
    gates. An attempt that fails has no edge.

    Args:
        source, target: the two nodes.
        link: their numbers.
        config: settings of the registration.
        T_init: (4, 4) start pose T_target_source.
    """

    def work() -> RegistrationResult:
        result = register(source.cloud, target.cloud, config, T_init)
        if less(both_ways(source, target, result.T_target_source), LEAST_AGREEMENT):
            for gate_m in (times * config.gate_m for times in WIDER_GATES):
                wider = register(source.cloud, target.cloud, replace(config, gate_m=gate_m), T_init)
                if confirmed(both_ways(source, target, wider.T_target_source)):
                    return wider
        return result

    try:
        result = work()
    except ReconstructionError as error:
        return _failed(link, True, T_init, str(error))
    found = both_ways(source, target, result.T_target_source)
    strength = odds(found.within_2pct_share) if found.shared else LEAST_ODDS
    attempt = Attempt(*link, True, _without_pairs(result), found, None)
    return replace(attempt, edge=_edge(source, target, link, result, strength, not attempt.refuted))


def attempt_found(
    source: NodeSample,
    target: NodeSample,
    link: tuple[int, int],
    config: RegistrationConfig,
    start: Start,
    views: Views,
) -> Attempt:
    """Search for the pose of a node relative to another; if it is sure, register the nodes there.

    An attempt with a node of fewer than three measured points fails.

    Args:
        source, target: the two nodes.
        link: their numbers.
        config: settings of the last registration; its gate is the search's gate where that is smaller.
        start: way to find start poses.
        views: the nodes' surfaces.
    """
    try:
        judge = views.judge(*link)
    except InputError as error:
        return _failed(link, False, np.eye(4), str(error))
    clouds = views.cloud(link[0]), views.cloud(link[1])
    try:
        found = search(*clouds, [start], judge, config)
    except ReconstructionError as error:
        return _failed(link, False, np.eye(4), str(error))
    T_found = found.candidate.T_target_source
    if not found.verdict.sure:
        return _doubted(source, target, link, found, found.verdict.text)
    final = replace(config, start="given", gate_m=min(config.gate_m, found.candidate.gate_m), direction="p2q")
    result = _registered(source, target, final, T_found)
    if isinstance(result, str):
        return _doubted(source, target, link, found, result)
    if not same(result.T_target_source, T_found, *clouds):
        reason = "the final registration moved away from the pose that the search found"
        return _doubted(source, target, link, found, reason)
    agreement = both_ways(source, target, result.T_target_source)
    score = found.candidate.evidence.score
    edge = _edge(source, target, link, result, odds(score), not less(agreement, FOUND_AGREEMENT))
    return Attempt(*link, False, _without_pairs(result), agreement, edge, found.verdict, score)


def _registered(
    source: NodeSample, target: NodeSample, config: RegistrationConfig, T_init: FloatArray
) -> RegistrationResult | str:
    """Register two nodes; returns the reason if it fails or degenerates."""
    try:
        result = register(source.cloud, target.cloud, config, T_init)
    except ReconstructionError as error:
        return str(error)
    return result if _usable(result) else result.stop_reason


def _doubted(
    source: NodeSample, target: NodeSample, link: tuple[int, int], found: Found, reason: str
) -> Attempt:
    """Return the attempt of a search whose pose is in doubt, without an edge."""
    T = found.candidate.T_target_source
    agreement = both_ways(source, target, T)
    result = RegistrationResult(T, (), False, reason)
    return Attempt(*link, False, result, agreement, None, found.verdict, found.candidate.evidence.score)


def _failed(link: tuple[int, int], given: bool, T: FloatArray, reason: str) -> Attempt:
    """Return the attempt of a registration without an answer; its pose is the start pose."""
    return Attempt(*link, given, RegistrationResult(T, (), False, reason), NOTHING_SHARED, None)


def _usable(result: RegistrationResult) -> bool:
    return bool(result.steps) and not result.stop_reason.startswith("degenerate")


def _edge(
    source: NodeSample,
    target: NodeSample,
    link: tuple[int, int],
    result: RegistrationResult,
    strength: float,
    agrees: bool,
) -> PoseEdge | None:
    """Return the evidence of a registration of two nodes' clouds; None if it degenerated."""
    if not _usable(result):
        return None
    one, other = (Normals(cloud.points_m, cloud.normals).all for cloud in (source.cloud, target.cloud))
    information, weak = (
        registration_information(result, source.cloud.points_m, one, other, share)
        for share in (OPEN_SHARE, WEAK_SHARE)
    )
    return PoseEdge(*link, result.T_target_source, information, strength, agrees, weak)


def _without_pairs(result: RegistrationResult) -> RegistrationResult:
    """Return a result whose steps have no pairs: those of all steps would be some 10 MB."""
    pairs, nothing = np.empty((0, 2), np.intp), np.empty(0)
    steps = (replace(step, pairs=pairs, weights=nothing, distances_m=nothing) for step in result.steps)
    return replace(result, steps=tuple(steps))
