"""Registration methods of other libraries as baselines, with one common interface (SPEC 4.6).

Open3D is installed with PacketMesh; small_gicp and pycpd are used if they are installed. Every peer gets
the same points, start pose and gate, and computes its own normals, covariances and trees, which count in
its time. Only CPD thins the clouds.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, rigid
from pipeline.kernels.open3d_runtime import o3d
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud

o3d_registration: Any = o3d.pipelines.registration
NEIGHBOURS = 20
"""Number of neighbours for a point's normal or covariance, as in our plane metric for small clouds; Open3D's
GICP takes its own."""
CPD_POINTS = 1500
"""Number of points of each cloud for CPD, which compares all pairs: more would take minutes."""
CPD_OUTLIERS = 0.2
"""Outlier share that CPD assumes (w0 of SPEC 4.4)."""
STAGES_M = (0.1, 0.06)
"""Last gates of the staged peers, after T_d and T_d / 2 (SPEC 4.6)."""
RELATIVE_TOLERANCE = 1e-6
"""Open3D's default: its loop stops when fitness and RMSE change by less."""
MOTION_TOLERANCE = 1e-4
"""small_gicp stops at a step below this many radians and metres, like our loop."""
_NO_PAIRS = "degenerate: no pairs within the gate"


@dataclass(frozen=True, slots=True)
class PeerResult:
    """Pose and run time of a peer's registration."""

    T_target_source: FloatArray
    """(4, 4) final pose."""
    iterations: int | None
    """Number of iterations; None if the library does not report it."""
    elapsed_s: float
    """Time from points to pose, including preparation, excluding imports."""
    stop_reason: str


@dataclass(frozen=True, slots=True)
class Problem:
    """Input of every peer."""

    source_m: FloatArray
    """(N, 3) points that move."""
    target_m: FloatArray
    """(M, 3) points that stay."""
    gate_m: float
    T_init: FloatArray
    max_iterations: int


Outcome = tuple[FloatArray, int | None, str]
"""T_target_source, iterations where known, stop reason."""


@dataclass(frozen=True, slots=True)
class Peer:
    """A registration method of another library."""

    module: str
    """Name of the library's module."""
    solve: Callable[[Problem], Outcome]


def available_peers() -> tuple[str, ...]:
    """Return the names of the peers whose libraries are installed."""
    return tuple(name for name, peer in PEERS.items() if find_spec(peer.module) is not None)


def run_peer(
    name: str,
    source: PointCloud,
    target: PointCloud,
    gate_m: float,
    T_init: FloatArray | None = None,
    max_iterations: int = 100,
) -> PeerResult:
    """Register ``source`` to ``target`` with one peer, using all points of both.

    Args:
        name: one of ``available_peers()``.
        source: the cloud that moves; only its points are used.
        target: the cloud that stays.
        gate_m: largest distance of a pair (in the first stage of the staged peers; CPD has none).
        T_init: (4, 4) start pose T_target_source; None is the identity.
        max_iterations: total number of iterations of all stages.

    Raises:
        InputError: the peer is not available, fewer than three points or points that are not finite.
    """
    if name not in available_peers():
        raise InputError(f"There is no peer '{name}' here; try one of {', '.join(available_peers())}")
    whole = max(len(source), len(target))
    problem = Problem(
        draw(source, whole, 0, "source").points_m,
        draw(target, whole, 0, "target").points_m,
        gate_m,
        np.eye(4) if T_init is None else np.asarray(T_init, dtype=np.float64),
        max_iterations,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SyntaxWarning)  # pycpd's source compares numbers with "is not"
        import_module(PEERS[name].module)  # before the clock starts
    started = time.perf_counter()
    T, iterations, reason = PEERS[name].solve(problem)
    return PeerResult(np.array(T), iterations, time.perf_counter() - started, reason)


def _open3d(problem: Problem, estimation: str) -> Outcome:
    """Run one of Open3D's methods, which report neither the iterations nor the stop reason."""
    source, target = (
        o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points_m))
        for points_m in (problem.source_m, problem.target_m)
    )
    register = o3d_registration.registration_icp
    if estimation == "ForGeneralizedICP":
        register = o3d_registration.registration_generalized_icp
    if estimation == "PointToPlane":
        target.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    criteria = o3d_registration.ICPConvergenceCriteria(
        RELATIVE_TOLERANCE, RELATIVE_TOLERANCE, problem.max_iterations
    )
    solver = getattr(o3d_registration, f"TransformationEstimation{estimation}")()
    result = register(source, target, problem.gate_m, problem.T_init, solver, criteria)
    return result.transformation, None, "finished" if result.fitness > 0 else _NO_PAIRS


def _small_gicp(problem: Problem, staged: bool) -> Outcome:
    import small_gicp

    clouds = [small_gicp.PointCloud(points_m) for points_m in (problem.source_m, problem.target_m)]
    trees = [small_gicp.KdTree(cloud, num_threads=_threads()) for cloud in clouds]
    for cloud, tree in zip(clouds, trees, strict=True):
        small_gicp.estimate_covariances(cloud, tree, NEIGHBOURS, _threads())

    def align(T: FloatArray, gate_m: float, limits: dict[str, Any]) -> Any:
        return small_gicp.align(
            clouds[1], clouds[0], trees[1], T, "GICP", max_correspondence_distance=gate_m, **limits
        )

    return _in_stages(problem, staged, align)


