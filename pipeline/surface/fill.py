"""Filling of holes without measurements, by the triangulation of least area over each loop.

Open3D's ``fill_holes`` is not used: it selects loops by a radius, also closes rims, and orients its triangles
inwards.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.rays import triangle_areas_m2
from pipeline.surface.findings import SEAM_M
from pipeline.surface.holes import find_holes
from pipeline.surface.quality import measure_quality
from pipeline.surface.truth import sample_surface
from pipeline.types import BoolArray, FloatArray, IntArray, Surface, SurfaceResult

AnySurface = TypeVar("AnySurface", bound=Surface)

MOST_VERTICES = 256
"""Loops with more vertices stay open: the time of the triangulation grows with their cube."""
_TIE = 1e-6
"""Weight of a chord's squared length relative to area: among equal areas, short chords are preferred."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Filled:
    """A surface with its small holes closed."""

    surface: SurfaceResult
    """The old triangles in their order, then the new ones; quality is measured without cameras."""
    filled: BoolArray
    """(F,) True for the new triangles."""
    holes: int
    """Number of closed holes."""
    area_m2: float
    """Area of the new triangles."""


def fill_holes(surface: SurfaceResult, longest_m: float) -> Filled:
    """Close every hole whose loop is short enough, with the triangulation of least area.

    Rims and islands stay open, as do loops of more than 256 vertices and those for which every
    triangulation needs an edge that the mesh already has: no edge gets more than two faces. All new
    triangles are anticlockwise from outside.

    Args:
        surface: a mesh whose triangles agree in their orientation.
        longest_m: length of the longest loop to close.

    Raises:
        InputError: ``longest_m`` is not positive.
    """
    if not longest_m > 0.0:
        raise InputError(f"The longest hole to fill is {longest_m} m; try a positive length, for example 0.2")
    patches = _patches(surface, longest_m)
    new = np.concatenate([np.empty((0, 3), surface.triangles.dtype), *patches])
    triangles = np.concatenate([surface.triangles, new]).astype(surface.triangles.dtype)
    points = len(surface.vertices_m) + surface.quality.unused_points
    quality = measure_quality(surface.vertices_m, triangles, [], points)
    return Filled(
        surface=replace(surface, triangles=triangles, quality=quality),
        filled=np.arange(len(triangles)) >= len(surface.triangles),
        holes=len(patches),
        area_m2=float(triangle_areas_m2(surface.vertices_m, new).sum()),
    )


def without_seams(surface: AnySurface) -> AnySurface:
    """Close the smallest holes of a surface for display; its ``quality`` is not measured again.

    Where inferred and measured surface do not quite meet, the ball leaves a seam of holes through which the
    background is visible; loops of up to ``SEAM_M`` are closed by the triangulation of least area.
    """
    triangles = np.concatenate([surface.triangles, *_patches(surface, SEAM_M)])
    return replace(surface, triangles=triangles.astype(surface.triangles.dtype))


def _patches(surface: Surface, longest_m: float) -> list[IntArray]:
    """Return the new triangles of each hole whose loop is at most ``longest_m`` long."""
    count = len(surface.vertices_m)
    edges = set((surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2) @ [count, 1]).tolist())
    patches: list[IntArray] = []
    left = 0
    for hole in find_holes(surface.vertices_m, surface.triangles):
        if not hole.open or hole.length_m > longest_m:
            continue
        patch = _patch(surface.vertices_m, hole.loop, edges)
        if patch is None:
            left += 1
            continue
        patches.append(patch)
        edges.update((patch[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2) @ [count, 1]).tolist())
    if left:
        _log.info(
            "%d holes stay open: too many vertices, or no triangulation without an edge that the mesh has",
            left,
        )
    return patches


