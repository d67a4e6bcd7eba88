"""Record of ball pivoting, pivot by pivot, which can be replayed forwards and backwards."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import Progress
from pipeline.surface.holes import find_holes, half_edges
from pipeline.surface.pivoting import BallPivotStep, iterate_roll
from pipeline.types import ByteArray, FloatArray, IntArray

_NO_TURN_RAD = 1e-3
"""A backward turn smaller than this is rounding: the ball met its next point at once."""
_REPORTED = 0.02
"""Progress from one report to the next, as a share of the work."""
_PLACES_TRIED = 100
"""About the number of places that are compared."""


class Kind(IntEnum):
    """Operation that made a triangle."""

    SEED = 0
    """The ball was placed on three unused points."""
    JOIN = 1
    """The ball pivoted about an edge onto an unused point."""
    GLUE = 2
    """The ball pivoted about an edge onto a point of the front."""


@dataclass(frozen=True, slots=True)
class Walk:
    """All operations of the balls, in their order.

    Half-edge 3 t + k starts at corner k of triangle t. It is open after n triangles if its own triangle is
    among them and ``glued_by`` is n or more. An open half-edge is on the front after a step if ``left_front``
    is beyond that step; about any other open half-edge the ball has found nothing.
    """

    vertices_m: FloatArray
    """(N, 3) all points."""
    triangles: IntArray
    """(F, 3) int32, anticlockwise from the outside."""
    ball_centers_m: FloatArray
    """(F, 3) centre of the ball that made each triangle."""
    radii_m: tuple[float, ...]
    radius_index: ByteArray
    """(F,) index of the ball that made each triangle."""
    parent: IntArray
    """(F,) int32 triangle from which the ball came, over the new triangle's first edge; -1 for a seed."""
    kind: ByteArray
    """(F,) ``Kind`` of each triangle."""
    start_m: FloatArray
    """(F, 3) centre of the same ball where it rested on the parent."""
    turn_rad: FloatArray
    """(F,) angle by which it pivoted about the edge; 0 for a seed."""
    step_ends: IntArray
    """(S,) number of triangles after each step; after the last step of every ball its front is empty."""
    step_radius: ByteArray
    """(S,) index of the ball that rolled."""
    glued_by: IntArray
    """(3 F,) int32 triangle that closed each half-edge; F for none."""
    left_front: IntArray
    """(R, 3 F) int32 index of the first step after which each half-edge is not on the front of each of the R
    balls; 0 if it never was."""


def iterate_walk(
    points_m: FloatArray, normals: FloatArray | None, radii_m: Sequence[float], batch: int = 1
) -> Generator[Progress, None, Walk]:
    """Roll balls over an oriented cloud and record every step; arguments as for ``iterate_roll``.

    Steps before the first triangle are left out.

    Raises:
        InputError: see ``iterate_roll``.
        ReconstructionError: no ball rests on three points.
    """
    radii_m = tuple(radii_m)
    steps: list[BallPivotStep] = []
    balls: list[int] = []
    reported = 0.0
    for step in iterate_roll(points_m, normals, radii_m, batch):
        if steps or len(step.triangles):
            steps.append(step)
            balls.append(radii_m.index(step.radius_m))
        if step.progress >= reported + _REPORTED:
            reported = step.progress
            yield Progress("rolling the ball step by step", reported)
    if not steps:
        raise ReconstructionError(
            f"No ball of up to {radii_m[-1]:.4g} m rests on three of these {len(points_m)} points; "
            "try a larger radius"
        )
    return _walk_of(np.asarray(points_m, dtype=np.float64), radii_m, steps, np.array(balls, np.uint8))


def ball_on_arc(walk: Walk, triangle: int | IntArray, share: float) -> FloatArray:
    """Return the ball's centre after a share (0 to 1) of its pivot to a triangle.

    It pivots from its rest on the parent about the line through the edge's ends (SPEC 5.2), and touches
    both throughout. For a seed it is always the final centre.

    Returns:
        (3,) centre, or (..., 3) for an array of triangles.
    """
    middle_m, axis, _ = _edges(walk.vertices_m, walk.triangles[triangle])
    u_m = walk.start_m[triangle] - middle_m
    angle_rad = np.asarray(share * walk.turn_rad[triangle])[..., None]
    return middle_m + np.cos(angle_rad) * u_m + np.sin(angle_rad) * np.cross(axis, u_m)


def nearest_rows(points_m: FloatArray, center_m: FloatArray, count: int) -> IntArray:
    """Return the ascending indices of the ``count`` points nearest to a position; all if there are fewer.

    Raises:
        InputError: the position is not finite.
    """
    if not np.isfinite(center_m).all():
        raise InputError(f"The place to look at is {center_m} m; try one inside the cloud")
    _, rows = cKDTree(points_m).query(center_m, k=min(count, len(points_m)))
    return np.sort(np.atleast_1d(rows))