def _small_vgicp(problem: Problem, staged: bool) -> Outcome:
    """Run small_gicp's VGICP with voxels as wide as the gate: smaller ones would act as a smaller gate."""
    import small_gicp

    source, target = (small_gicp.PointCloud(points) for points in (problem.source_m, problem.target_m))
    for cloud in (source, target):
        small_gicp.estimate_covariances(cloud, small_gicp.KdTree(cloud), NEIGHBOURS, _threads())

    def align(T: FloatArray, gate_m: float, limits: dict[str, Any]) -> Any:
        voxels = small_gicp.GaussianVoxelMap(gate_m)
        voxels.insert(target)
        return small_gicp.align(voxels, source, T, max_correspondence_distance=gate_m, **limits)

    return _in_stages(problem, staged, align)


def _in_stages(
    problem: Problem, staged: bool, align: Callable[[FloatArray, float, dict[str, Any]], Any]
) -> Outcome:
    """Run small_gicp with the gate T_d, or in stages with T_d, T_d / 2, 0.1 m and 0.06 m.

    It counts its iterations from zero, so ``result.iterations`` is the number of the last one.
    """
    gates_m = {problem.gate_m}
    if staged:
        gates_m |= {0.5 * problem.gate_m, *(m for m in STAGES_M if m < problem.gate_m)}
    T, iterations, reason = problem.T_init, 0, "max_iterations"
    for gate_m in sorted(gates_m, reverse=True):
        if iterations == problem.max_iterations:
            return T, iterations, "max_iterations"
        limits = {
            "num_threads": _threads(),
            "max_iterations": problem.max_iterations - iterations,
            "rotation_epsilon": MOTION_TOLERANCE,
            "translation_epsilon": MOTION_TOLERANCE,
        }
        result = align(T, gate_m, limits)
        if not result.num_inliers:
            return T, iterations, _NO_PAIRS
        T, iterations = result.T_target_source, iterations + result.iterations + 1
        reason = "converged" if result.converged else "max_iterations"
    return T, iterations, reason


def _threads() -> int:
    return os.cpu_count() or 1


def _cpd(problem: Problem) -> Outcome:
    """Run pycpd's coherent point drift (Myronenko & Song 2010), restricted to rigid motions."""
    from pycpd import RigidRegistration

    source_m, target_m = (
        draw(PointCloud(points_m), CPD_POINTS, 0, "cloud").points_m
        for points_m in (apply(problem.T_init, problem.source_m), problem.target_m)
    )
    center_m = target_m.mean(axis=0)
    solver = _rigid_cpd(RigidRegistration)(
        X=target_m - center_m, Y=source_m - center_m, w=CPD_OUTLIERS, max_iterations=problem.max_iterations
    )
    solver.register()
    rotation = solver.R.T
    motion = rigid(rotation, np.ravel(solver.t) + center_m - rotation @ center_m)
    reason = "max_iterations" if solver.iteration >= problem.max_iterations else "converged"
    return motion @ problem.T_init, solver.iteration, reason


def _rigid_cpd(base: Any) -> Any:
    """Return pycpd's solver class with a scale of one (Myronenko & Song, fig. 2, for s = 1)."""

    class RigidCpd(base):
        s: float
        t: FloatArray

        def update_transform(self) -> None:
            super().update_transform()
            target_mean = (self.X - self.X_hat)[0]
            self.t = target_mean - (target_mean - self.t) / self.s
            self.s = 1.0

        def update_variance(self) -> None:
            super().update_variance()
            spread = self.Pt1 @ np.sum(self.X_hat**2, axis=1)
            total = spread - 2.0 * np.trace(self.A @ self.R) + self.YPY
            self.sigma2 = max(total / (self.Np * self.D), np.finfo(float).eps)

    return RigidCpd


PEERS: dict[str, Peer] = {
    "open3d-point": Peer("open3d", partial(_open3d, estimation="PointToPoint")),
    "open3d-plane": Peer("open3d", partial(_open3d, estimation="PointToPlane")),
    "open3d-gicp": Peer("open3d", partial(_open3d, estimation="ForGeneralizedICP")),
    "small-gicp": Peer("small_gicp", partial(_small_gicp, staged=False)),
    "small-vgicp": Peer("small_gicp", partial(_small_vgicp, staged=False)),
    "small-gicp-staged": Peer("small_gicp", partial(_small_gicp, staged=True)),
    "small-vgicp-staged": Peer("small_gicp", partial(_small_vgicp, staged=True)),
    "cpd": Peer("pycpd", _cpd),
}
"""All peers by name, installed or not: Open3D's ICP and GICP, small_gicp's GICP and VGICP, both also in
stages, and pycpd's CPD. Their gates are hard; CPD has none."""