def least_area(corners_m: FloatArray, allowed: BoolArray | None = None) -> IntArray | None:
    """Triangulate a closed polygon in space with the least area (Barequet and Sharir 1995).

    It uses dynamic programming over the polygon's pieces, O(L^3) in time and O(L^2) in memory.

    Args:
        corners_m: (L, 3) corners, at least three.
        allowed: (L, L) symmetric; False where a chord between two non-neighbouring corners is forbidden.

    Returns:
        (L - 2, 3) indices of corners in the polygon's direction; None if the allowed chords do not suffice.
    """
    count = len(corners_m)
    cost = np.zeros((count, count))
    split = np.zeros((count, count), dtype=np.int64)
    chord_m2 = _TIE * np.sum((corners_m[:, None] - corners_m[None]) ** 2, axis=2)
    if allowed is not None:
        chord_m2 = np.where(allowed, chord_m2, np.inf)
    for span in range(2, count):
        start = np.arange(count - span)[:, None]
        end, middle = start + span, start + np.arange(1, span)
        a, b, c = corners_m[start], corners_m[middle], corners_m[end]
        area_m2 = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=2)
        total = area_m2 + cost[start, middle] + cost[middle, end]
        best = np.argmin(total, axis=1)
        first, last = start[:, 0], end[:, 0]
        split[first, last] = middle[first, best]
        cost[first, last] = total[first, best] + (chord_m2[first, last] if span < count - 1 else 0.0)
    if not np.isfinite(cost[0, -1]):
        return None
    return _unfolded(split)


def skin_points_m(corners_m: FloatArray, count: int) -> FloatArray:
    """Draw points by area on the triangulation of least area over a loop; add its triangles' circumcentres.

    Args:
        corners_m: (L, 3) corners of the loop; more than 256 are triangulated as a fan from their mean.
        count: number of points to draw.

    Returns:
        (count + K, 3) points; the corners themselves if the loop has no area.
    """
    skin = least_area(corners_m) if len(corners_m) <= MOST_VERTICES else None
    if skin is None:
        around = np.arange(len(corners_m))
        skin = np.stack([around, np.roll(around, -1), np.full(len(around), len(around))], axis=1)
        corners_m = np.concatenate([corners_m, corners_m.mean(axis=0, keepdims=True)])
    if not triangle_areas_m2(corners_m, skin).sum() > 0.0:
        return corners_m
    drawn_m = sample_surface(corners_m, skin, count, np.random.default_rng(0))
    return np.concatenate([drawn_m, _circumcenters_m(*corners_m[skin].swapaxes(0, 1))])


def _circumcenters_m(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return (K, 3) circumcentres of those of F triangles, with corners a, b, c, that contain their own."""
    sides_m2 = np.stack([np.sum((p - q) ** 2, axis=1) for p, q in ((b, c), (c, a), (a, b))], axis=1)
    weights = sides_m2 * (sides_m2.sum(axis=1, keepdims=True) - 2.0 * sides_m2)
    inside = np.all(weights >= 0.0, axis=1) & np.any(weights > 0.0, axis=1)
    weights = weights[inside] / weights[inside].sum(axis=1, keepdims=True)
    return np.einsum("fk,kfi->fi", weights, np.stack([a, b, c])[:, inside])


def _unfolded(split: IntArray) -> IntArray:
    """Collect the triangles from the table of splits, starting with the whole polygon."""
    pieces, triangles = [(0, len(split) - 1)], []
    while pieces:
        start, end = pieces.pop()
        if end - start > 1:
            middle = int(split[start, end])
            triangles.append((start, middle, end))
            pieces += [(start, middle), (middle, end)]
    return np.array(triangles)


def _patch(vertices_m: FloatArray, loop: IntArray, edges: set[int]) -> IntArray | None:
    """Return (L - 2, 3) triangles that close a loop; None if it must stay open.

    Args:
        vertices_m: (V, 3) vertices.
        loop: (L,) vertex indices in the direction of the mesh's edges.
        edges: V * start + end of every directed edge of the mesh.
    """
    polygon = loop[::-1].astype(np.int64)
    if not 3 <= len(polygon) <= MOST_VERTICES:
        return None
    taken = _taken(polygon[:, None], polygon[None], len(vertices_m), edges)
    step = np.arange(len(polygon)), np.roll(np.arange(len(polygon)), -1)
    if np.any(taken[step]) or not np.all(taken.T[step]):
        return None  # not a boundary of consistently oriented triangles
    triangles = least_area(vertices_m[polygon], ~(taken | taken.T))
    return None if triangles is None else polygon[triangles]


def _taken(start: IntArray, end: IntArray, count: int, edges: set[int]) -> BoolArray:
    """Return for each pair of vertices whether the mesh has this directed edge."""
    keys = start * count + end
    return np.array([key in edges for key in keys.ravel().tolist()]).reshape(keys.shape)
