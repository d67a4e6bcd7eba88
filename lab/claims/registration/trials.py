"""A trial of the benchmark: a condition in a room, registered by every entrant from the same start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from lab.claims.registration.cases import Case, Condition, make_case, partnered, random_subset
from lab.claims.registration.entrants import PIXEL_PAIRS, Entrant, Lineup
from lab.claims.registration.pixel_pairs import pixel_pair_poses
from packetmesh.errors import PacketMeshError
from pipeline.config import Direction
from pipeline.kernels.geometry import apply, inverse
from pipeline.registration import register_timed
from pipeline.registration.peers import run_peer
from pipeline.surface.voxel import voxel_average
from pipeline.types import FloatArray, PointCloud

AHD_VOXEL_M = 0.01
"""Spacing to which both clouds are thinned before their distance is measured (SPEC 4.7). With 8 cm the
distance is already 4 to 5 cm at the true pose, and an error of 2 cm adds only 0.6 cm (SPEC 4.10)."""
AHD_POINTS = 4000
"""Most points of the overlap, in each cloud, over which the distance is averaged."""
CURVE_ITERATIONS = (0, 1, 2, 3, 5, 8, 12, 20, 32, 50, 100)
"""Iterations at which curves have the average Hausdorff distance; the point error is at all iterations."""
DIGITS = 6
"""Stored decimals of a centimetre, far below any relevant difference."""


@dataclass(frozen=True, slots=True)
class CaseTask:
    """One trial: everything that its result depends on."""

    condition: Condition
    room: int
    """Seed of ``box_room``."""
    lineup: Lineup
    max_points: int
    """Largest number of points of each cloud; all entrants get the same random subset."""
    curved: tuple[str, ...] = ()
    """Names of the entrants whose error after every iteration is also recorded."""


@dataclass(frozen=True, slots=True)
class Run:
    """An entrant's poses on a case, starting with the start pose."""

    poses: tuple[FloatArray, ...]
    iterations: int | None
    """None if another program does not report them, or if the entrant could not begin."""
    elapsed_s: tuple[float, ...]
    """Time from the clouds to the end of each iteration; another program has one value, pixel pairs none."""
    stop_reason: str


class Ruler:
    """Measures poses of one case against the truth and against the clouds."""

    def __init__(self, case: Case) -> None:
        self._T_true = case.T_true
        homogeneous = np.c_[case.source.points_m, np.ones(len(case.source))]
        self._moments_m2 = homogeneous.T @ homogeneous / len(homogeneous)
        source, target = (voxel_average(cloud, AHD_VOXEL_M) for cloud in (case.source, case.target))
        self._source_m = _overlapping_m(source, target, case.T_true)
        self._target_m = _overlapping_m(target, source, inverse(case.T_true))
        self._source_tree, self._target_tree = cKDTree(source.points_m), cKDTree(target.points_m)

    def point_error_cm(self, T: FloatArray) -> float:
        """Return ``point_error_m`` in cm, from the second moments of all source points."""
        difference = (T - self._T_true)[:3]
        squared_m2 = np.trace(difference @ self._moments_m2 @ difference.T)
        return round(100.0 * float(np.sqrt(max(squared_m2, 0.0))), DIGITS)

    def ahd_cm(self, T: FloatArray) -> float:
        """Return the average Hausdorff distance in cm over points with a partner at the true pose."""
        onto_m = self._target_tree.query(apply(T, self._source_m))[0].mean()
        back_m = self._source_tree.query(apply(inverse(T), self._target_m))[0].mean()
        return round(50.0 * float(onto_m + back_m), DIGITS)


def _overlapping_m(cloud: PointCloud, other: PointCloud, T_true: FloatArray) -> FloatArray:
    """Return (N, 3) points with a partner at the true pose: at most ``AHD_POINTS``, drawn at random."""
    return random_subset(cloud.select(partnered(cloud, other, T_true)), AHD_POINTS, 0).points_m


