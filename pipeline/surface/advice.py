"""Suggested ball radii, wide enough for given shares of the surface (SPEC 5)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import InputError
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.findings import Suggestion
from pipeline.surface.pivoting import roll
from pipeline.types import BoolArray, FloatArray, IntArray, PointCloud

NEIGHBOURS = 24
"""Nearest neighbours whose triangles around a point are computed."""
SAMPLES = 2_000
"""Most points at which the needed radius is computed."""
LEVELS = {"finest": 0.50, "even": 0.90, "widest": 0.99}
"""Share of the surface that each suggested ball has to be wide enough for."""
_AGREES = 0.5
"""Cosine of the angle up to which a neighbour's normal puts it on the same sheet."""
_MARGIN = 1e-6
"""Relative margin on the radius, because rounding decides for a ball of exactly the needed radius."""
_WORTH_SAYING = 0.03
"""Difference of the two shares from which a suggestion names its cause."""


def suggest_radii(cloud: PointCloud) -> tuple[Suggestion, ...]:
    """Suggest ball radii that are wide enough for 50 %, 90 % and 99 % of the surface.

    A ball bridges the triangles around a point if it is at least as wide as the largest of their
    circumcircles (``needed_radii_m``); the radii are quantiles of that over a fixed sample. Points
    at a border need an infinite ball and are left out. Such a width is necessary, but not sufficient:
    at an edge, in a fold or between doubled layers a ball rests on some points and never reaches those
    behind them, more so the larger it is. So each ball is rolled once, and ``share`` is the share that
    it closed: in the living room 0.49 at 50 %, 0.88 and 0.85 at 90 %, 0.94 and 0.86
    at 99 % (sensor cloud, fused cloud).

    Args:
        cloud: points with normals.

    Returns:
        A suggestion for each of ``LEVELS``, ascending; none if no sampled point is surrounded by neighbours.

    Raises:
        InputError: fewer than four points, or no normals.
    """
    count = min(SAMPLES, len(cloud))
    rows = np.sort(np.random.default_rng(0).choice(len(cloud), count, replace=False))
    needed_m = needed_radii_m(cloud, rows)
    inner = np.isfinite(needed_m)
    if not inner.any():
        return ()
    rows, needed_m = rows[inner], needed_m[inner]
    radii_m = (1.0 + _MARGIN) * np.quantile(needed_m, list(LEVELS.values()), method="higher")
    return tuple(
        _suggestion(cloud, rows, name, float(radius_m), float(np.mean(needed_m <= radius_m)))
        for name, radius_m in zip(LEVELS, radii_m, strict=True)
    )


def needed_radii_m(cloud: PointCloud, rows: IntArray) -> FloatArray:
    """Compute (R,) radius that a ball needs to close the surface around each point at ``rows``.

    It is the largest circumradius of the Delaunay triangles at the point, in its tangent plane,
    among the nearest 24 points of the same sheet (their normals are within 60 degrees). Neighbours
    keep their distance from the point when they are rotated into the plane, so that a wall at right
    angles to it is not projected onto its foot. The radius is infinite (a border) where the triangles
    do not surround the point, or where a circle extends beyond the farthest neighbour, because it
    might contain more points there.

    Raises:
        InputError: fewer than four points, or no normals.
    """
    if len(cloud) < 4:
        raise InputError(f"A radius needs at least 4 points to be read from, not {len(cloud)}; try more")
    if cloud.normals is None:
        raise InputError("The advice on radii needs normals and the cloud has none; estimate them first")
    at_m, normals = cloud.points_m[rows], cloud.normals[rows]
    neighbours = min(NEIGHBOURS, len(cloud) - 1)
    distances_m, found = cKDTree(cloud.points_m).query(at_m, k=neighbours + 1, workers=-1)
    offsets_m = cloud.points_m[found] - at_m[:, None]
    same_sheet = np.einsum("nkc,nc->nk", cloud.normals[found], normals) > _AGREES
    flat_m = np.einsum("nkc,nca->nka", offsets_m, _tangents(normals))
    length_m = np.linalg.norm(flat_m, axis=-1)
    # Rotation into the plane and inversion in one step: direction over distance.
    counts = same_sheet & (length_m > 1e-9 * distances_m[:, -1:])
    scale = np.divide(1.0, length_m * distances_m, out=np.zeros_like(length_m), where=counts)
    needed_m = _largest_circumradius(scale[..., None] * flat_m)
    return np.where(2.0 * needed_m <= distances_m[:, -1], needed_m, np.inf)


def closed_fans(triangles: IntArray, points: int) -> BoolArray:
    """Return (points,) True where triangles surround a point completely."""
    edges, faces = edges_and_faces(triangles)
    closed = np.zeros(points, dtype=bool)
    closed[edges] = True
    closed[edges[faces == 1]] = False
    return closed


def _suggestion(cloud: PointCloud, rows: IntArray, name: str, radius_m: float, wide_for: float) -> Suggestion:
    rolled = roll(cloud.points_m, cloud.normals, (radius_m,))
    share = float(closed_fans(rolled.triangles, len(cloud))[rows].mean())
    sentence = f"Wide enough for {wide_for:.0%} of the surface; rolled, it closes {share:.0%}"
    if share < wide_for - _WORTH_SAYING:
        sentence += ": at edges, in folds and between doubled layers it does not reach every point"
    return Suggestion(name, radius_m, share, f"{sentence}.")


def _tangents(normals: FloatArray) -> FloatArray:
    """Return (N, 3, 2): two unit vectors orthogonal to each normal and to each other, as columns."""
    aside = np.where(np.abs(normals[:, :1]) < 0.6, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(normals, aside)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
    return np.stack([first, np.cross(normals, first)], axis=-1)


def _largest_circumradius(inverted: FloatArray) -> FloatArray:
    """Compute (N,) largest circumradius of the Delaunay triangles at the origin; infinite at a border.

    Inversion maps circles through the origin to lines: a circle of diameter 1 / h to a line at
    distance h. Empty circles through two neighbours are the edges of the convex hull of the
    inverted neighbours, which is traversed here for all points in parallel.

    Args:
        inverted: (N, K, 2) neighbours q / |q|^2; zero for those that are not used.
    """
    rows = np.arange(len(inverted))
    start = (inverted**2).sum(axis=-1).argmax(axis=1)  # the nearest neighbour is always on the hull
    now, least, walking = start, np.full(len(rows), np.inf), np.ones(len(rows), dtype=bool)
    for _ in range(inverted.shape[1]):
        corner = inverted[rows, now]
        onward, turned = inverted - corner[:, None], corner[:, ::-1] * [-1.0, 1.0]
        sideways = np.einsum("nkc,nc->nk", onward, turned)
        angle = np.arctan2(sideways, np.einsum("nkc,nc->nk", onward, corner))
        angle[sideways <= 0.0] = np.inf
        following = angle.argmin(axis=1)
        ends = inverted[rows, following]
        across = corner[:, 0] * ends[:, 1] - corner[:, 1] * ends[:, 0]
        length = np.linalg.norm(ends - corner, axis=1)
        goes_on = np.isfinite(angle[rows, following])
        height = np.divide(across, length, out=np.zeros(len(rows)), where=goes_on & (length > 0.0))
        least[walking] = np.minimum(least, height)[walking]
        now = following
        walking &= (now != start) & (least > 0.0)
        if not walking.any():
            break
    return np.divide(0.5, least, out=np.full(len(rows), np.inf), where=(least > 0.0) & ~walking)