def hole_on_flat_ground(
    points_m: FloatArray, normals: FloatArray, triangles: IntArray, count: int
) -> FloatArray:
    """Find a point (3,) at a hole, or on a surface without holes, around which the points are flattest.

    Args:
        points_m: (N, 3) points.
        normals: (N, 3) normals.
        triangles: (F, 3) triangles of the surface.
        count: number of surrounding points; flat means that their normals agree.

    Raises:
        InputError: there is no triangle.
    """
    if not len(triangles):
        raise InputError("There is no surface to look at; try a larger ball radius")
    holes = [hole.loop[0] for hole in find_holes(points_m, triangles) if hole.open]
    candidates = np.array(holes) if holes else np.unique(triangles)
    candidates = candidates[:: -(-len(candidates) // _PLACES_TRIED)]
    around = cKDTree(points_m).query(points_m[candidates], k=min(count, len(points_m)))[1]
    agreement = np.linalg.norm(normals[around].mean(axis=1), axis=1)
    return points_m[candidates[np.argmax(agreement)]]


def _walk_of(
    vertices_m: FloatArray, radii_m: tuple[float, ...], steps: Sequence[BallPivotStep], balls: ByteArray
) -> Walk:
    triangles = np.concatenate([step.triangles for step in steps])
    centers_m = np.concatenate([step.ball_centers_m for step in steps])
    counts = np.array([len(step.triangles) for step in steps])
    radius_index = np.repeat(balls, counts)
    twins = half_edges(triangles, triangles[:, [1, 0, 2, 1, 0, 2]].reshape(-1, 2)).astype(np.int32)
    parent = _parents(twins)
    start_m, turn_rad = _arcs(vertices_m, triangles, centers_m, np.array(radii_m)[radius_index], parent)
    return Walk(
        vertices_m,
        triangles,
        centers_m,
        radii_m,
        radius_index,
        parent,
        _kinds(triangles, parent),
        start_m,
        turn_rad,
        step_ends=np.cumsum(counts),
        step_radius=balls,
        glued_by=_glued_by(twins),
        left_front=_left_front(triangles, steps, balls, len(radii_m)),
    )


def _parents(twins: IntArray) -> IntArray:
    """Return the triangle across each triangle's first edge if it was made earlier, else -1."""
    across = twins[::3] // 3
    return np.where(across < np.arange(len(across)), across, -1).astype(np.int32)


def _kinds(triangles: IntArray, parent: IntArray) -> ByteArray:
    points, first = np.unique(triangles, return_index=True)
    first_triangle = np.zeros(points[-1] + 1, np.int64)
    first_triangle[points] = first // 3
    joined = first_triangle[triangles[:, 2]] == np.arange(len(triangles))
    return np.where(parent < 0, Kind.SEED, np.where(joined, Kind.JOIN, Kind.GLUE)).astype(np.uint8)


def _glued_by(twins: IntArray) -> IntArray:
    own = np.arange(len(twins), dtype=np.int32) // 3
    return np.where(twins >= 0, np.maximum(own, twins // 3), len(twins) // 3).astype(np.int32)


def _left_front(
    triangles: IntArray, steps: Sequence[BallPivotStep], balls: ByteArray, radii: int
) -> IntArray:
    """Compute ``left_front``: a half-edge is on a ball's front without interruption, so one step suffices."""
    left = np.zeros((radii, 3 * len(triangles)), np.int32)
    fronts = half_edges(triangles, np.concatenate([step.front_edges for step in steps]))
    ends = np.cumsum([len(step.front_edges) for step in steps])
    for step, front in enumerate(np.split(fronts, ends[:-1])):
        left[balls[step], front] = step + 1
    return left


def _arcs(
    vertices_m: FloatArray, triangles: IntArray, centers_m: FloatArray, radius_m: FloatArray, parent: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return (F, 3) start centre of each ball, and (F,) right-handed angle of its pivot about the edge."""
    start_m, turn_rad = centers_m.copy(), np.zeros(len(triangles))
    rolled = np.flatnonzero(parent >= 0)
    came = parent[rolled]
    same = (radius_m[came] == radius_m[rolled])[:, None]
    rest_m = np.where(
        same, centers_m[came], _resting_centers_m(vertices_m[triangles[came]], radius_m[rolled])
    )
    middle_m, axis, half_m = _edges(vertices_m, triangles[rolled])
    u_m = rest_m - middle_m
    u_m -= np.sum(u_m * axis, axis=1, keepdims=True) * axis
    orbit_m = np.sqrt(np.maximum(radius_m[rolled] ** 2 - half_m**2, 0.0))
    u_m *= (orbit_m / np.linalg.norm(u_m, axis=1))[:, None]
    to_m = centers_m[rolled] - middle_m
    angle = np.arctan2(np.sum(to_m * np.cross(axis, u_m), axis=1), np.sum(to_m * u_m, axis=1))
    turn_rad[rolled] = np.where(angle < -_NO_TURN_RAD, angle + 2.0 * np.pi, angle)
    start_m[rolled] = middle_m + u_m
    return start_m, turn_rad


def _edges(vertices_m: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return middle, direction and half-length of the pivot edges (from second to first corner)."""
    a_m, b_m = vertices_m[triangles[..., 1]], vertices_m[triangles[..., 0]]
    length_m = np.linalg.norm(b_m - a_m, axis=-1)
    return 0.5 * (a_m + b_m), (b_m - a_m) / length_m[..., None], 0.5 * length_m


def _resting_centers_m(corners_m: FloatArray, radius_m: FloatArray) -> FloatArray:
    """Return (F, 3) centres of balls on (F, 3, 3) triangles, on their anticlockwise side (SPEC 5.1)."""
    a_m, b_m, c_m = corners_m.swapaxes(0, 1)
    u, v = b_m - a_m, c_m - a_m
    normal = np.cross(u, v)
    n2 = np.sum(normal**2, axis=1)
    u2, v2 = np.sum(u**2, axis=1, keepdims=True), np.sum(v**2, axis=1, keepdims=True)
    to_circle = (v2 * np.cross(normal, u) + u2 * np.cross(v, normal)) / (2.0 * n2[:, None])
    height2 = np.maximum(radius_m**2 - np.sum(to_circle**2, axis=1), 0.0)
    return a_m + to_circle + np.sqrt(height2 / n2)[:, None] * normal
