"""Boxes and holes of a reconstructed room, measured, and their true sizes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import islice

import numpy as np

from lab.measuring.clicks import away_from_edges
from lab.measuring.rooms import Room, TrueView
from lab.worlds.raycast import world_mesh
from packetmesh.errors import InputError
from pipeline.kernels import geometry
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import first_hits, triangle_scene
from pipeline.measuring.boxes import box_of_part
from pipeline.measuring.holes import hole_area
from pipeline.measuring.marks import mark_on_ray
from pipeline.measuring.measures import Measure
from pipeline.measuring.planes import rectangle
from pipeline.surface.boundary import loop_areas_m2
from pipeline.surface.holes import find_holes
from pipeline.types import BoolArray, FloatArray

LEAST_SIDE_M = 0.08
"""Least side of a top that is measured."""
LEVEL_M = 0.002
"""The vertices of a part that are at most this much below its highest one are its top; levels that differ by
less are one."""
SEEN_M = 0.01
"""A camera sees a place if the true point at its pixel is at most this far from it."""
AROUND_M, OFF_M = 0.03, 0.005
"""Up to the first distance outside of a top, the true surface is farther than the second from its plane."""
SEEN_SHARE = 0.97
"""Share of a top's places that one camera has to see, and of those outside that have to be off its plane."""
GRID = 12
STANDS_SHARE = 0.5
"""Least share of the places around a top below which the same level is: what the thing stands on."""
HOLES = 12
"""Most holes in a room, the largest first."""
RIM_M = 0.05
"""The true point of a rim's vertex is at most this far from it."""
Judged = tuple[Measure, tuple[float, ...], float]
"""A measure, the true values in its order, and the seconds that measuring took."""


def true_boxes(room: Room) -> Iterator[Judged]:
    """Yield measured boxes of things with a level rectangular top, their true sides (m), and the times (s).

    Only tops that one camera sees whole, and around which nothing is as high, are measured, by a click on
    their middle; the sides are in the order of the measure's values.
    """
    points_m = [view.points_m() for view in room.true]
    world = triangle_scene(*world_mesh(room.scene))
    for corner_m, sides_m in _tops(room):
        stand_m = _stand_m(world, corner_m, sides_m)
        if stand_m is None:
            continue
        for k, view in enumerate(room.true):
            if not _alone(view, points_m[k], corner_m, sides_m):
                continue
            middle_m = corner_m + 0.5 * sides_m.sum(axis=0)
            pixel = geometry.project(view.camera, _in_camera(view, middle_m[None]))[0]
            u, v = np.rint(pixel).astype(int)
            T, ray = room.T_world_camera[k], geometry.pixel_rays(room.frames[k].intrinsics)[v, u]
            started = time.perf_counter()
            try:
                place_m = mark_on_ray(room.surface, T[:3, 3], T[:3, :3] @ ray).point_m
                measure = box_of_part(room.surface, place_m)
            except InputError:
                continue
            elapsed_s = time.perf_counter() - started
            flat_m = sorted((float(np.linalg.norm(side_m)) for side_m in sides_m), reverse=True)
            yield measure, (*flat_m, float(middle_m[2] - stand_m)), elapsed_s
            break


def _stand_m(
    world: o3d.t.geometry.RaycastingScene, corner_m: FloatArray, sides_m: FloatArray
) -> float | None:
    """Return the height of the level below most places around a top; None if there is no such level."""
    reach = AROUND_M / np.linalg.norm(sides_m, axis=1)
    steps = np.linspace(0.0, 1.0, GRID)
    ends = [
        np.column_stack([np.full(GRID, end), steps])[:, ::turn]
        for turn, far in ((1, reach[0]), (-1, reach[1]))
        for end in (-far, 1.0 + far)
    ]
    places_m = corner_m + np.concatenate(ends) @ sides_m
    down = np.tile([0.0, 0.0, -1.0], (len(places_m), 1))
    below_m = first_hits(world, places_m, down)
    heights_m = np.where(np.isfinite(below_m), places_m[:, 2] - below_m, np.nan)
    near = np.abs(heights_m[:, None] - heights_m) < LEVEL_M
    most = int(near.sum(axis=1).argmax())
    return float(np.median(heights_m[near[most]])) if near[most].mean() >= STANDS_SHARE else None


