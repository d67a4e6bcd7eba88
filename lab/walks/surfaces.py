"""A program's map and surface of a walk, judged by the true room (SPEC 10.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from trimesh.sample import sample_surface

from lab.walks.walk import WalkTruth
from pipeline.kernels.geometry import apply, pixel_rays, rigid
from pipeline.kernels.rays import Camera, hit_depths, tensor, triangle_scene
from pipeline.types import BoolArray, CameraIntrinsics, FloatArray, IntArray

JUDGED_EVERY = 20
"""Step between the judged frames of a walk: the part of the room that these look at is judged."""
JUDGED_TO_M = 4.0
"""Largest true depth of a judged ray."""
NEAR_M = (0.02, 0.05)
"""Distances from the other surface within which a point counts as on it."""
F_SCORES = tuple(f"f_{near_m * 100:.0f}cm" for near_m in NEAR_M)
"""Names of the F-scores at these distances in a row."""
BESIDE_M = 0.25
"""Distance from a judged frame's camera to a viewpoint that the walk did not have, to the right and left in
turn; walls are farther."""
_CELL_M = 0.02
"""Edge of the cells with one point of the true surface each, so that near surfaces do not count more."""
_MOST_POINTS = 200_000
"""Most points of a map or a mesh whose distance to the true surface is measured."""
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles in a program's world frame."""

    vertices_m: FloatArray
    """(V, 3)."""
    triangles: IntArray
    """(F, 3)."""


def map_distance_m(points_m: FloatArray, truth: WalkTruth) -> float:
    """Return the median distance of a map's (N, 3) points, metres, from the true surface.

    Of more than ``_MOST_POINTS`` points, every k-th is used.
    """
    some_m = points_m[:: max(1, -(-len(points_m) // _MOST_POINTS))]
    return float(np.median(_distances_m(some_m, Mesh(truth.vertices_m, truth.triangles))))


def surface_errors(mesh: Mesh, camera: CameraIntrinsics, truth: WalkTruth) -> Row:
    """Return the F-scores of a mesh in the room's frame, and the share of rays that do not meet it.

    Precision is over points drawn evenly from the mesh, recall over the true surface that the judged frames
    look at. The rays are those of the judged frames' cameras, moved by ``BESIDE_M``, that meet the true
    surface within ``JUDGED_TO_M``.
    """
    if not len(mesh.triangles):
        return dict.fromkeys(F_SCORES, 0.0) | {"without_surface": 1.0}
    room = Mesh(truth.vertices_m, truth.triangles)
    frames = [Camera(camera, T) for T in truth.T_world_camera[::JUDGED_EVERY]]
    solid = trimesh.Trimesh(mesh.vertices_m, mesh.triangles, process=False)
    to_room_m = _distances_m(np.asarray(sample_surface(solid, _MOST_POINTS, seed=0)[0]), room)
    to_mesh_m = _distances_m(_seen_m(room, frames), mesh)
    scores = [_f_score(to_room_m <= near_m, to_mesh_m <= near_m) for near_m in NEAR_M]
    return dict(zip(F_SCORES, scores, strict=True)) | {
        "without_surface": _without_surface(mesh, room, frames)
    }


def _f_score(precise: BoolArray, recalled: BoolArray) -> float:
    precision, recall = float(np.mean(precise)), float(np.mean(recalled))
    return 2.0 * precision * recall / (precision + recall) if precision + recall else 0.0


def _seen_m(room: Mesh, frames: Sequence[Camera]) -> FloatArray:
    """Return (N, 3) points of the true surface that the cameras look at, one in each cell."""
    seen_m = []
    for camera, depth in zip(frames, hit_depths(room.vertices_m, room.triangles, frames), strict=True):
        near = depth.z_m < JUDGED_TO_M
        rays = pixel_rays(camera.intrinsics)
        seen_m.append(apply(camera.T_world_camera, rays[near] * depth.z_m[near, None]))
    points_m = np.concatenate(seen_m)
    _, first = np.unique(np.floor(points_m / _CELL_M).astype(np.int64), axis=0, return_index=True)
    return points_m[first]


def _without_surface(mesh: Mesh, room: Mesh, frames: Sequence[Camera]) -> float:
    """Return the share of the rays to the room, from places next to the cameras, that miss the mesh."""
    cameras = [
        Camera(
            one.intrinsics, one.T_world_camera @ rigid(np.eye(3), np.array([(-1) ** k * BESIDE_M, 0.0, 0.0]))
        )
        for k, one in enumerate(frames)
    ]
    true_depths, own_depths = (hit_depths(some.vertices_m, some.triangles, cameras) for some in (room, mesh))
    missed = [
        np.isnan(own.z_m[true.z_m < JUDGED_TO_M]) for true, own in zip(true_depths, own_depths, strict=True)
    ]
    return float(np.mean(np.concatenate(missed)))


def _distances_m(points_m: FloatArray, mesh: Mesh) -> FloatArray:
    """Return (N,) distances of (N, 3) points to a surface."""
    scene = triangle_scene(mesh.vertices_m, mesh.triangles)
    return scene.compute_distance(tensor(points_m, np.float32)).numpy()
