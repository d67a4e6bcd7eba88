"""The loop of all iterative closest-point methods: match, weigh, move, until the pose converges."""

from __future__ import annotations

import math
import time
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import drain
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply, rotation_angle_rad
from pipeline.kernels.kdtree import compiled
from pipeline.registration.anderson import Acceleration
from pipeline.registration.finding.poses import length
from pipeline.registration.global_start import global_start
from pipeline.registration.matching import Matcher, Matches, Matching
from pipeline.registration.methods import METHODS, MethodStart
from pipeline.registration.residual import DegenerateError, residual_for
from pipeline.registration.sample import Sample, draw
from pipeline.registration.stop import TRANSLATION_TOLERANCE_OF_GATE, StopRule
from pipeline.registration.weighting import PairWeighting, PairWeights
from pipeline.types import FloatArray, IntArray, PointCloud, RegistrationResult, RegistrationStep

MIN_PAIRS = 6
MIN_EFFECTIVE_PAIRS = 10.0


def iterate_registration(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    T_init: FloatArray | None = None,
    method: MethodStart | None = None,
) -> Generator[RegistrationStep, None, str]:
    """Register ``source`` to ``target``; yields each iteration's step and returns the stop reason.

    It is ``converged``, ``stalled``, ``max_iterations``, or ``degenerate:`` and the reason in a few words.

    Args:
        source: the cloud that moves, (N, 3) points in its own frame, metres.
        target: the cloud that stays, (M, 3); the plane metric uses its ``normals`` when it has them.
        config: method, metric, direction and their parameters.
        T_init: (4, 4) start pose T_target_source; None is the identity. With ``config.start="global"``
            matched features give the start pose instead.
        method: replaces the config's method, for experiments.

    Raises:
        InputError: fewer than three points, points that are not finite, an invalid start pose, or a method
            that cannot use the clouds (hicp without colours, ceicp-literal in metres).
        ReconstructionError: no pair is within the gate at the start pose, or no start pose was found.

    >>> import numpy as np, packetmesh as pm
    >>> source = pm.PointCloud(np.random.default_rng(0).uniform(0.0, 1.0, (500, 3)))
    >>> target = pm.PointCloud(source.points_m + [0.02, 0.0, 0.0])
    >>> steps = list(pm.iterate_registration(source, target, pm.RegistrationConfig("icp", "point")))
    >>> steps[-1].rmse_m < 1e-6 < steps[0].rmse_m
    True
    """
    T = _start_pose(source, target, config, T_init)
    return _iterations(
        draw(source, config.max_points, config.seed, "source"),
        draw(target, config.max_points, config.seed, "target"),
        config,
        T,
        method or METHODS[config.method],
    )


def register(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    T_init: FloatArray | None = None,
    method: MethodStart | None = None,
) -> RegistrationResult:
    """Register ``source`` to ``target``: all steps of ``iterate_registration`` and the final pose.

    Args:
        source, target, config, T_init, method: as for ``iterate_registration``.

    Returns:
        The (4, 4) T_target_source in metres, with its steps; ``converged`` is also True for ``stalled``. If
        the pairs become degenerate, the last good pose is returned.

    Raises:
        InputError, ReconstructionError: as for ``iterate_registration``.

    >>> import numpy as np, packetmesh as pm
    >>> source = pm.PointCloud(np.random.default_rng(0).uniform(0.0, 1.0, (500, 3)))
    >>> target = pm.PointCloud(source.points_m + [0.02, 0.0, 0.0])
    >>> result = pm.register(source, target, pm.RegistrationConfig("ceicp-a", "point"))
    >>> result.converged, bool(np.allclose(result.T_target_source[:3, 3], [0.02, 0.0, 0.0], atol=1e-3))
    (True, True)
    """
    return register_timed(source, target, config, T_init, method)[0]


