"""Planes grown from a point over a surface, and the covariance of their fit."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import InputError
from pipeline.measuring.flood import flooded
from pipeline.measuring.lookup import Lookup, lookup_of
from pipeline.measuring.near import spot_near
from pipeline.measuring.surface import MeasuredSurface
from pipeline.types import BoolArray, FloatArray, IntArray

SEED_POINTS = 12
"""Vertices around the point to which the first plane is fitted."""
LEAST_POINTS = 12
"""Least vertices of a plane."""
FACING_DEG = 20.0
"""Largest angle between a vertex's normal and the plane's."""
WITHIN_SD = 3.0
"""Standard deviations of the part's median vertex up to which a vertex belongs to the plane."""
LEAST_WITHIN = 0.1
"""The same limit is at least this share of the spacing."""
BORDER = 2
"""Edges from a part's border within which its vertices are not fitted: smoothing (over 20 neighbours) and the
rolling ball round what meets it there."""
LEAST_SPREAD = 1.0
"""Least spread across, in spacings, of the vertices inside the border; in a narrower part all are fitted."""
FLAT = 0.35
"""Largest ratio of the seed's thickness to its width; a corner or an edge is thicker."""
MOST_PASSES = 15
"""Most times that a plane is fitted and its part is grown again."""
COMPARED = 800
"""Most vertices whose residuals are compared for their correlation."""
LAGS = 12
"""Distances at which residuals are compared, in spacings."""


@dataclass(frozen=True, slots=True)
class Plane:
    """A flat part of a surface."""

    point_m: FloatArray
    """(3,) centre of the part."""
    normal: FloatArray
    """(3,) unit, towards the observer."""
    covariance: FloatArray
    """(3, 3) of the offset along the normal (m) and of the tilts towards both ``axes`` (rad)."""
    axes: FloatArray
    """(2, 3) unit axes of the tilts, in the plane."""
    rows: IntArray
    """Vertices of the part."""
    rms_m: float
    """Root mean square distance of the fitted vertices from the plane."""
    guessed: bool
    node: int
    """Node that measured most of it; -1 if several or unknown."""
    ray: FloatArray | None = None
    """(3,) unit direction from the camera to the centre, for a guessed plane."""
    range_m: float = float("nan")
    """Mean distance from that camera; NaN if measured or unknown."""
    confidence: float = float("nan")
    """Mean confidence of the guesses, 0 to 1; NaN if measured or unknown."""

    def offset_variance_m2(self, point_m: FloatArray) -> float:
        """Return the variance of the plane's height at a (3,) point."""
        arms = np.concatenate([[1.0], -self.axes @ (np.asarray(point_m) - self.point_m)])
        return float(arms @ self.covariance @ arms)


def plane_at(surface: MeasuredSurface, point_m: FloatArray) -> Plane:
    """Return the plane that a surface has at a point, grown over the mesh by normals and distance.

    Raises:
        InputError: nothing is near the point, or no plane is there.
    """
    spot = spot_near(surface, point_m)
    seed = int(spot.corners[np.argmax(spot.shares)])
    where = "({:.3g}, {:.3g}, {:.3g})".format(*spot.point_m)
    lookup = lookup_of(surface)
    rows = _grown(surface, lookup, seed)
    if rows is None or len(rows) < LEAST_POINTS:
        raise InputError(
            f"The surface has no plane at {where} m; try a point in the middle of a flat part, or a "
            "surface of more points"
        )
    return fitted(surface, rows, _inner(surface, lookup, rows))


def _inner(surface: MeasuredSurface, lookup: Lookup, rows: IntArray) -> IntArray:
    """Return the vertices of a part that are not next to its border; all if those are few or on a line."""
    inside = np.zeros(len(lookup.rim), bool)
    inside[rows] = True
    for _ in range(BORDER):
        ends = lookup.edges[inside[lookup.edges].sum(axis=1) == 1]
        fewer = inside & ~lookup.rim
        fewer[ends.ravel()] = False
        inside = fewer
    found = np.flatnonzero(inside)
    if len(found) < LEAST_POINTS:
        return rows
    across_m = _principal(surface.vertices_m[found], np.ones(len(found)))[2][1]
    return found if across_m >= LEAST_SPREAD * lookup.spacing_m else rows


