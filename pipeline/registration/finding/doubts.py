"""Doubts about an answer that passes the tests of its evidence: registrations that lead elsewhere, and other
poses that fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.registration.finding.candidates import (
    QUICK_POINTS,
    Candidate,
    candidates,
    drawn_points,
    quick_registration,
)
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.poses import compared_points_m, length, same, turn_deg
from pipeline.registration.finding.rivals import better_slide, quarter_turns
from pipeline.registration.finding.starts import Way, by_surfaces, default_gates_m
from pipeline.registration.finding.verdict import LITTLE_STIFFNESS, verdict_on
from pipeline.registration.global_start import default_voxel_m
from pipeline.registration.metrics import point_error_m
from pipeline.types import FloatArray, PointCloud

DRAWS = 3
"""Number of further draws of the points whose registrations must lead to the same pose."""
MOST_SPREAD_VOXELS = 0.5
"""Largest distance of these poses, in fiftieths of the target's extent: 3 cm in a view of 3 m."""
SIDE_VOXELS, SIDE_OF_GATE = 1.2, 0.9
"""Where the stiffness is little, registrations that start on both sides of the pose must lead to it, too.
They start this many fiftieths of the target's extent away, along the motion that is held least, but at most
this share of the gate."""
CLOSE_VOXELS = 0.3
"""Where the poses are farther apart, in the same unit, the registrations are repeated with more points."""
MORE_POINTS = (4 * QUICK_POINTS, 16 * QUICK_POINTS)
"""Numbers of points of the first and of the second repetition."""
LEAST_TURN_DEG = 10.0
"""A rival turned by less is described by its distance."""


class Checked(NamedTuple):
    """An answer, or a better one that was found while it was checked."""

    candidate: Candidate
    doubts: tuple[str, ...]
    spread_m: float
    """Largest point error between the pose and those of further registrations; infinite if one failed, NaN if
    another pose had the better score."""
    settled: bool = False
    """Whether these registrations agree; then the pose is sure, unless ``doubts`` name a rival."""
    undecided: bool = False
    """Whether those with few points disagree, so that more points may decide."""


