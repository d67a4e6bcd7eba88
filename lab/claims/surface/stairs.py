"""Stairs with exactly known steps, and noisy clouds of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.surface.normals import estimate_normals
from pipeline.types import FloatArray, IntArray, PointCloud

RISES_M = (0.03, 0.04, 0.05, 0.06, 0.08)
"""Heights of the steps, from the front."""
TREAD_M = 0.12
WIDTH_M = 0.6
POINT_DISTANCE_M = 0.01
"""Spacing before noise and jitter; close to that of the demo scenes."""
NOISE_M = 0.002
"""Noise of the depth sensor at about one metre (SPEC 2)."""
JITTER = 0.2
"""Largest move of a point within its face, in point distances."""


@dataclass(frozen=True, slots=True)
class Stairs:
    """Level treads (z up) and upright risers; x runs along the steps, y into them."""

    vertices_m: FloatArray
    triangles: IntArray
    corners_m: FloatArray
    """(F, 3, 3) corners of each rectangular face: one corner and its neighbours along x and across."""
    feet_m: FloatArray
    """(S, 2) y and z of the inner edges, where a riser stands on a tread."""


def stairs() -> Stairs:
    """Return stairs with one tread before each riser and one behind the last."""
    profile_m = [(0.0, 0.0)]
    for rise_m in (*RISES_M, 0.0):
        y_m, z_m = profile_m[-1]
        profile_m += [(y_m + TREAD_M, z_m), (y_m + TREAD_M, z_m + rise_m)]
    line_m = np.array(profile_m[:-1])
    left_m, right_m = (np.column_stack([np.full(len(line_m), x_m), line_m]) for x_m in (0.0, WIDTH_M))
    begin = np.arange(len(line_m) - 1)
    a, b, c, d = begin, begin + len(line_m), begin + len(line_m) + 1, begin + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    corners_m = np.stack([left_m[:-1], right_m[:-1], left_m[1:]], axis=1)
    return Stairs(np.concatenate([left_m, right_m]), triangles.astype(np.int32), corners_m, line_m[1:-1:2])


def stairs_cloud(
    target: Stairs, seed: int, point_distance_m: float = POINT_DISTANCE_M, noise_m: float = NOISE_M
) -> PointCloud:
    """Return a cloud of the target with estimated normals: a jittered grid on every face, and noise.

    Args:
        target: the stairs.
        seed: seed of jitter and noise.
        point_distance_m: spacing of the grid.
        noise_m: standard deviation in x, y and z.
    """
    rng = np.random.default_rng(seed)
    faces_m = [_grid(corners_m, point_distance_m, rng) for corners_m in target.corners_m]
    points_m = np.concatenate(faces_m)
    points_m += rng.normal(0.0, noise_m, points_m.shape)
    above_m = np.array([WIDTH_M / 2, -2.0, 2.0])  # sees every face
    return estimate_normals(PointCloud(points_m), above_m)


def feet_samples(target: Stairs, count: int = 100) -> FloatArray:
    """Return (S * count, 3) points along the inner edges, without their ends."""
    x_m = np.linspace(0.05 * WIDTH_M, 0.95 * WIDTH_M, count)
    return np.concatenate([np.column_stack([x_m, np.tile(foot_m, (count, 1))]) for foot_m in target.feet_m])


def _grid(corners_m: FloatArray, distance_m: float, rng: np.random.Generator) -> FloatArray:
    """Return (N, 3) points in the middle of their cells, jittered within their face."""
    sides_m = corners_m[1:] - corners_m[0]
    counts = np.maximum(1, np.rint(np.linalg.norm(sides_m, axis=1) / distance_m)).astype(int)
    cells = np.stack(np.meshgrid(*(np.arange(count) for count in counts), indexing="ij"), axis=-1)
    places = cells.reshape(-1, 2) + 0.5 + rng.uniform(-JITTER, JITTER, (int(np.prod(counts)), 2))
    return corners_m[0] + places / counts @ sides_m
