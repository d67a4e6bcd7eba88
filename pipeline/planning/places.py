"""Candidates for new cameras: places on walls, ceilings, furniture and tripods, and aims of the view."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.cluster.vq import kmeans2

from packetmesh.errors import InputError
from pipeline.kernels.geometry import look_at
from pipeline.kernels.rays import tensor, triangle_areas_m2
from pipeline.planning.seen import SeenPlace
from pipeline.types import BoolArray, FloatArray

Where = Literal["walls", "ceiling", "furniture", "tripods"]
WHERES: tuple[Where, ...] = get_args(Where)

MOST_CANDIDATES = 500
"""Most candidates that are judged."""
AIMS = 7
"""Points at which a camera may look: the middle of the surface, and the middles of unmeasured parts."""
WALL_HEIGHTS_M = 1.4, 2.6
"""Heights above the floor at which upright surface carries a camera."""
TOPS_M = 0.4, 1.4
"""Heights of the tops that count as furniture."""
TRIPOD_M = 1.0, 1.5
"""Heights of a camera on a tripod."""
CEILING_M = 2.0
"""Least height above the floor of a surface from which a camera hangs."""
OFF_WALL_M = 0.12
"""Distance of a camera from the surface that carries it."""
CLEAR_M = 0.3
"""Least distance of a tripod's camera from any surface."""
GRID_M = 0.4
"""Places are at least about this far apart."""
BESIDE_M = 0.4, 0.8
"""Distances to both sides of a present camera at which another tripod may stand."""
NEAREST_AIM_M = 0.5
STEEPEST = np.sin(np.radians(80.0))
"""Sine of the steepest view up or down."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A possible new camera."""

    T_world_camera: FloatArray
    where: Where


def candidates(seen: SeenPlace, where: Sequence[Where], most: int = MOST_CANDIDATES) -> tuple[Candidate, ...]:
    """Return at most ``most`` cameras on the allowed surfaces, in space that the present cameras see as free.

    Args:
        seen: the place; the world's third axis points up.
        where: kinds of places that are allowed.
        most: of more candidates, an even selection is returned.

    Raises:
        InputError: no kind is allowed, or the surface has no place of an allowed kind.
    """
    if not where:
        raise InputError(f"No camera may stand anywhere; allow one or more of {', '.join(WHERES)}")
    places = [(place, kind) for kind in WHERES if kind in where for place in free_places(seen, kind)]
    aims_m = aims(seen)
    found = [
        Candidate(look_at(place, aim), kind)
        for place, kind in places
        for aim in aims_m
        if _may_look(np.asarray(aim) - place)
    ]
    if not found:
        raise InputError(
            f"The surface has no free place for a camera on {' or '.join(where)}; allow another kind "
            f"({', '.join(WHERES)})"
        )
    rows = np.unique(np.linspace(0, len(found) - 1, most).astype(int))
    return tuple(found[row] for row in rows)


def aims(seen: SeenPlace) -> FloatArray:
    """Return (A, 3) points to look at: the surface's middle, and the middles of unmeasured parts."""
    middle_m = np.median(seen.surface.vertices_m, axis=0)
    points_m = seen.targets.points_m
    if len(points_m) < AIMS:
        return np.array([middle_m])
    middles_m, _ = kmeans2(points_m, AIMS - 1, seed=0, minit="++")
    return np.vstack([middle_m, middles_m])


def _may_look(way_m: FloatArray) -> bool:
    length_m = float(np.linalg.norm(way_m))
    return length_m >= NEAREST_AIM_M and abs(way_m[2]) <= STEEPEST * length_m


def floor_m(seen: SeenPlace) -> float:
    """Return the height of the lowest level part of the surface: 5 % of its level area are lower."""
    normals, middles_m, areas_m2 = triangles_of(seen)
    level = normals[:, 2] > 0.9
    if not level.any():
        return float(seen.surface.vertices_m[:, 2].min())
    order = np.argsort(middles_m[level, 2])
    below = np.cumsum(areas_m2[level][order])
    return float(middles_m[level, 2][order][np.searchsorted(below, 0.05 * below[-1])])


def triangles_of(seen: SeenPlace) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (F, 3) unit normals and middles, and (F,) areas, of the measured triangles."""
    corners_m = seen.surface.vertices_m[seen.surface.triangles[~seen.guessed]]
    normals = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    areas_m2 = triangle_areas_m2(seen.surface.vertices_m, seen.surface.triangles[~seen.guessed])
    return normals, corners_m.mean(axis=1), areas_m2


def free_places(seen: SeenPlace, kind: Where) -> Iterator[FloatArray]:
    """Yield (3,) places of one kind that are free."""
    proposed_m = _tripods(seen) if kind == "tripods" else _carried(seen, kind)
    clear_m = CLEAR_M if kind == "tripods" else 0.7 * OFF_WALL_M
    thinned_m = _apart(proposed_m)
    if len(thinned_m):
        yield from thinned_m[is_free(seen, thinned_m, clear_m)]


def _carried(seen: SeenPlace, kind: Where) -> FloatArray:
    """Return (N, 3) places just off the measured surface that carries a camera."""
    normals, middles_m, _ = triangles_of(seen)
    height_m = middles_m[:, 2] - floor_m(seen)
    if kind == "walls":
        low_m, high_m = WALL_HEIGHTS_M
        rows = (np.abs(normals[:, 2]) < 0.2) & (height_m > low_m) & (height_m < high_m)
    elif kind == "ceiling":
        rows = (normals[:, 2] < -0.9) & (height_m > CEILING_M)
    else:
        low_m, high_m = TOPS_M
        rows = (normals[:, 2] > 0.9) & (height_m > low_m) & (height_m < high_m)
    return middles_m[rows] + OFF_WALL_M * normals[rows]


def _tripods(seen: SeenPlace) -> FloatArray:
    """Return (N, 3) places above the floor, and to both sides of the present cameras."""
    normals, middles_m, _ = triangles_of(seen)
    on_floor_m = middles_m[(normals[:, 2] > 0.9) & (middles_m[:, 2] < floor_m(seen) + 0.1)]
    on_floor_m = _apart(on_floor_m)
    above_m = [on_floor_m + np.array([0.0, 0.0, height_m]) for height_m in TRIPOD_M]
    beside_m = [
        view.camera.T_world_camera[:3, 3] + side * away_m * view.camera.T_world_camera[:3, 0]
        for view in seen.views
        for away_m in BESIDE_M
        for side in (-1.0, 1.0)
    ]
    return np.vstack([*above_m, np.reshape(beside_m, (-1, 3))])


def _apart(places_m: FloatArray) -> FloatArray:
    """Return one of the places in each cube of ``GRID_M``: the one nearest to its middle."""
    cells = np.floor(places_m / GRID_M)
    off_m = np.linalg.norm(places_m - GRID_M * (cells + 0.5), axis=1)
    order = np.lexsort((off_m, *cells.T))
    _, first = np.unique(cells[order], axis=0, return_index=True)
    return places_m[order[np.sort(first)]]


def is_free(seen: SeenPlace, places_m: FloatArray, clear_m: float) -> BoolArray:
    """Return (N,) True for (N, 3) places in free cells and at least ``clear_m`` from any surface."""
    distance_m = seen.whole.compute_distance(tensor(places_m, np.float32)).numpy()
    return seen.space.is_free(places_m) & (distance_m >= clear_m)