def register_timed(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    T_init: FloatArray | None = None,
    method: MethodStart | None = None,
) -> tuple[RegistrationResult, FloatArray]:
    """Register as ``register`` does, and measure the time.

    Returns:
        The deterministic result, and (K,) seconds from the call to the end of each step.
    """
    started = time.perf_counter()
    steps: list[RegistrationStep] = []
    elapsed_s: list[float] = []

    def keep(step: RegistrationStep) -> None:
        steps.append(step)
        elapsed_s.append(time.perf_counter() - started)

    T = _start_pose(source, target, config, T_init)
    reason = drain(iterate_registration(source, target, replace(config, start="given"), T, method), keep)
    if steps:
        T = steps[-1].T_target_source
    result = RegistrationResult(T, tuple(steps), reason in ("converged", "stalled"), reason)
    return result, np.array(elapsed_s)


def _start_pose(
    source: PointCloud, target: PointCloud, config: RegistrationConfig, T_init: FloatArray | None
) -> FloatArray:
    """Return the (4, 4) T_target_source of the first matching."""
    if config.start == "global":
        return global_start(source, target)
    T = np.eye(4) if T_init is None else np.array(T_init, dtype=np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise InputError("The start pose must be a 4 x 4 matrix of finite numbers.")
    return T


def _iterations(
    source: Sample, target: Sample, config: RegistrationConfig, T: FloatArray, start: MethodStart
) -> Generator[RegistrationStep, None, str]:
    method = start(config, source.cloud, target.cloud)
    direction, with_normals = method.direction or config.direction, method.facing and config.metric == "plane"
    matcher = Matcher(source.cloud, target.cloud, direction, method.features, with_normals)
    return _moved_until_still(method, matcher, source, target, config, T)


def iterate_matched(
    matcher: Matches, source: Sample, target: Sample, config: RegistrationConfig, T_init: FloatArray
) -> Generator[RegistrationStep, None, str]:
    """Register like ``iterate_registration``, with pairs that another matcher finds.

    Args:
        matcher: finds the pairs; their rows are those of the samples' points.
        source: all points that the matcher knows of the cloud that moves.
        target: the same of the cloud that stays.
        config: method, metric and their parameters.
        T_init: (4, 4) start pose T_target_source.

    Raises:
        ReconstructionError: no pair is within the gate at the start pose.
    """
    method = METHODS[config.method](config, source.cloud, target.cloud)
    return _moved_until_still(method, matcher, source, target, config, T_init)


def _moved_until_still(
    method: PairWeighting,
    matcher: Matches,
    source: Sample,
    target: Sample,
    config: RegistrationConfig,
    T: FloatArray,
) -> Generator[RegistrationStep, None, str]:
    residual = residual_for(config, matcher, method.unweighted_centroids)
    stop = StopRule(TRANSLATION_TOLERANCE_OF_GATE * config.gate_m)
    acceleration = Acceleration(apply(T, source.points_m)) if method.accelerated else None
    center_m = source.points_m.mean(axis=0, keepdims=True)
    for index in range(config.max_iterations):
        try:
            method, matching, kept, effective = _weigh(
                method, matcher, T, config.gate_m if not index else None
            )
            if acceleration is not None and (fallback := acceleration.fallback(kept)) is not None:
                T = fallback
                method, matching, kept, effective = _weigh(method, matcher, T)
            support = matching.select(kept.rows)
            motion = residual.solve(support, kept.weights)
        except DegenerateError as error:
            return f"degenerate: {error}"
        moved_T: FloatArray = motion @ T
        if acceleration is not None:
            moved_T = acceleration.extrapolated(T, moved_T, kept)
            motion = moved_T @ np.linalg.inv(T)
        mean_m, mean_squared_m2 = _moments(support.distances_m, kept.weights)
        step = RegistrationStep(
            index=index,
            T_target_source=moved_T,
            pairs=_side_by_side(source.rows, support.source_rows, target.rows, support.target_rows),
            weights=kept.weights,
            distances_m=support.distances_m,
            sigma_m=kept.sigma_m,
            gate_m=min(method.gate_m, kept.gate_m),
            objective=residual.mean_squared_m2(support, kept.weights, motion),
            rmse_m=math.sqrt(mean_squared_m2),
            mean_distance_m=mean_m,
            effective_pairs=effective,
            entropy_nat=kept.entropy_nat,
            rotation_step_rad=_turn_rad(motion),
            translation_step_m=float(np.linalg.norm(apply(moved_T - T, center_m))),
        )
        yield step
        T = moved_T
        reason = stop.reason(step, method.tolerance)
        if reason is not None and method.settled:
            return reason
        method = method.following(kept, reason is not None)
    return "max_iterations"


def _weigh(
    method: PairWeighting, matcher: Matches, T: FloatArray, start_gate_m: float | None = None
) -> tuple[PairWeighting, Matching, PairWeights, float]:
    """Match and weigh the pairs at a pose; returns the method (widened if it keeps too few pairs), the
    matched pairs, the weighed pairs, and the effective number of pairs 1 / sum w^2.

    ``start_gate_m`` is the configured gate at the start pose, where it is an error if no pair is kept.
    """

    def match(state: PairWeighting) -> Matching:
        return matcher.match(T, state.neighbours, state.source_share, state.target_share, state.gate_m)

    matching = match(method)
    kept = method.weigh(matching)
    if len(kept.rows) < MIN_PAIRS and (wider := method.widened()) is not None:
        method, matching = wider, match(wider)
        kept = method.weigh(matching)
    if start_gate_m is not None and not len(kept.rows):
        raise _no_pair(method, matching, start_gate_m)
    if len(kept.rows) < MIN_PAIRS:
        raise DegenerateError(f"only {len(kept.rows)} pairs are close enough")
    effective = 1.0 / float(np.einsum("m,m->", kept.weights, kept.weights))
    if effective < MIN_EFFECTIVE_PAIRS:
        raise DegenerateError(f"only {effective:.1f} pairs carry all the weight")
    return method, matching, kept, effective


def _no_pair(method: PairWeighting, matching: Matching, start_gate_m: float) -> ReconstructionError:
    """Return the error for a start pose at which no pair is kept."""
    if math.isinf(method.gate_m):
        return ReconstructionError(
            "No pair of points counts at the start pose: the clouds are too far apart or do not overlap; "
            "give a closer start pose."
        )
    if (matching.distances_m <= method.gate_m).any():
        return ReconstructionError(
            "No pair of near points has similar normals at the start pose: the source is turned too far or "
            "the normals are wrong; give a closer start pose, or try the point metric."
        )
    return ReconstructionError(
        f"No pair of points is within the gate of {length(start_gate_m)} at the start pose: the clouds are "
        "too far apart or do not overlap; give a closer start pose or raise gate_m."
    )


@compiled
def _moments(distances: FloatArray, weights: FloatArray) -> tuple[float, float]:
    """Return the weighted mean and mean square; the weights sum to one."""
    mean = mean_squared = 0.0
    for m in range(len(distances)):
        mean += weights[m] * distances[m]
        mean_squared += weights[m] * distances[m] * distances[m]
    return mean, mean_squared


def _turn_rad(motion: FloatArray) -> float:
    """Return the rotation angle of a rigid or similarity motion."""
    return rotation_angle_rad(motion[:3, :3] / math.hypot(*motion[:3, 0].tolist()))


@compiled
def _side_by_side(
    source_rows: IntArray, of_source: IntArray, target_rows: IntArray, of_target: IntArray
) -> IntArray:
    """Convert rows of the two samples to (M, 2) rows of the whole clouds."""
    pairs = np.empty((len(of_source), 2), dtype=np.intp)
    for m in range(len(pairs)):
        pairs[m, 0], pairs[m, 1] = source_rows[of_source[m]], target_rows[of_target[m]]
    return pairs