def _grown(surface: MeasuredSurface, lookup: Lookup, seed: int) -> IntArray | None:
    """Return the rows of the plane around a vertex; None if its neighbourhood is not flat."""
    points_m, normals = surface.vertices_m, surface.normals
    near = lookup.tree.nearest(points_m[[seed]], min(SEED_POINTS, len(points_m)))[1][0]
    near = near[normals[near] @ normals[seed] > np.cos(np.radians(2.0 * FACING_DEG))]
    if len(near) < 4:
        return None
    center_m, axes, spreads_m = _principal(points_m[near], np.ones(len(near)))
    if spreads_m[0] > FLAT * spreads_m[1]:
        return None
    normal = axes[0] * np.sign(axes[0] @ normals[seed] or 1.0)
    rows = near
    for _ in range(MOST_PASSES):
        limit_m = max(WITHIN_SD * _median_sd_m(surface, rows), LEAST_WITHIN * lookup.spacing_m)
        within = np.abs((points_m - center_m) @ normal) <= limit_m
        within &= normals @ normal > np.cos(np.radians(FACING_DEG))
        grown = _around(lookup, within, seed)
        if len(grown) < 4:
            return None
        same = len(grown) == len(rows) and np.array_equal(grown, rows)
        rows = grown
        center_m, axes, _ = _principal(points_m[rows], _weights(surface, rows))
        normal = axes[0] * np.sign(axes[0] @ normal)
        if same:
            break
    return rows


def _median_sd_m(surface: MeasuredSurface, rows: IntArray) -> float:
    """Return the median standard deviation of vertices along their own normals."""
    facing = np.abs(np.einsum("vi,vi->v", surface.rays[rows], surface.normals[rows]))
    return float(np.median(surface.sigma_m[rows] * facing))


def _around(lookup: Lookup, within: BoolArray, seed: int) -> IntArray:
    """Return the rows of ``within`` that edges connect with the seed; none if the seed is not within."""
    if not within[seed]:
        return np.empty(0, int)
    return np.flatnonzero(flooded(*lookup.neighbours, within, seed))


def _weights(surface: MeasuredSurface, rows: IntArray) -> FloatArray:
    """Return (M,) weights 1 / sd^2 of vertices, at most 100 times that of the median variance."""
    variance_m2 = surface.sigma_m[rows] ** 2
    return 1.0 / np.maximum(variance_m2, 1e-2 * np.median(variance_m2) + 1e-18)


