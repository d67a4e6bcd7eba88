"""The interval of a measure: covariances of marks and planes, of the nodes' poses and of the scale."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.measuring.guesses import UNKNOWN_RANGE_M, relative_errors
from pipeline.measuring.marks import Mark
from pipeline.measuring.planes import Plane
from pipeline.measuring.surface import MeasuredSurface
from pipeline.registration.graph.edges import cross_matrix
from pipeline.types import FloatArray

Z95 = 1.959964
"""Half the width of a 95 % interval of a normal distribution, in standard deviations."""
DRAWS = 4000
"""Draws of a measure with a guessed end, whose errors are not normal."""
BENT_OF_SCALE = 0.5
"""Ratio of the tilts of planes and lines to the scale's deviation: a focal length that is wrong by e
stretches what a camera sees across, but not along its axis, which tilts a direction at angle a to the axis by
e sin(a) cos(a), at most half of e."""
STEP = 1e-5
"""Step of the derivatives, m and rad."""
Thing = Mark | Plane


@dataclass(frozen=True, slots=True)
class Places:
    """M possible places of a mark or a plane."""

    points_m: FloatArray
    """(M, 3)."""
    normals: FloatArray
    """(M, 3) unit normals of a plane; those of a mark do not vary."""


Formula = Callable[..., FloatArray]
"""Takes one ``Places`` per thing, and returns the (M,) values of a measure."""


def interval(
    surface: MeasuredSurface, things: Sequence[Thing], formula: Formula, own_sd: float = 0.0
) -> tuple[float, tuple[float, float]]:
    """Return a measure and its 95 % interval.

    The interval of measured things follows to first order from the joint covariance. With a guessed one it
    consists of percentiles of draws, in which guesses have the errors of guesses of the same confidence,
    independently of each other.

    Args:
        surface: the surface.
        things: marks and planes that the measure depends on.
        formula: the measure.
        own_sd: further standard deviation of the measure, in its unit.
    """
    still = np.zeros((1, 3 * len(things)))
    value = float(_at(things, still, formula)[0])
    covariance = joint_covariance(surface, things)
    if any(thing.guessed for thing in things):
        rng = np.random.default_rng(0)
        drawn = _at(things, _drawn(surface, things, covariance, rng), formula)
        drawn = drawn + own_sd * rng.standard_normal(DRAWS)
        low, high = np.percentile(drawn, (2.5, 97.5))
        return value, (max(0.0, float(min(low, value))), float(max(high, value)))
    steps = STEP * np.eye(3 * len(things))
    slope = (_at(things, steps, formula) - _at(things, -steps, formula)) / (2.0 * STEP)
    variance = max(float(slope @ covariance @ slope), 0.0)
    half = Z95 * float(np.sqrt(variance + own_sd**2))
    return value, (max(0.0, value - half), value + half)


def joint_covariance(surface: MeasuredSurface, things: Sequence[Thing]) -> FloatArray:
    """Return the (3 K, 3 K) covariance of the states of K things.

    The state of a mark is its shift; that of a plane the shift along its normal and its two tilts. A thing
    that several nodes measured moves with the mean of all nodes.
    """
    size = 3 * len(things)
    covariance = np.zeros((size, size))
    for k, thing in enumerate(things):
        own = thing.covariance_m2 if isinstance(thing, Mark) else thing.covariance
        covariance[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = own
    by_motion = np.concatenate([_by_motion(thing) for thing in things])
    count = len(surface.pose_covariances)
    shares = np.stack([_shares(thing.node, count) for thing in things])
    for node, motion in enumerate(surface.pose_covariances):
        if motion.any() and shares[:, node].any():
            moved = by_motion * np.repeat(shares[:, node], 3)[:, None]
            covariance += moved @ motion @ moved.T
    for k, thing in enumerate(things):
        if isinstance(thing, Mark) and not 0 <= thing.node < count:
            covariance[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += _choice_of_node_m2(surface, thing)
    bent = (BENT_OF_SCALE * surface.tilting_sd) ** 2
    for k, thing in enumerate(things):
        if isinstance(thing, Plane):
            covariance[3 * k + 1, 3 * k + 1] += bent
            covariance[3 * k + 2, 3 * k + 2] += bent
    by_scale = np.concatenate([_by_scale(thing) for thing in things])
    return covariance + surface.scale_sd**2 * np.outer(by_scale, by_scale)


def _shares(node: int, count: int) -> FloatArray:
    """Return (N,) share of each node in a thing's motion."""
    return np.full(count, 1.0 / max(count, 1)) if not 0 <= node < count else np.eye(count)[node]


