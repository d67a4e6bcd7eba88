"""Evening of a mesh's rims: hanging triangles and spikes are dropped, notches closed, curves smoothed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from pipeline.surface.boundary import directed_edges, edges_with_one_face
from pipeline.types import BoolArray, FloatArray, IntArray, PointSource, Surface

SPIKE_RAD, SLIVER_RAD = np.deg2rad(15.0), np.deg2rad(6.0)
"""A triangle that hangs by one edge is dropped if its free corner is sharper than the first angle, or another
corner sharper than the second."""
NOTCH_RAD = np.deg2rad(110.0)
"""A notch is closed if its angle is sharper."""
MOST_GUESSED = 1
"""A notch with more inferred corners stays open: two thirds of the triangles there would be wrong."""
FACING = 0.5
"""Least cosine between a new triangle and the normals of its corners, and between one before and after."""
LEAST_AREA = 0.3
"""Least ratio of a triangle's area after smoothing to its area before."""
NOISE_SHARE = 0.5
"""Largest move of a measured vertex, as a share of its standard deviation: a vertex is an average of four or
more measurements."""
PASSES = 3
"""Passes in which notches are closed; each may open new ones."""
STEPS = (0.5, -0.53) * 6
"""Factors lambda and mu of Taubin's smoothing (1995), which keeps the size of curves."""
HALVINGS = 3
"""Times that a move which would spoil a triangle is halved before it is given up."""


@dataclass(frozen=True, slots=True)
class EvenRims:
    """A surface with even rims, and what was changed."""

    surface: Surface
    dropped: int
    """Number of dropped triangles."""
    closed: int
    """Number of closed notches, each by one triangle."""
    moved_m: FloatArray
    """(V,) distance by which each vertex of the new surface moved."""


@dataclass(frozen=True, slots=True)
class _Rim:
    """Neighbours of each vertex on its rim; the arrays change in place as triangles come and go."""

    before: IntArray
    """(V,) previous vertex; -1 unless exactly one loop passes the vertex."""
    after: IntArray
    """(V,) next vertex, or -1."""

    def leave(self, vertices: IntArray) -> None:
        """Take vertices off the rim."""
        self.before[vertices] = self.after[vertices] = -1

    def cut(self, before: IntArray, vertices: IntArray, after: IntArray) -> None:
        """Take vertices off the rim and join their neighbours."""
        self.leave(vertices)
        single = self.after[before] >= 0
        self.after[before[single]] = after[single]
        single = self.before[after] >= 0
        self.before[after[single]] = before[single]


