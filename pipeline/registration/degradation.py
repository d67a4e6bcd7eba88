"""Artificial degradation of a cloud as in real depth data: noise, outliers, holes, bias, less overlap.

The race on the Fuse screen and ``lab.claims`` use it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import BoolArray, FloatArray, PointCloud

LIMITS = {"noise_m": 0.2, "outlier_share": 0.8, "hole_share": 0.9, "depth_bias": 0.2, "crop_share": 0.9}
"""Largest value of each degradation."""
HOLES = 12
BIAS_WAVES = 24
"""Number of plane waves in the bias; the sum of many random waves is a Gaussian field."""
BIAS_SCALE_OF_VIEW = 0.3
"""Correlation length of the bias over the view's larger side; with it plain ICP errs as in SPEC 4.8."""


@dataclass(frozen=True, slots=True)
class Degradation:
    """Amount of each degradation; the default changes nothing.

    Raises:
        InputError: a value is negative or above its limit in ``LIMITS``.
    """

    noise_m: float = 0.0
    """Standard deviation of noise along the view ray, metres."""
    outlier_share: float = 0.0
    """Share of the points replaced by uniform random points in the cloud's bounding box."""
    hole_share: float = 0.0
    """Share of the points removed in round patches of the view."""
    depth_bias: float = 0.0
    """Standard deviation over the points of a smooth relative depth error with mean zero."""
    crop_share: float = 0.0
    """Share of the points removed at one side of the view, which reduces the overlap."""

    def __post_init__(self) -> None:
        for part in fields(self):
            value, most = getattr(self, part.name), LIMITS[part.name]
            if not 0.0 <= value <= most:
                raise InputError(f"degradation.{part.name} is {value}; try 0 to {most:g}")


def degrade(cloud: PointCloud, how: Degradation, seed: int) -> PointCloud:
    """Apply crop, holes, depth bias, noise and outliers to a cloud, in this order.

    Every kind has its own random stream: a change of one does not change the draws of the others.

    Args:
        cloud: cloud in its camera's frame, z forward.
        how: the degradations; each share refers to the points that remain after the earlier ones.
        seed: random seed of all five streams.

    Returns:
        The remaining points, with all their columns; only positions change.

    Raises:
        InputError: there are no points, or some have z <= 0 in the camera's frame.
    """
    if not len(cloud) or not np.all(cloud.points_m[:, 2] > 0):
        raise InputError("Only a cloud in front of its camera (z > 0) can be degraded.")
    crop, holes, bias, noise, outliers = (np.random.default_rng([seed, kind]) for kind in range(5))
    if how.crop_share:
        cloud = cloud.select(_outside_crop(_view(cloud), how.crop_share, crop))
    if how.hole_share:
        cloud = cloud.select(_outside_holes(_view(cloud), how.hole_share, holes))
    points_m: FloatArray = cloud.points_m.astype(np.float64)
    if how.depth_bias:
        points_m = points_m * np.exp(how.depth_bias * smooth_field(_view(cloud), bias))[:, None]
    if how.noise_m:
        along_m = how.noise_m * noise.standard_normal((len(points_m), 1))
        points_m = points_m * (1.0 + along_m / np.linalg.norm(points_m, axis=1, keepdims=True))
    if how.outlier_share:
        points_m = _with_outliers(points_m, how.outlier_share, outliers)
    return replace(cloud, points_m=points_m)


def smooth_field(view: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Evaluate a random smooth function at (N, 2) view positions: (N,) with mean zero and variance one."""
    scale = BIAS_SCALE_OF_VIEW * np.ptp(view, axis=0).max() + np.finfo(float).tiny
    waves = rng.standard_normal((2, BIAS_WAVES)) / scale
    field = np.cos(view @ waves + rng.uniform(0.0, 2.0 * np.pi, BIAS_WAVES)).sum(axis=1)
    return (field - field.mean()) / max(field.std(), np.finfo(float).tiny)


def _view(cloud: PointCloud) -> FloatArray:
    """Return (N, 2) position of each point in the view: x / z, y / z."""
    return cloud.points_m[:, :2] / cloud.points_m[:, 2:]


def _outside_crop(view: FloatArray, share: float, rng: np.random.Generator) -> BoolArray:
    """Return (N,) False for the share of the points farthest towards a random side of the view."""
    angle_rad = rng.uniform(0.0, 2.0 * np.pi)
    return _without_least(-view @ np.array([np.cos(angle_rad), np.sin(angle_rad)]), share)


def _outside_holes(view: FloatArray, share: float, rng: np.random.Generator) -> BoolArray:
    """Return (N,) False in round patches about random points, which together hold the share."""
    centers = view[rng.integers(0, len(view), HOLES)]
    radii = rng.uniform(0.4, 1.0, HOLES)
    inside = [np.sum((view - c) ** 2, axis=1) / r**2 for c, r in zip(centers, radii, strict=True)]
    return _without_least(np.min(inside, axis=0), share)


def _without_least(values: FloatArray, share: float) -> BoolArray:
    """Return (N,) False for the share of the rows with the least values."""
    keep = np.ones(len(values), np.bool_)
    keep[np.argsort(values, kind="stable")[: round(share * len(values))]] = False
    return keep


def _with_outliers(points_m: FloatArray, share: float, rng: np.random.Generator) -> FloatArray:
    """Return (N, 3) points, a share of them replaced by uniform random points in their bounding box."""
    replaced = rng.permutation(len(points_m))[: round(share * len(points_m))]
    points_m = points_m.copy()
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    points_m[replaced] = rng.uniform(low, high, (len(replaced), 3))
    return points_m