def _choice_of_node_m2(surface: MeasuredSurface, thing: Mark) -> FloatArray:
    """Return the (3, 3) covariance of a mark of several nodes that is due to the differences of their poses.

    The surface is the nodes' mean, but what is seen at a place on it is where one of them saw it: the
    nodes' motions differ from their mean in the surface's plane. Along the normal, their disagreement is in
    the noise of the vertices.
    """
    count = len(surface.pose_covariances)
    in_plane = (np.eye(3) - np.outer(thing.normal, thing.normal)) @ _by_motion(thing)
    spread = (1.0 - 1.0 / count) * surface.pose_covariances.mean(axis=0)
    return in_plane @ spread @ in_plane.T


def _by_motion(thing: Thing) -> FloatArray:
    """Return the (3, 6) derivative of a state by a small motion: turn about the origin, then shift."""
    moved = np.hstack([-cross_matrix(thing.point_m), np.eye(3)])
    if isinstance(thing, Mark):
        return moved
    tilts = [np.concatenate([np.cross(thing.normal, axis), np.zeros(3)]) for axis in thing.axes]
    return np.stack([thing.normal @ moved, *tilts])


def _by_scale(thing: Thing) -> FloatArray:
    """Return the (3,) derivative of a state by the scale of the world."""
    if isinstance(thing, Mark):
        return thing.point_m
    return np.array([thing.normal @ thing.point_m, 0.0, 0.0])


def _at(things: Sequence[Thing], states: FloatArray, formula: Formula) -> FloatArray:
    """Return the (M,) values of a measure at (M, 3 K) states."""
    places = []
    for k, thing in enumerate(things):
        own = states[:, 3 * k : 3 * k + 3]
        if isinstance(thing, Mark):
            places.append(Places(thing.point_m + own, np.broadcast_to(thing.normal, own.shape)))
        else:
            normals = thing.normal + own[:, 1:] @ thing.axes
            normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
            places.append(Places(thing.point_m + own[:, :1] * thing.normal, normals))
    return formula(*places)


def _drawn(
    surface: MeasuredSurface, things: Sequence[Thing], covariance: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Return (DRAWS, 3 K) states."""
    values, vectors = np.linalg.eigh(covariance)
    sds = np.sqrt(np.maximum(values, 0.0))
    states: FloatArray = (rng.standard_normal((DRAWS, len(sds))) * sds) @ vectors.T
    for k, thing in enumerate(things):
        if thing.guessed:
            states[:, 3 * k : 3 * k + 3] += _guess_errors(surface, thing, rng)
    return states


def _guess_errors(surface: MeasuredSurface, thing: Thing, rng: np.random.Generator) -> FloatArray:
    """Return (DRAWS, 3) errors of a guessed thing's state; a plane's shift and tilts err independently."""

    def errors_m() -> FloatArray:
        return range_m * np.expm1(relative_errors(thing.confidence, rng.random(DRAWS)))

    range_m = thing.range_m if np.isfinite(thing.range_m) else UNKNOWN_RANGE_M
    ray = thing.normal if thing.ray is None else thing.ray
    if isinstance(thing, Mark):
        return errors_m()[:, None] * ray
    steepness = abs(float(ray @ thing.normal))
    reaches_m = np.std(surface.vertices_m[thing.rows] @ thing.axes.T, axis=0)
    tilts = [steepness * errors_m() / max(2.0 * reach_m, 1e-3) for reach_m in reaches_m]
    return np.column_stack([float(ray @ thing.normal) * errors_m(), *tilts])
