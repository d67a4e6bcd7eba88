"""The search for a pose: starts in the order of their cost, until the evidence is sure of one (SPEC 4.12)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import rotation_angle_rad
from pipeline.registration.colour import LiftedFeatures, colour_start
from pipeline.registration.finding.candidates import (
    QUICK_POINTS,
    Candidate,
    candidates,
    quick_registration,
)
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.rivals import quarter_turns, slides
from pipeline.registration.finding.verdict import LITTLE_THROUGH, Verdict, verdict_on
from pipeline.registration.global_start import default_voxel_m, global_starts
from pipeline.registration.metrics import point_error_m
from pipeline.registration.neighbourhood import median_spacing_m
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud

Way = Literal["given", "colour", "surfaces"]
"""Where a start pose comes from: the user, features of the colour images, features of the surfaces."""

GIVEN_VOXELS = (1.25, 2.5, 5.0, 10.0, 20.0)
"""Gates from a given start, in fiftieths of the target's extent: 0.15 to 2.4 m in a room of 6 m."""
FOUND_VOXELS = (1.25, 2.5)
"""Gates from a start that was found."""
FEATURE_TRIES = ((1.6, 3), (1.0, 1))
"""Voxel sizes for features of the surfaces, in the same unit, with the number of tries of each: the coarse
one is the fastest."""
LEAST_GATE_OF_SPACING = 6.0
"""Least gate, in median spacings of the registered target points."""
SAME_DEG, SAME_VOXELS = 1.5, 0.8
"""Two poses that differ by less are the same answer: 1.5 degrees and 5 cm in a view of 3 m."""
COMPARED_POINTS = 1000
STRAY_MEDIANS = 10.0
"""A point farther from the middle of a cloud than so many times the median is a stray."""
DRAWS = 3
"""Further draws of the points that must lead to the same pose, …"""
MOST_SPREAD_VOXELS = 0.5
"""… within so many fiftieths of the target's extent: 3 cm in a view of 3 m."""
SLIDE_VOXELS = 2.5
"""Shift to other poses that are compared with an answer of which a little is in free space."""
MORE_POINTS = 4 * QUICK_POINTS
"""Points of an answer and its draws where those of quick registrations differ by more."""
LEAST_TURN_DEG = 10.0
"""A rival turned by less is described by its distance."""


@dataclass(frozen=True, slots=True)
class Start:
    """A way to find start poses."""

    way: Way
    poses: Callable[[], Iterable[FloatArray]]
    """Finds (4, 4) start poses T_target_source; raises ReconstructionError if there are none."""


@dataclass(frozen=True, slots=True)
class Found:
    """A pose, what speaks for it, and how it was found."""

    way: Way
    candidate: Candidate
    verdict: Verdict
    tried: tuple[Candidate, ...]
    """All registrations that were compared, in their order."""
    spread_m: float = float("nan")
    """Largest point error between the pose and those of other draws of the points; infinite if one failed,
    NaN of a pose that was in doubt before."""
    settled: bool = False
    """Whether no other start can change the answer: it is sure, or in doubt only because of a rival."""


def search(
    source: PointCloud,
    target: PointCloud,
    starts: Sequence[Start],
    judge: Judge,
    config: RegistrationConfig,
    gates_m: Sequence[float] = (),
) -> Found:
    """Register from each start with a few gates: the first sure answer wins, else that with the best score.

    Rivals of a sure answer are tried too, such as its quarter turns; where one fits as well, the answer is
    doubtful.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        starts: ways to find start poses, the cheapest first.
        judge: judge of these clouds.
        config: settings of the registrations; method, gate and direction are those of the quick ones.
        gates_m: gates; empty for those that suit the target's size and spacing.

    Raises:
        ReconstructionError: no start pose leads to a registration.
    """
    tried: list[Candidate] = []
    best: Found | None = None
    reason: ReconstructionError | None = None
    for start in starts:
        gates = gates_m or default_gates_m(target, start.way, config.seed)
        try:
            for T_start in start.poses():
                for candidate in candidates(source, target, T_start, gates, judge, config):
                    tried.append(candidate)
                    found = Found(start.way, candidate, verdict_on(candidate.evidence), ())
                    if found.verdict.sure:
                        found = _doubted(source, target, found, tried, judge, config)
                    if best is None or found.settled or _rank(found) > _rank(best):
                        best = found
                    if found.settled:
                        return replace(found, tried=tuple(tried))
        except ReconstructionError as error:
            reason = error
    if best is None:
        raise reason or ReconstructionError(
            "No start pose leads to a registration: the clouds have too little in common, or the points of "
            "one leave the pose open; try a closer start pose, or clouds that show more of the place"
        )
    return replace(best, tried=tuple(tried))