def _principal(points_m: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (3,) weighted mean, (3, 3) principal axes as rows, the thinnest first, and (3,) spreads."""
    center_m = np.average(points_m, axis=0, weights=weights)
    away_m = points_m - center_m
    scatter = (away_m * (weights / weights.sum())[:, None]).T @ away_m
    values, vectors = np.linalg.eigh(scatter)
    return center_m, vectors.T, np.sqrt(np.maximum(values, 0.0))


def fitted(surface: MeasuredSurface, part: IntArray, inner: IntArray | None = None) -> Plane:
    """Return the plane of a part of a surface by weighted least squares.

    Its covariance is the residuals' variance, or the vertices' own if that is larger, over the effective
    number of independent vertices: smoothing and the sensor's steps correlate neighbours, and the residuals
    themselves show how far.

    Args:
        surface: the surface.
        part: (P,) vertices of the part.
        inner: (M,) those that are fitted, at least four that are not on a line; all if None.
    """
    rows = part if inner is None else inner
    points_m, weights = surface.vertices_m[rows], _weights(surface, rows)
    center_m, axes, _ = _principal(points_m, weights)
    toward = surface.normals[rows].mean(axis=0)
    normal = axes[0] * (1.0 if axes[0] @ toward >= 0.0 else -1.0)
    tilts = axes[1:]
    residuals_m = (points_m - center_m) @ normal
    share = weights / weights.sum()
    arms_m = np.column_stack([np.ones(len(rows)), (points_m - center_m) @ tilts.T])
    information = (arms_m * share[:, None]).T @ arms_m
    freedom = max(len(rows) - 3, 1) / len(rows)
    own_m = surface.sigma_m[rows] * np.einsum("vi,i->v", surface.rays[rows], normal)
    variance_m2 = max(float(share @ residuals_m**2) / freedom, float(share @ own_m**2))
    spacing_m = lookup_of(surface).spacing_m
    independent = 1.0 / float(share @ share) / correlated_neighbours(arms_m[:, 1:], residuals_m, spacing_m)
    covariance = variance_m2 / max(independent, 1.0) * np.linalg.inv(information)
    covariance[1:, 0], covariance[0, 1:] = -covariance[1:, 0], -covariance[0, 1:]
    nodes, counts = np.unique(surface.nodes[rows], return_counts=True)
    most = int(np.argmax(counts))
    guessed = bool(np.mean(surface.guessed[rows]) > 0.5)
    ray, range_m, confidence = None, float("nan"), float("nan")
    if guessed:
        ray = surface.rays[rows].mean(axis=0)
        ray /= max(float(np.linalg.norm(ray)), 1e-12)
        range_m, confidence = guess_of(surface, rows)
    return Plane(
        center_m,
        normal,
        covariance,
        tilts,
        part,
        float(np.sqrt(np.mean(residuals_m**2))),
        guessed,
        int(nodes[most]) if counts[most] > 0.5 * len(rows) else -1,
        ray,
        range_m,
        confidence,
    )


def guess_of(surface: MeasuredSurface, rows: IntArray) -> tuple[float, float]:
    """Return the mean range (m) and the mean confidence of guessed vertices; NaN where unknown."""
    range_m = float("nan") if surface.ranges_m is None else float(np.mean(surface.ranges_m[rows]))
    if surface.confidence is None or not np.isfinite(surface.confidence[rows]).any():
        return range_m, float("nan")
    return range_m, float(np.nanmean(surface.confidence[rows]))


def rectangle(
    flat_m: FloatArray, percentiles: tuple[float, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the rectangle between two percentiles of (M, 2) points, parallel to their smallest rectangle.

    Returns:
        (2, 2) unit axes of its sides as rows, and (2,) least and (2,) greatest coordinates along them.
    """
    turn_rad = np.radians(cv2.minAreaRect(flat_m.astype(np.float32))[2])
    axes = np.array([[np.cos(turn_rad), np.sin(turn_rad)], [-np.sin(turn_rad), np.cos(turn_rad)]])
    low_m, high_m = np.percentile(flat_m @ axes.T, percentiles, axis=0)
    return axes, low_m, high_m


def correlated_neighbours(points_m: FloatArray, residuals_m: FloatArray, spacing_m: float) -> float:
    """Return how many neighbouring vertices have one common error on average: 1 for independent residuals.

    It is 1 + the sum of the residuals' correlations with all others, up to the first distance without any.

    Args:
        points_m: (M, 2) places of vertices in their plane; distances in space would depend on the residuals.
        residuals_m: (M,) their distances from it.
        spacing_m: distance of neighbours.
    """
    variance_m2 = float(np.mean(residuals_m**2))
    if variance_m2 <= 0.0 or len(points_m) < LEAST_POINTS:
        return 1.0
    every = max(1, len(points_m) // COMPARED)
    compared = np.arange(0, len(points_m), every)
    pairs = cKDTree(points_m[compared]).sparse_distance_matrix(
        cKDTree(points_m), LAGS * spacing_m, output_type="ndarray"
    )
    here, there, lag = compared[pairs["i"]], pairs["j"], pairs["v"] / spacing_m
    others = here != there
    bins = np.minimum(np.rint(lag[others]).astype(int), LAGS - 1)
    count = np.bincount(bins, minlength=LAGS)
    product = np.bincount(bins, (residuals_m[here] * residuals_m[there])[others], LAGS)
    correlation = product / np.maximum(count, 1) / variance_m2
    noise = 3.0 / np.sqrt(np.maximum(count, 1))
    silent = np.flatnonzero((count > 0) & (correlation <= noise))
    last = int(silent[0]) if len(silent) else LAGS
    return 1.0 + float((count[:last] * correlation[:last]).sum()) / len(compared)
