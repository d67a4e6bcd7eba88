"""Other people's registration programs behind one call, as baselines for ours (SPEC 4.6).

Open3D comes with PacketMesh; small_gicp and pycpd take part where they are installed. Every peer gets
the same points, start pose and gate, finds its normals, covariances and trees by itself, and that counts
in its time. None of them thins the clouds, except CPD.
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
"""Neighbours of a point for its normal or covariance, as in our plane metric."""
CPD_POINTS = 1500
"""CPD compares every point with every other: more would take minutes."""
CPD_OUTLIERS = 0.2
"""Share of the points that CPD takes for outliers (w0 of SPEC 4.4)."""
STAGES_M = (0.1, 0.06)
"""Last gates of the staged peers, after T_d and T_d / 2 (SPEC 4.6)."""
RELATIVE_TOLERANCE = 1e-6
"""Open3D's default: changes of fitness and RMSE below it end its loop."""
MOTION_TOLERANCE = 1e-4
"""small_gicp stops at a step below this many radians and metres, as our loop does."""
_NO_PAIRS = "degenerate: no pairs within the gate"


@dataclass(frozen=True, slots=True)
class PeerResult:
    """What a peer found, and how long it took."""

    T_target_source: FloatArray
    """(4, 4)."""
    iterations: int | None
    """None where the program does not report it."""
    elapsed_s: float
    """From points to pose, preparation included, imports not."""
    stop_reason: str


@dataclass(frozen=True, slots=True)
class Problem:
    """What every peer gets."""

    source_m: FloatArray
    """(N, 3)."""
    target_m: FloatArray
    """(M, 3)."""
    gate_m: float
    T_init: FloatArray
    max_iterations: int


Outcome = tuple[FloatArray, int | None, str]
"""T_target_source, iterations where known, stop reason."""


@dataclass(frozen=True, slots=True)
class Peer:
    """Another program's method."""

    module: str
    """What must be importable."""
    solve: Callable[[Problem], Outcome]


def available_peers() -> tuple[str, ...]:
    """Names of the peers whose programs are installed."""
    return tuple(name for name, peer in PEERS.items() if find_spec(peer.module) is not None)


def run_peer(
    name: str,
    source: PointCloud,
    target: PointCloud,
    gate_m: float,
    T_init: FloatArray | None = None,
    max_iterations: int = 100,
) -> PeerResult:
    """Register ``source`` to ``target`` with one peer, all points of both.

    Args:
        name: one of ``available_peers()``.
        source: the cloud that moves; only its points are used.
        target: the cloud that stays.
        gate_m: largest distance of a pair (first one of the staged peers; CPD has none).
        T_init: (4, 4) start pose T_target_source; None is the identity.
        max_iterations: in total, shared by the stages of the staged peers one after the other.

    Raises:
        InputError: no such peer here, fewer than three points or points that are not finite.
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
    """One of Open3D's loops; it tells neither its iterations nor why it stopped."""
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
    """Voxels as wide as the gate: a smaller voxel would be a smaller gate."""
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
    """small_gicp with the gate T_d, or with T_d, T_d / 2, 0.1 m, 0.06 m from the pose of the one before."""
    gates_m = {problem.gate_m}
    if staged:
        gates_m |= {0.5 * problem.gate_m, *(m for m in STAGES_M if m < problem.gate_m)}
    T, iterations, reason = problem.T_init, 0, "max_iterations"
    for gate_m in sorted(gates_m, reverse=True):
        limits = {
            "num_threads": _threads(),
            "max_iterations": max(1, problem.max_iterations - iterations),
            "rotation_epsilon": MOTION_TOLERANCE,
            "translation_epsilon": MOTION_TOLERANCE,
        }
        result = align(T, gate_m, limits)
        if not result.num_inliers:
            return T, iterations, _NO_PAIRS
        T, iterations = result.T_target_source, iterations + result.iterations
        reason = "converged" if result.converged else "max_iterations"
    return T, iterations, reason


def _threads() -> int:
    return os.cpu_count() or 1


def _cpd(problem: Problem) -> Outcome:
    """Coherent point drift (Myronenko & Song 2010) by pycpd, which solves for a scale as well; kept rigid."""
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
    """pycpd's solver with its scale held at one; the formulas of Myronenko & Song, fig. 2, for s = 1."""

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
"""Every peer by name, installed or not: Open3D's ICP and GICP, small_gicp's GICP and VGICP, both also in
stages, and pycpd's CPD. Their gates are hard; CPD has none."""