def _tops(room: Room) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield (3,) a corner and (2, 3) the sides of each level rectangular top, except those of the shell."""
    for part in room.scene.parts[6:]:
        vertices_m = geometry.apply(part.T_world_part, part.vertices_m)
        top_m = vertices_m[vertices_m[:, 2] > vertices_m[:, 2].max() - LEVEL_M]
        if len(top_m) < 4:
            continue
        axes, low_m, high_m = rectangle(top_m[:, :2], (0.0, 100.0))
        sides_m, flat_m = high_m - low_m, top_m[:, :2] @ axes.T
        corners = np.array([[x, y] for x in (low_m[0], high_m[0]) for y in (low_m[1], high_m[1])])
        off_m = np.linalg.norm(corners[:, None] - flat_m[None], axis=2).min(axis=1)
        if sides_m.min() >= LEAST_SIDE_M and off_m.max() < LEVEL_M:
            corner_m = np.append(low_m @ axes, top_m[:, 2].max())
            yield corner_m, np.column_stack([sides_m[:, None] * axes, np.zeros(2)])


def _alone(view: TrueView, points_m: FloatArray, corner_m: FloatArray, sides_m: FloatArray) -> bool:
    """Return whether a camera sees the whole of a top, and nothing of the same height just outside of it."""
    reach = AROUND_M / np.linalg.norm(sides_m, axis=1)
    steps = [np.linspace(-one, 1.0 + one, GRID) for one in reach]
    shares = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
    outside = np.any((shares < 0.0) | (shares > 1.0), axis=1)
    shares[~outside] = np.clip(shares[~outside], 0.05, 0.95)
    places_m = corner_m + shares @ sides_m
    found, there_m = _seen_m(view, points_m, places_m)
    off_m = np.linalg.norm(there_m - places_m, axis=1)
    inside = float(np.mean(found[~outside] & (off_m[~outside] < SEEN_M)))
    around = np.abs(there_m[outside] - corner_m)[found[outside], 2]
    return inside >= SEEN_SHARE and len(around) > 0 and float(np.mean(around > OFF_M)) >= SEEN_SHARE


def _in_camera(view: TrueView, places_m: FloatArray) -> FloatArray:
    return geometry.apply(geometry.inverse(view.T_world_camera), places_m)


def _seen_m(view: TrueView, layers: FloatArray, places_m: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Return (N,) whether places are in an image, and (N, K) values of (H, W, K) layers at their pixels."""
    own_m = _in_camera(view, places_m)
    before = own_m[:, 2] > 0.1
    uv = geometry.project(view.camera, np.where(before[:, None], own_m, [0.0, 0.0, 1.0]))
    column, row = np.rint(uv).astype(int).T
    height, width = view.z_m.shape
    found = before & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    return found, layers[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]


def true_holes(room: Room) -> Iterator[Judged]:
    """Yield the measured areas of the largest holes, the areas of their true rims (m^2), and the times (s).

    The true point of a rim's vertex is the surface that a camera sees at the vertex's pixel. A hole counts if
    one camera has the whole rim in its image, with every true point within ``RIM_M`` of its vertex and no
    pixel next to a depth edge, where the true point is ambiguous.
    """
    surface = room.surface
    holes = (hole for hole in find_holes(surface.vertices_m, surface.triangles) if hole.open)
    layers = [np.dstack([view.points_m(), away_from_edges(view)]) for view in room.true]
    for hole in islice(holes, HOLES):
        rim_m = surface.vertices_m[hole.loop]
        for k, view in enumerate(room.true):
            believed = TrueView(room.frames[k].intrinsics, room.T_world_camera[k], view.z_m, view.normals)
            found, there = _seen_m(believed, layers[k], rim_m)
            there_m, away = there[:, :3], there[:, 3] > 0.0
            if not (found & away).all() or np.linalg.norm(there_m - rim_m, axis=1).max() > RIM_M:
                continue
            started = time.perf_counter()
            measure = hole_area(surface, rim_m[0])
            elapsed_s = time.perf_counter() - started
            if len(measure.ends_m) == len(rim_m):
                vector_m2 = loop_areas_m2(there_m, np.roll(there_m, -1, axis=0), np.array([0]))[0]
                yield measure, (float(np.linalg.norm(vector_m2)),), elapsed_s
            break