def run_case(task: CaseTask) -> list[dict[str, Any]]:
    """Return the results of every entrant of the lineup on the same points from the same start, as plain
    values.

    All but the times are reproducible bit by bit. ``k90`` is the number of iterations until 90 % of the
    error's drop, None without a drop or for another program. Curves are empty unless requested:
    ``curve_error_cm`` is the point error after 0, 1, ... iterations, ``curve_ahd_cm`` the average Hausdorff
    distance after each of ``CURVE_ITERATIONS``, the last one repeated, and ``elapsed_s`` the time from the
    clouds to the end of each iteration, trees and normals included.
    """
    case = make_case(task.condition, task.room)
    ruler, thinned = Ruler(case), case.thinned(task.max_points)
    trials = []
    for direction, entrant in task.lineup:
        run = run_entrant(entrant, thinned, direction, task.condition.gate_m)
        errors_cm = [ruler.point_error_cm(T) for T in run.poses]
        is_curve = direction == "q2p" and entrant.name in task.curved
        trials.append(
            {
                "condition": task.condition.name,
                "room": task.room,
                "direction": direction,
                "entrant": entrant.name,
                "point_error_cm": errors_cm[-1],
                "ahd_cm": ruler.ahd_cm(run.poses[-1]),
                "iterations": run.iterations,
                "k90": None if entrant.is_peer else k90(errors_cm),
                "stop_reason": run.stop_reason,
                "start_error_cm": errors_cm[0],
                "overlap": round(case.overlap, DIGITS),
                "curve_error_cm": errors_cm if is_curve else [],
                "curve_ahd_cm": _ahd_curve(ruler, run.poses) if is_curve else [],
                "elapsed_s": [round(s, DIGITS) for s in run.elapsed_s] if is_curve else [],
            }
        )
    return trials


def run_entrant(entrant: Entrant, case: Case, direction: Direction, gate_m: float) -> Run:
    """Return all poses of one entrant; if it cannot begin, only the start, with the reason as stop reason."""
    try:
        if entrant.is_peer:
            return _run_peer(entrant, case, direction, gate_m)
        if entrant.method == PIXEL_PAIRS:
            poses = pixel_pair_poses(case.source, case.target)
            return Run((case.T_init, *poses), len(poses), (), "converged")
        config = entrant.config(direction, gate_m, max(len(case.source), len(case.target)))
        result, elapsed_s = register_timed(
            case.source, case.target, config, case.T_init, method=entrant.start()
        )
    except PacketMeshError as error:
        return Run((case.T_init,), None, (), f"refused: {error}")
    poses = (case.T_init, *(step.T_target_source for step in result.steps))
    return Run(poses, len(result.steps), tuple(elapsed_s.tolist()), result.stop_reason)


def _run_peer(entrant: Entrant, case: Case, direction: Direction, gate_m: float) -> Run:
    """Run another program; in the reverse direction it registers the target to the source."""
    gate_m = entrant.scaled_gate_m(gate_m)
    if direction == "p2q":
        found = run_peer(entrant.method, case.target, case.source, gate_m, inverse(case.T_init))
        T = inverse(found.T_target_source)
    else:
        found = run_peer(entrant.method, case.source, case.target, gate_m, case.T_init)
        T = found.T_target_source
    return Run((case.T_init, T), found.iterations, (found.elapsed_s,), found.stop_reason)


def k90(errors: Sequence[float]) -> int | None:
    """Return the iterations until 90 % of the drop from the first to the last error; None without a drop."""
    drop = errors[0] - errors[-1]
    if drop <= 0:
        return None
    return next(k for k, error in enumerate(errors) if error <= errors[0] - 0.9 * drop)


def _ahd_curve(ruler: Ruler, poses: Sequence[FloatArray]) -> list[float]:
    values = {k: ruler.ahd_cm(poses[k]) for k in CURVE_ITERATIONS if k < len(poses)}
    last = ruler.ahd_cm(poses[-1])
    return [values.get(k, last) for k in CURVE_ITERATIONS]