def _rank(found: Found) -> tuple[int, bool, float]:
    """Answers with fewer doubts before others, then those from a given start, then the score."""
    return -len(found.verdict.reasons), found.way == "given", found.candidate.evidence.score


def default_gates_m(target: PointCloud, way: Way, seed: int = 0) -> list[float]:
    """Return gates for a target, ascending: a gate is a promise of how far the start is off."""
    few = draw(target, QUICK_POINTS, seed, "target").points_m
    least_m = LEAST_GATE_OF_SPACING * median_spacing_m(few)
    shares = GIVEN_VOXELS if way == "given" else FOUND_VOXELS
    return sorted({max(least_m, share * default_voxel_m(target)) for share in shares})


def by_surfaces(source: PointCloud, target: PointCloud, seed: int = 0) -> Start:
    """Return start poses from features of the surfaces (FPFH), coarse ones first."""

    def poses() -> Iterable[FloatArray]:
        found, reason = 0, None
        for voxels, tries in FEATURE_TRIES:
            seeds = range(seed, seed + tries)
            try:
                for T_start in global_starts(source, target, voxels * default_voxel_m(target), seeds):
                    yield T_start
                    found += 1
            except ReconstructionError as error:
                reason = error
        if reason is not None and not found:
            raise reason

    return Start("surfaces", poses)


def by_colour(source: LiftedFeatures, target: LiftedFeatures) -> Start:
    """Return the start pose on which features of the colour images agree."""

    def poses() -> Iterable[FloatArray]:
        found = colour_start(source, target)
        if found.T_target_source is None:
            raise ReconstructionError(found.why_none)
        yield found.T_target_source

    return Start("colour", poses)


def same(T_a: FloatArray, T_b: FloatArray, source: PointCloud, target: PointCloud) -> bool:
    """Return whether two poses of a source relative to a target are the same answer."""
    apart_m = point_error_m(T_a, T_b, compared_points_m(source))
    return turn_deg(T_a, T_b) < SAME_DEG and apart_m < SAME_VOXELS * default_voxel_m(target)


def turn_deg(T_a: FloatArray, T_b: FloatArray) -> float:
    """Return the angle between the rotations of two (4, 4) poses, rigid or with a scale."""
    relative = T_a[:3, :3].T @ T_b[:3, :3]
    return float(np.degrees(rotation_angle_rad(relative / np.cbrt(np.linalg.det(relative)))))