@dataclass(frozen=True, slots=True)
class Checks:
    """Checks of answers for two clouds, by further registrations and rival poses; called with an answer."""

    source: PointCloud
    target: PointCloud
    judge: Judge
    config: RegistrationConfig

    def __call__(self, way: Way, answer: Candidate, tried: Sequence[Candidate]) -> Checked:
        """Check an answer whose evidence passes all tests, except perhaps that of the stiffness.

        Where both clouds have colours, no rivals are tried: colours refute quarter turns, except in a room of
        one colour.

        Args:
            way: where the start pose came from.
            answer: the answer to check.
            tried: all registrations so far, at least one.
        """
        spread_m = self._spread_m(answer)
        if spread_m > self._most_m and self._scored_better(answer, tried) is None:
            return Checked(answer, (_apart(spread_m),), spread_m, undecided=bool(np.isfinite(spread_m)))
        return self.complete(way, answer, spread_m, tried)

    def complete(self, way: Way, answer: Candidate, spread_m: float, tried: Sequence[Candidate]) -> Checked:
        """Check an answer, or one nearby that fits better, with as many points as are needed.

        Args:
            way: where the start pose came from.
            answer: the answer to check.
            spread_m: distance of the poses of its draws of few points.
            tried: all registrations so far, at least one.
        """
        if (before := self._scored_better(answer, tried)) is not None:
            return Checked(answer, (self._rival_text(answer, before),), float("nan"))
        at = answer.T_target_source, answer.evidence
        slide = better_slide(self.source, self.target, *at, self.judge, self.config)
        if slide is not None:
            answer, spread_m = slide, self._spread_m(slide)
        answer, spread_m = self._repeated(answer, spread_m)
        doubts: tuple[str, ...] = ()
        if spread_m <= self._most_m and np.isnan(answer.evidence.color_correlation):
            best, doubts = self._unless_rivalled(way, answer)
            if best is not answer:
                answer, spread_m = best, self._spread_m(best)
        if spread_m > self._most_m:
            doubts = (*doubts, _apart(spread_m))
        return Checked(answer, doubts, spread_m, settled=spread_m <= self._most_m)

    def _repeated(self, answer: Candidate, spread_m: float) -> tuple[Candidate, float]:
        """Return an answer with as many points as make its draws agree closely, and its spread."""
        drawn = drawn_points(self.source, self.target, QUICK_POINTS)
        for points in MORE_POINTS:
            more = drawn_points(self.source, self.target, points)
            if more > drawn and self._close_m < spread_m < np.inf:
                answer, spread_m = self._with_more_points(answer, spread_m, points)
                drawn = more
        return answer, spread_m

    @property
    def _close_m(self) -> float:
        return CLOSE_VOXELS * default_voxel_m(self.target)

    @property
    def _most_m(self) -> float:
        return MOST_SPREAD_VOXELS * default_voxel_m(self.target)

    @property
    def _bare(self) -> bool:
        """Whether one of the clouds has no viewpoint, so that its free space cannot refute a pose."""
        return self.judge.source.view is None or self.judge.target.view is None

    def _with_more_points(self, answer: Candidate, spread_m: float, points: int) -> tuple[Candidate, float]:
        """Return the answer of a registration with more points, and its spread.

        The given answer and spread are returned if the new evidence is in doubt; the spread is infinite if
        the registration finds no pose.
        """
        try:
            T = self._again(answer, self.config.seed, points)
        except ReconstructionError:
            return answer, float("inf")
        better = replace(answer, T_target_source=T, evidence=self.judge(T))
        if not verdict_on(better.evidence, tried=True).sure:
            return answer, spread_m
        return better, self._spread_m(better, points)

    def _spread_m(self, answer: Candidate, points: int = QUICK_POINTS) -> float:
        """Return the largest point error between an answer and registrations of further draws of the points.

        They begin at its start pose, and also on both sides of an answer with little stiffness.
        """
        starts = [answer.T_start] * DRAWS
        if answer.evidence.stiffness < LITTLE_STIFFNESS:
            away_m = min(SIDE_VOXELS * default_voxel_m(self.target), SIDE_OF_GATE * answer.gate_m)
            starts += self.judge.both_sides(answer.T_target_source, away_m)
        some_m = compared_points_m(self.source)
        farthest_m = 0.0
        for seed, T_start in enumerate(starts, start=self.config.seed + 1):
            try:
                T = self._again(replace(answer, T_start=T_start), seed, points)
            except ReconstructionError:
                return float("inf")
            farthest_m = max(farthest_m, point_error_m(T, answer.T_target_source, some_m))
        return farthest_m

    def _again(self, answer: Candidate, seed: int, points: int) -> FloatArray:
        """Return the pose that another draw of the points leads to."""
        way = answer.T_start, answer.gate_m, answer.direction
        return quick_registration(self.source, self.target, *way, self.config, seed, points)

    def _unless_rivalled(self, way: Way, answer: Candidate) -> tuple[Candidate, tuple[str, ...]]:
        """Return the answer or the rival that fits clearly better, and a doubt if another one fits as well.

        Rivals are quarter turns. If the start was given and a cloud has no viewpoint, the poses to which
        features of the surfaces lead are rivals, too: half a room slid along the other half can fit almost as
        well.
        """
        clouds, T = (self.source, self.target), answer.T_target_source
        turns = quarter_turns(*clouds, T, 2.0 * answer.gate_m, self.judge, self.config)
        tried = [*turns, *(self._by_features() if way == "given" and self._bare else ())]
        others = [
            one
            for one in tried
            if verdict_on(one.evidence, tried=True).sure and not same(one.T_target_source, T, *clouds)
        ]
        best = min([answer, *others], key=lambda one: one.evidence.against_share)
        if not best.evidence.clearly_better(answer.evidence):
            best = answer
        rivals = [
            one
            for one in (answer, *others)
            if not best.evidence.clearly_better(one.evidence)
            and not same(one.T_target_source, best.T_target_source, *clouds)
        ]
        if not rivals:
            return best, ()
        return best, (self._rival_text(best, min(rivals, key=lambda one: one.evidence.against_share)),)

    def _scored_better(self, answer: Candidate, tried: Sequence[Candidate]) -> Candidate | None:
        """Return the tried registration with the best score if it led elsewhere than the answer."""
        if not self._bare:
            return None
        best = max(tried, key=lambda one: one.evidence.score)
        elsewhere = not same(best.T_target_source, answer.T_target_source, self.source, self.target)
        return best if elsewhere and best.evidence.score > answer.evidence.score else None

    def _by_features(self) -> Iterable[Candidate]:
        """Yield the candidates from the first start pose by surface features; none without one."""
        try:
            T_start = next(iter(by_surfaces(self.source, self.target).poses()))
        except ReconstructionError:
            return
        gates_m = default_gates_m(self.target, "surfaces", self.config.seed)
        yield from candidates(self.source, self.target, T_start, gates_m, self.judge, self.config)

    def _rival_text(self, answer: Candidate, rival: Candidate) -> str:
        poses = answer.T_target_source, rival.T_target_source
        turned_deg = turn_deg(*poses)
        apart_m = point_error_m(*poses, compared_points_m(self.source))
        turned = turned_deg >= LEAST_TURN_DEG
        how = f"turned by {turned_deg:.0f} degrees" if turned else f"{length(apart_m)} away"
        return f"{how}, the source fits as well"


def _apart(spread_m: float) -> str:
    """Return the doubt about an answer whose registrations are ``spread_m`` apart."""
    if np.isinf(spread_m):
        return "registered again, the source finds no pose"
    return f"registered again, the source ends up to {length(spread_m)} away"
