"""One task of the benchmark: a condition in a room, done by every entrant from the same start."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lab.claims.registration.cases import Case, Condition
from lab.claims.registration.entrants import Entrant
from packetmesh.errors import PacketMeshError
from pipeline.config import Direction
from pipeline.geometry import apply, inverse
from pipeline.registration import register_timed, rotation_error_rad
from pipeline.registration.peers import run_peer
from pipeline.surface import voxel_average
from pipeline.types import FloatArray

SUCCESS_CM = 2.0
AHD_VOXEL_M = 0.08
"""Both clouds are thinned to this spacing before their distance is taken (SPEC 4.7)."""
CURVE_ITERATIONS = (0, 1, 2, 3, 5, 8, 12, 20, 32, 50, 100)
"""Where the convergence curves have the average Hausdorff distance; the point error they have everywhere."""
DIGITS = 6
"""Decimals of a centimetre that are kept: far below any difference that matters."""


@dataclass(frozen=True, slots=True)
class Trial:
    """How one entrant did on one case; deterministic."""

    condition: str
    room: int
    direction: Direction
    entrant: str
    point_error_cm: float
    ahd_cm: float
    rotation_error_deg: float
    success: bool
    """Point error below 2 cm."""
    iterations: int | None
    k90: int | None
    """Iterations until 90 % of the error's drop; None without a drop, or where a program does not tell."""
    stop_reason: str
    start_error_cm: float
    overlap: float
    curve_error_cm: tuple[float, ...] = ()
    """Point error after 0, 1, ... iterations; empty where curves are not asked for."""
    curve_ahd_cm: tuple[float, ...] = ()
    """Average Hausdorff distance after each of ``CURVE_ITERATIONS``, the last one held."""


@dataclass(frozen=True, slots=True)
class Timing:
    """How long that trial took; not deterministic."""

    seconds: float
    """From clouds to pose, trees and normals included."""
    elapsed_s: tuple[float, ...] = ()
    """Until the end of each iteration, where curves are asked for."""


@dataclass(frozen=True, slots=True)
class Run:
    """An entrant's poses on a case, the start first."""

    poses: tuple[FloatArray, ...]
    iterations: int | None
    elapsed_s: tuple[float, ...]
    stop_reason: str


class Ruler:
    """Measures poses of one case against the truth and against the clouds."""

    def __init__(self, case: Case) -> None:
        self._T_true = case.T_true
        homogeneous = np.c_[case.source.points_m, np.ones(len(case.source))]
        self._moments_m2 = homogeneous.T @ homogeneous / len(homogeneous)
        self._source_m, self._target_m = (
            voxel_average(cloud, AHD_VOXEL_M).points_m for cloud in (case.source, case.target)
        )
        self._source_tree, self._target_tree = cKDTree(self._source_m), cKDTree(self._target_m)

    def point_error_cm(self, T: FloatArray) -> float:
        """As ``point_error_m``, by the second moments of all source points."""
        difference = (T - self._T_true)[:3]
        squared_m2 = np.trace(difference @ self._moments_m2 @ difference.T)
        return round(100.0 * float(np.sqrt(max(squared_m2, 0.0))), DIGITS)

    def ahd_cm(self, T: FloatArray) -> float:
        """As ``average_hausdorff_m`` of the thinned clouds, with trees that stay."""
        onto_m = self._target_tree.query(apply(T, self._source_m))[0].mean()
        back_m = self._source_tree.query(apply(inverse(T), self._target_m))[0].mean()
        return round(50.0 * float(onto_m + back_m), DIGITS)


def run_task(
    case: Case,
    condition: Condition,
    room: int,
    lineup: Sequence[tuple[Direction, Entrant]],
    max_points: int,
    curved: Container[str] = (),
) -> tuple[list[Trial], list[Timing]]:
    """Every entrant of the lineup on the same points from the same start.

    Args:
        case: the whole clouds.
        condition: where the case comes from.
        room: its number.
        lineup: who takes part, and in which direction.
        max_points: both clouds are thinned to this many points for all entrants alike.
        curved: names of the entrants whose error after every iteration is recorded as well.
    """
    ruler, thinned = Ruler(case), case.thinned(max_points)
    trials, timings = [], []
    for direction, entrant in lineup:
        run = run_entrant(entrant, thinned, direction, condition.gate_m)
        errors_cm = [ruler.point_error_cm(T) for T in run.poses]
        T, is_curve = run.poses[-1], direction == "q2p" and entrant.name in curved
        trials.append(
            Trial(
                condition.name,
                room,
                direction,
                entrant.name,
                point_error_cm=errors_cm[-1],
                ahd_cm=ruler.ahd_cm(T),
                rotation_error_deg=round(float(np.degrees(rotation_error_rad(T, case.T_true))), DIGITS),
                success=errors_cm[-1] < SUCCESS_CM,
                iterations=run.iterations,
                k90=None if entrant.is_peer else k90(errors_cm),
                stop_reason=run.stop_reason,
                start_error_cm=errors_cm[0],
                overlap=round(case.overlap, DIGITS),
                curve_error_cm=tuple(errors_cm) if is_curve else (),
                curve_ahd_cm=_ahd_curve(ruler, run.poses) if is_curve else (),
            )
        )
        elapsed_s = tuple(round(s, DIGITS) for s in run.elapsed_s)
        timings.append(Timing(elapsed_s[-1] if elapsed_s else 0.0, elapsed_s if is_curve else ()))
    return trials, timings


def run_entrant(entrant: Entrant, case: Case, direction: Direction, gate_m: float) -> Run:
    """All poses of one entrant; who refuses or cannot begin stays at the start, and says why."""
    try:
        if entrant.is_peer:
            return _run_peer(entrant, case, direction, gate_m)
        config = entrant.config(direction, gate_m, max(len(case.source), len(case.target)))
        result, elapsed_s = register_timed(
            case.source, case.target, config, case.T_init, method=entrant.start()
        )
    except PacketMeshError as error:
        return Run((case.T_init,), None, (), f"refused: {error}")
    poses = (case.T_init, *(step.T_target_source for step in result.steps))
    return Run(poses, len(result.steps), tuple(elapsed_s.tolist()), result.stop_reason)


def _run_peer(entrant: Entrant, case: Case, direction: Direction, gate_m: float) -> Run:
    """Another program; asked the other way round, it registers the target to the source."""
    gate_m = entrant.scaled_gate_m(gate_m)
    if direction == "p2q":
        found = run_peer(entrant.method, case.target, case.source, gate_m, inverse(case.T_init))
        T = inverse(found.T_target_source)
    else:
        found = run_peer(entrant.method, case.source, case.target, gate_m, case.T_init)
        T = found.T_target_source
    return Run((case.T_init, T), found.iterations, (found.elapsed_s,), found.stop_reason)


def k90(errors: Sequence[float]) -> int | None:
    """Iterations until nine tenths of the way from the first error to the last; None if it did not fall."""
    drop = errors[0] - errors[-1]
    if drop <= 0:
        return None
    return next(k for k, error in enumerate(errors) if error <= errors[0] - 0.9 * drop)


def _ahd_curve(ruler: Ruler, poses: Sequence[FloatArray]) -> tuple[float, ...]:
    values = {k: ruler.ahd_cm(poses[k]) for k in CURVE_ITERATIONS if k < len(poses)}
    last = ruler.ahd_cm(poses[-1])
    return tuple(values.get(k, last) for k in CURVE_ITERATIONS)
