"""Quick registrations from a start pose: the poses to which they lead, each with its evidence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from packetmesh.errors import ReconstructionError
from pipeline.config import Direction, RegistrationConfig
from pipeline.registration.finding.evidence import Evidence, Judge
from pipeline.registration.loop import register
from pipeline.types import FloatArray, PointCloud

QUICK_POINTS = 5000
"""Largest number of points of each cloud in a quick registration."""
DRAWN_SHARE = 0.8
"""Largest share of the smaller cloud's points that is drawn, so that draws with other seeds differ."""
QUICK_DECAY = 0.92
"""Factor by which a quick registration's scale shrinks per iteration: slowly, so that the pose can follow."""
DIRECTIONS: tuple[Direction, ...] = ("p2q", "q2p")


@dataclass(frozen=True, slots=True)
class Candidate:
    """A pose that a quick registration led to."""

    T_start: FloatArray
    """(4, 4) start pose T_target_source."""
    T_target_source: FloatArray
    """(4, 4) final pose."""
    gate_m: float
    direction: Direction
    evidence: Evidence


def candidates(
    source: PointCloud,
    target: PointCloud,
    T_start: FloatArray,
    gates_m: Sequence[float],
    judge: Judge,
    config: RegistrationConfig,
) -> Iterator[Candidate]:
    """Register from a start pose with each gate, the smallest first, in both directions.

    For each gate it yields the direction with the better score; nothing if both fail.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        T_start: (4, 4) start pose T_target_source.
        gates_m: gates in ascending order, metres: upper limits of the start pose's error.
        judge: judge of these clouds.
        config: settings as for ``quick_registration``.
    """
    for gate_m in gates_m:
        both = []
        for direction in DIRECTIONS:
            try:
                T = quick_registration(source, target, T_start, gate_m, direction, config)
            except ReconstructionError:
                continue
            both.append(Candidate(T_start, T, gate_m, direction, judge(T)))
        if both:
            yield max(both, key=lambda candidate: candidate.evidence.score)


def quick_registration(
    source: PointCloud,
    target: PointCloud,
    T_start: FloatArray,
    gate_m: float,
    direction: Direction,
    config: RegistrationConfig,
    seed: int | None = None,
    points: int = QUICK_POINTS,
) -> FloatArray:
    """Return the (4, 4) pose that CEICP-A reaches from a start with few points.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        T_start: (4, 4) start pose T_target_source.
        gate_m: gate of the registration.
        direction: direction of the registration; with a scale, it is always ``both``.
        config: other settings; method, start, decay and number of points are replaced.
        seed: seed of the draw of points; None takes that of ``config``.
        points: largest number of points of each cloud.

    Raises:
        ReconstructionError: no pairs are within the gate, or they leave the motion open from the beginning.
    """
    quick = replace(
        config,
        method="ceicp-a",
        start="given",
        gate_m=gate_m,
        direction="both" if config.with_scale else direction,
        sigma_decay=QUICK_DECAY,
        max_points=drawn_points(source, target, points),
        seed=config.seed if seed is None else seed,
    )
    result = register(source, target, quick, T_start)
    if not result.steps:
        raise ReconstructionError(result.stop_reason)
    return result.T_target_source


def drawn_points(source: PointCloud, target: PointCloud, points: int) -> int:
    """Return the number of points that are drawn from each cloud: ``points``, or fewer from small clouds."""
    return min(points, max(6, int(DRAWN_SHARE * min(len(source), len(target)))))