def compared_points_m(cloud: PointCloud) -> FloatArray:
    """Return about 1000 points by which poses are compared, (n, 3), without strays: at an error of 0.001
    degrees, a few points at a distance of a kilometre would outweigh all others.
    """
    some_m = cloud.points_m[:: max(1, len(cloud) // COMPARED_POINTS)]
    away_m = np.linalg.norm(some_m - np.median(some_m, axis=0), axis=1)
    return some_m[away_m <= STRAY_MEDIANS * np.median(away_m)]


def _doubted(
    source: PointCloud,
    target: PointCloud,
    found: Found,
    tried: Sequence[Candidate],
    judge: Judge,
    config: RegistrationConfig,
) -> Found:
    """Return an answer without doubts as it is, or in doubt because of other draws or of another pose.

    Where both clouds have colours, these have refuted all quarter turns but that of a room of one colour.
    """
    answer = found.candidate
    if answer.evidence.through_share > LITTLE_THROUGH:
        answer = _best_slide(source, target, answer, judge, config)
    if _bare(judge) and (before := _scored_better(source, target, answer, tried)) is not None:
        doubt = _rival_text(source, answer, before)
        return replace(found, verdict=verdict_on(answer.evidence, (doubt,)))
    doubts: tuple[str, ...] = ()
    spread_m = _spread_m(source, target, answer, config)
    most_m = MOST_SPREAD_VOXELS * default_voxel_m(target)
    if most_m < spread_m < np.inf:
        answer, spread_m = _with_more_points(source, target, answer, judge, config)
    if spread_m <= most_m and np.isnan(answer.evidence.color_correlation):
        best, doubts = _unless_rivalled(source, target, found.way, answer, judge, config)
        if best is not answer:
            answer, spread_m = best, _spread_m(source, target, best, config)
    if np.isinf(spread_m):
        doubts = (*doubts, "another draw of the points finds no pose")
    elif spread_m > most_m:
        doubts = (*doubts, f"other draws of the points end up to {length(spread_m)} away")
    verdict = verdict_on(answer.evidence, doubts)
    return replace(found, candidate=answer, verdict=verdict, spread_m=spread_m, settled=spread_m <= most_m)


def _best_slide(
    source: PointCloud, target: PointCloud, answer: Candidate, judge: Judge, config: RegistrationConfig
) -> Candidate:
    """Return the answer, or the pose nearby that passes all tests with a better score."""
    step_m, gate_m = (
        SLIDE_VOXELS * default_voxel_m(target),
        default_gates_m(target, "surfaces", config.seed)[0],
    )
    others = slides(source, target, answer.T_target_source, step_m, gate_m, judge, config)
    sure = [one for one in others if verdict_on(one.evidence).sure]
    return max([answer, *sure], key=lambda one: one.evidence.score)


def _with_more_points(
    source: PointCloud, target: PointCloud, answer: Candidate, judge: Judge, config: RegistrationConfig
) -> tuple[Candidate, float]:
    """Return the answer with more points, and its spread; as it was, with an infinite one, if that fails."""
    way = answer.T_start, answer.gate_m, answer.direction
    try:
        T = quick_registration(source, target, *way, config, points=MORE_POINTS)
    except ReconstructionError:
        return answer, float("inf")
    better = replace(answer, T_target_source=T, evidence=judge(T))
    return better, _spread_m(source, target, better, config, MORE_POINTS)


def _spread_m(
    source: PointCloud,
    target: PointCloud,
    candidate: Candidate,
    config: RegistrationConfig,
    points: int = QUICK_POINTS,
) -> float:
    """Return the largest point error between a candidate and further draws of the points from its start."""
    some_m = compared_points_m(source)
    farthest_m = 0.0
    for seed in range(config.seed + 1, config.seed + 1 + DRAWS):
        try:
            way = candidate.T_start, candidate.gate_m, candidate.direction
            T = quick_registration(source, target, *way, config, seed, points)
        except ReconstructionError:
            return float("inf")
        farthest_m = max(farthest_m, point_error_m(T, candidate.T_target_source, some_m))
    return farthest_m


def _unless_rivalled(
    source: PointCloud,
    target: PointCloud,
    way: Way,
    answer: Candidate,
    judge: Judge,
    config: RegistrationConfig,
) -> tuple[Candidate, tuple[str, ...]]:
    """Return the answer or the rival that fits clearly better, and a doubt if another one fits as well.

    Rivals are quarter turns and, of a given start without free space to refute its answer, the pose to which
    features of the surfaces lead: half a room slid along the other half can fit almost as well.
    """
    T = answer.T_target_source
    turns = quarter_turns(source, target, T, 2.0 * answer.gate_m, judge, config)
    tried = [*turns, *(_by_features(source, target, judge, config) if way == "given" else ())]
    others = [
        one
        for one in tried
        if verdict_on(one.evidence).sure and not same(one.T_target_source, T, source, target)
    ]
    best = min([answer, *others], key=lambda one: one.evidence.against_share)
    if not best.evidence.clearly_better(answer.evidence):
        best = answer
    rivals = [
        one
        for one in (answer, *others)
        if not best.evidence.clearly_better(one.evidence)
        and not same(one.T_target_source, best.T_target_source, source, target)
    ]
    if not rivals:
        return best, ()
    rival = min(rivals, key=lambda one: one.evidence.against_share)
    return best, (_rival_text(source, best, rival),)


def _scored_better(
    source: PointCloud, target: PointCloud, answer: Candidate, tried: Sequence[Candidate]
) -> Candidate | None:
    """Return the tried registration with the best score if it led elsewhere than the answer."""
    best = max(tried, key=lambda one: one.evidence.score)
    elsewhere = not same(best.T_target_source, answer.T_target_source, source, target)
    return best if elsewhere and best.evidence.score > answer.evidence.score else None


def _rival_text(source: PointCloud, answer: Candidate, rival: Candidate) -> str:
    T_answer, T_rival = answer.T_target_source, rival.T_target_source
    turned_deg, apart_m = (
        turn_deg(T_answer, T_rival),
        point_error_m(T_answer, T_rival, compared_points_m(source)),
    )
    how = f"turned by {turned_deg:.0f} degrees" if turned_deg >= LEAST_TURN_DEG else f"{length(apart_m)} away"
    return f"{how}, the source fits as well"


def _bare(judge: Judge) -> bool:
    """Return whether no free space can refute a pose, since a cloud has no viewpoint."""
    return judge.source.view is None or judge.target.view is None


def _by_features(
    source: PointCloud, target: PointCloud, judge: Judge, config: RegistrationConfig
) -> Iterable[Candidate]:
    """Yield where the first start by features leads, if free space refutes nothing."""
    if not _bare(judge):
        return
    try:
        T_start = next(iter(by_surfaces(source, target, config.seed).poses()))
    except ReconstructionError:
        return
    gates_m = default_gates_m(target, "surfaces", config.seed)
    yield from candidates(source, target, T_start, gates_m, judge, config)


def length(metres: float) -> str:
    """Return a length in words."""
    return f"{metres:.3g} m" if metres >= 1.0 else f"{100.0 * metres:.2g} cm"
