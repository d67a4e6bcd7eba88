"""Search for a pose: start poses in the order of their cost, until an answer is sure (SPEC 4.12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.registration.finding.candidates import Candidate, candidates
from pipeline.registration.finding.doubts import Checked, Checks
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.starts import Start, Way, default_gates_m
from pipeline.registration.finding.verdict import Verdict, verdict_on
from pipeline.types import PointCloud


@dataclass(frozen=True, slots=True)
class Found:
    """A pose with its evidence and verdict, and the way in which it was found."""

    way: Way
    candidate: Candidate
    verdict: Verdict
    tried: tuple[Candidate, ...]
    """All registrations that were compared, in their order."""
    spread_m: float = float("nan")
    """Largest point error between the pose and those of the registrations that checked it; infinite if one
    failed, NaN if the pose was in doubt before these."""
    settled: bool = False
    """Whether no other start can change the answer: it is sure, or in doubt only because of a rival."""
    undecided: bool = False
    """Whether its draws of few points disagree, so that more points may decide."""


def search(
    source: PointCloud,
    target: PointCloud,
    starts: Sequence[Start],
    judge: Judge,
    config: RegistrationConfig,
    gates_m: Sequence[float] = (),
) -> Found:
    """Register from each start with a few gates; return the first settled answer, else the best one.

    Rivals of a sure answer are tried too, such as its quarter turns; where one fits as well, the answer is
    doubtful, and the search ends. The best answer is that with the fewest doubts; of equal ones, that from a
    given start, then that with the best score.

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
    checks = Checks(source, target, judge, config)
    tried: list[Candidate] = []
    answers: list[Found] = []
    reason: ReconstructionError | None = None
    for start in starts:
        gates = gates_m or default_gates_m(target, start.way, config.seed)
        try:
            for T_start in start.poses():
                for candidate in candidates(source, target, T_start, gates, judge, config):
                    tried.append(candidate)
                    found = _found(start.way, candidate, tried, checks)
                    if found.settled:
                        return replace(found, tried=tuple(tried))
                    answers.append(found)
        except ReconstructionError as error:
            reason = error
    if not answers:
        raise reason or ReconstructionError(
            "No start pose leads to a registration: the clouds have too little in common, or the points of "
            "one leave the pose open; try a closer start pose, or clouds that show more of the place"
        )
    best = max(_decided(answers, tried, checks), key=_rank)
    return replace(best, tried=tuple(tried))


def _found(way: Way, candidate: Candidate, tried: Sequence[Candidate], checks: Checks) -> Found:
    """Return a candidate with its verdict, or a better one that its checks find."""
    if not verdict_on(candidate.evidence, tried=True).sure:
        return Found(way, candidate, verdict_on(candidate.evidence), ())
    return _of_check(way, checks(way, candidate, tried))


def _of_check(way: Way, checked: Checked) -> Found:
    """Return a checked answer with its verdict."""
    answer, doubts, spread_m, settled, undecided = checked
    verdict = verdict_on(answer.evidence, doubts, tried=settled)
    return Found(way, answer, verdict, (), spread_m, settled, undecided)


def _decided(answers: Sequence[Found], tried: Sequence[Candidate], checks: Checks) -> list[Found]:
    """Return the answers with the best undecided one, if there is one, after a complete check."""
    best = max((found for found in answers if found.undecided), key=_rank, default=None)
    if best is None:
        return list(answers)
    complete = _of_check(best.way, checks.complete(best.way, best.candidate, best.spread_m, tried))
    return [complete if found is best else found for found in answers]


def _rank(found: Found) -> tuple[bool, int, bool, float]:
    """Return the rank of an answer, larger if better: settled, few doubts, from a given start, its score."""
    few_doubts = -len(found.verdict.reasons)
    return found.settled, few_doubts, found.way == "given", found.candidate.evidence.score