def even_rims(surface: Surface, sigma_m: FloatArray | None) -> EvenRims:
    """Even the rims of a surface that a ball made; holes' rims and outer rims alike (SPEC 5).

    No triangle is turned over, no edge gets a third triangle, and no vertex is added.

    Args:
        surface: the surface, with normals and radii.
        sigma_m: (V,) standard deviation of each vertex's depth. A measured vertex moves by at most half of
            it; without it, or where it is NaN, none moves. Inferred vertices stay.
    """
    points_m = np.asarray(surface.vertices_m, float)
    if not len(surface.triangles) or surface.normals is None:
        return EvenRims(surface, 0, 0, np.zeros(len(points_m)))
    rims = edges_with_one_face(surface.triangles)
    hanging = _hanging(surface.triangles, rims // 3)
    rim = _rim_of(directed_edges(surface.triangles)[rims[~hanging[rims // 3]]], len(points_m))
    triangles = surface.triangles[~hanging].astype(np.int64)
    triangles = triangles[~_spikes(points_m, triangles, rim)]
    new = _closed_notches(points_m, surface, triangles, rim)
    triangles = np.concatenate([triangles, new])
    even_m = _smoothed_m(points_m, surface.normals, triangles, rim, _bounds_m(surface, sigma_m, rim))
    used = np.bincount(triangles.reshape(-1), minlength=len(points_m)) > 0
    moved_m = np.linalg.norm(even_m - points_m, axis=1)[used]
    dropped = len(surface.triangles) + len(new) - len(triangles)
    return EvenRims(_with(surface, even_m, triangles, used), dropped, len(new), moved_m)


def _with(surface: Surface, vertices_m: FloatArray, triangles: IntArray, used: BoolArray) -> Surface:
    """Return the surface with new vertex positions and triangles, without unused vertices."""
    columns: dict[str, Any] = {
        name: getattr(surface, name) for name in ("colors", "normals", "source", "rows")
    }
    kept: dict[str, Any] = {
        name: None if column is None else column[used] for name, column in columns.items()
    }
    renumbered = (np.cumsum(used, dtype=np.int32) - 1)[triangles]
    return replace(surface, vertices_m=vertices_m[used], triangles=renumbered, **kept)


def _hanging(triangles: IntArray, owners: IntArray) -> BoolArray:
    """Return (F,) True for triangles that touch others at one corner only; ``owners`` have the rim edges."""
    alone = np.bincount(owners, minlength=len(triangles)) == 3
    free = np.bincount(triangles.reshape(-1))[triangles] == 1
    hanging = alone & (free.sum(axis=1) == 2)
    return hanging & ~hanging.all()  # something must stay


def _rim_of(edges: IntArray, size: int) -> _Rim:
    """Return the rim of (E, 2) directed edges between vertices below ``size``."""
    start, end = edges.T
    rim = _Rim(np.full(size, -1), np.full(size, -1))
    rim.before[end], rim.after[start] = start, end
    single = (np.bincount(start, minlength=size) == 1) & (np.bincount(end, minlength=size) == 1)
    rim.leave(np.flatnonzero(~single))
    return rim


def _closed_notches(points_m: FloatArray, surface: Surface, triangles: IntArray, rim: _Rim) -> IntArray:
    """Return (N, 3) triangles that close notches, the sharpest first; take their corners off the rim."""
    size = len(points_m)
    single = rim.before >= 0
    on = single.copy()
    on[rim.before[single]] = on[rim.after[single]] = True
    rows, edges = np.flatnonzero(on), directed_edges(triangles[on[triangles].sum(axis=1) > 1])
    step = np.array([size, 1])
    keys = np.sort(edges[on[edges].all(axis=1)] @ step)
    tree = cKDTree(points_m[rows])
    guessed = _guessed(surface)
    made: list[IntArray] = [np.empty((0, 3), np.int64)]
    for _ in range(PASSES):
        new, angle = _notches(points_m, np.asarray(surface.normals), rim)
        free = (guessed[new].sum(axis=1) <= MOST_GUESSED) & ~_among(keys, new[:, 2] * size + new[:, 0])
        new, angle = new[free], angle[free]
        free = _empty(points_m, new, tree, rows, surface.radii_m[-1])
        new = _apart(new[free], angle[free], size)
        if not len(new):
            break
        made.append(new)
        after, corner, before = new.T
        shut = _among(keys, after * size + before)
        keys = np.sort(np.concatenate([keys, directed_edges(new) @ step]))
        rim.cut(before, corner, after)
        rim.leave(np.concatenate([before[shut], after[shut]]))
    return np.concatenate(made)


def _notches(points_m: FloatArray, normals: FloatArray, rim: _Rim) -> tuple[IntArray, FloatArray]:
    """Return (N, 3) triangles in the notches of a rim (after, corner, before), and (N,) their angles, rad."""
    corner = np.flatnonzero(rim.before >= 0)
    new = np.stack([rim.after[corner], corner, rim.before[corner]], axis=1)
    angle = _angles(points_m, new)
    sharp = (angle < NOTCH_RAD) & (new[:, 0] != new[:, 2])
    new, angle = new[sharp], angle[sharp]
    facing = np.einsum("fi,fki->fk", _directions(points_m, new), normals[new])
    fits = np.all(facing > FACING, axis=1)
    return new[fits], angle[fits]


def _apart(new: IntArray, angle: FloatArray, size: int) -> IntArray:
    """Return those of (N, 3) triangles that are sharper than all others with which they share a corner."""
    rank = np.empty(len(new), np.int64)
    rank[np.argsort(angle, kind="stable")] = np.arange(len(new))
    least = np.full(size, len(new))
    np.minimum.at(least, new.reshape(-1), np.repeat(rank, 3))
    return new[np.all(least[new] == rank[:, None], axis=1)]


def _empty(points_m: FloatArray, new: IntArray, tree: cKDTree, rows: IntArray, largest_m: float) -> BoolArray:
    """Return (N,) True for triangles whose smallest ball is small enough and holds no other rim vertex."""
    if not len(new):
        return np.zeros(0, bool)
    corners_m = points_m[new]
    sides_m2 = np.sum((np.roll(corners_m, -1, axis=1) - np.roll(corners_m, -2, axis=1)) ** 2, axis=2)
    weights = sides_m2 * (sides_m2.sum(axis=1, keepdims=True) - 2.0 * sides_m2)
    blunt = np.any(weights <= 0.0, axis=1)
    weights[blunt] = np.arange(3) != sides_m2[blunt].argmax(axis=1)[:, None]
    weights /= weights.sum(axis=1, keepdims=True)
    centers_m = np.einsum("fk,fki->fi", weights, corners_m)
    radii_m = np.min(np.linalg.norm(corners_m - centers_m[:, None], axis=2) + 1e9 * (weights == 0.0), axis=1)
    distances_m, near = tree.query(centers_m, k=min(4, len(rows)))
    others = np.all(rows[near][:, :, None] != new[:, None, :], axis=2)
    return (radii_m <= largest_m) & ~np.any(others & (distances_m < 0.999 * radii_m[:, None]), axis=1)


def _spikes(points_m: FloatArray, triangles: IntArray, rim: _Rim) -> BoolArray:
    """Return (F,) True for sharp triangles that hang by one edge, and take their free corners off the rim."""
    uses = np.bincount(triangles.reshape(-1), minlength=len(points_m))
    corner = np.flatnonzero((rim.before >= 0) & (uses == 1))
    new = np.stack([rim.before[corner], corner, rim.after[corner]], axis=1)
    others = np.minimum(_angles(points_m, new[:, [1, 0, 2]]), _angles(points_m, new[:, [1, 2, 0]]))
    sharp = (_angles(points_m, new) < SPIKE_RAD) | (others < SLIVER_RAD)
    new = new[sharp & np.all(uses[new[:, [0, 2]]] > 1, axis=1)]
    rim.cut(*new.T)
    spike = np.zeros(len(points_m), bool)
    spike[new[:, 1]] = True
    return np.any(spike[triangles], axis=1)


def _bounds_m(surface: Surface, sigma_m: FloatArray | None, rim: _Rim) -> FloatArray:
    """Return (V,) largest move: half the noise, at most half the mean length of the two rim edges."""
    points_m, bounds_m = surface.vertices_m, np.zeros(len(surface.vertices_m))
    if sigma_m is None:
        return bounds_m
    own = np.flatnonzero((rim.before >= 0) & ~_guessed(surface))
    own = own[rim.before[rim.before[own]] != rim.after[own]]  # a lone triangle would shrink
    for there in (rim.before[own], rim.after[own]):
        bounds_m[own] += 0.25 * np.linalg.norm(points_m[there] - points_m[own], axis=1)
    return np.minimum(bounds_m, NOISE_SHARE * np.nan_to_num(sigma_m))


def _smoothed_m(
    points_m: FloatArray, normals: FloatArray, triangles: IntArray, rim: _Rim, bounds_m: FloatArray
) -> FloatArray:
    """Return (V, 3) vertices smoothed along the rim, each in its tangent plane and its bound."""
    own = np.flatnonzero(bounds_m > 0.0)
    before, after, normal = rim.before[own], rim.after[own], normals[own]
    start_m, bound_m, moved_m = points_m[own], bounds_m[own], points_m.copy()
    for factor in STEPS:
        to_middle_m = 0.5 * (moved_m[before] + moved_m[after]) - moved_m[own]
        move_m = moved_m[own] + factor * to_middle_m - start_m
        move_m -= np.sum(move_m * normal, axis=1, keepdims=True) * normal
        length_m = np.maximum(np.linalg.norm(move_m, axis=1), 1e-300)
        moved_m[own] = start_m + np.minimum(1.0, bound_m / length_m)[:, None] * move_m
    return points_m + _harmless_m(points_m, moved_m - points_m, triangles)


def _harmless_m(points_m: FloatArray, moves_m: FloatArray, triangles: IntArray) -> FloatArray:
    """Shorten (V, 3) moves until no triangle turns over or becomes thin."""
    moves_m = moves_m.copy()
    changed = np.any(moves_m != 0.0, axis=1)
    touched = triangles[np.any(changed[triangles], axis=1)]
    for halving in count():
        near = touched[np.any(changed[touched], axis=1)]
        old, old_m2 = _crosses(points_m, near)
        new, new_m2 = _crosses(points_m + moves_m, near)
        spoilt = (np.sum(old * new, axis=1) < FACING * old_m2 * new_m2) | (new_m2 < LEAST_AREA * old_m2)
        if not spoilt.any():
            break
        changed[:] = False
        changed[near[spoilt]] = True
        moves_m[changed] *= 0.5 if halving < HALVINGS else 0.0
    return moves_m


def _guessed(surface: Surface) -> BoolArray:
    if surface.source is None:
        return np.zeros(len(surface.vertices_m), bool)
    return np.asarray(surface.source == PointSource.INFERRED)


def _crosses(points_m: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (F, 3) normals of triangles, as long as twice their areas, and (F,) these lengths."""
    a, b, c = points_m[triangles].swapaxes(0, 1)
    crosses = np.cross(b - a, c - a)
    return crosses, np.linalg.norm(crosses, axis=1)


def _directions(points_m: FloatArray, triangles: IntArray) -> FloatArray:
    """Return (F, 3) unit normals of triangles; 0 for those without area."""
    crosses, lengths = _crosses(points_m, triangles)
    return crosses / np.maximum(lengths, 1e-300)[:, None]


def _angles(points_m: FloatArray, triangles: IntArray) -> FloatArray:
    """Return (F,) angle of each triangle at its second corner, rad."""
    before, corner, after = points_m[triangles].swapaxes(0, 1)
    one, other = before - corner, after - corner
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), np.sum(one * other, axis=1))


def _among(keys: IntArray, searched: IntArray) -> BoolArray:
    """Return for each searched key whether it is among the sorted ``keys``."""
    if not len(keys):
        return np.zeros(len(searched), bool)
    found: BoolArray = keys[np.minimum(np.searchsorted(keys, searched), len(keys) - 1)] == searched
    return found
