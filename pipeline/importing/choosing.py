"""Choice of a few frames of a long recording for a rig: different views that still overlap."""

from __future__ import annotations

import numpy as np

from pipeline.importing.sequence import Sequence
from pipeline.kernels.geometry import apply, inverse, pixel_rays, scaled
from pipeline.kernels.straight_view import bends_strongly, straight_view
from pipeline.types import CameraIntrinsics, FloatArray

LEAST_OVERLAP = 0.5
"""Least share of a chosen frame that another chosen frame also sees; registration needs about half."""
MOST_COMPARED = 150
"""Largest number of frames, spread over the recording, that are compared; the work grows with its square."""
_GRID_PX = 12
"""Longer side of the grid of points that represents a camera's image."""
_DEPTHS = (0.6, 1.0, 1.6)
"""Depths, as multiples of the typical depth, of the points that represent a camera's view."""


def choose(sequence: Sequence, count: int, typical_depth_m: float) -> tuple[int, ...]:
    """Choose at most ``count`` candidates; returns their indices in order of time.

    With poses: the first view has the largest overlap with all others; each next one has the smallest overlap
    with the chosen views, but at least ``LEAST_OVERLAP`` with one of them. Without poses: evenly spread.

    Args:
        sequence: the recording; its images are not read.
        count: number of frames to choose.
        typical_depth_m: typical distance of the scene.
    """
    number = len(sequence.candidates)
    if count >= number:
        return tuple(range(number))
    poses = [candidate.T_world_camera for candidate in sequence.candidates]
    known = [pose for pose in poses if pose is not None]
    if len(known) < number:
        return _spread(number, count)
    compared = _spread(number, min(number, MOST_COMPARED))
    T_world_camera = np.array([known[index] for index in compared])
    shared = overlaps(T_world_camera, sequence.camera, typical_depth_m)
    return tuple(sorted(compared[index] for index in apart_but_overlapping(shared, count)))


def apart_but_overlapping(shared: FloatArray, count: int) -> list[int]:
    """Return the indices of at most ``count`` views; fewer if no other view overlaps with those chosen.

    Args:
        shared: (N, N) symmetric overlaps, 0 to 1.
        count: number of views, at least one.
    """
    chosen = [int(shared.sum(axis=0).argmax())]
    while len(chosen) < min(count, len(shared)):
        nearest = shared[chosen].max(axis=0)
        allowed = nearest >= LEAST_OVERLAP
        allowed[chosen] = False
        if not allowed.any():
            break
        chosen.append(int(np.where(allowed, nearest, np.inf).argmin()))
    return chosen


def overlaps(T_world_camera: FloatArray, camera: CameraIntrinsics, typical_depth_m: float) -> FloatArray:
    """Compute (N, N) shares of each view that another view also sees; the smaller of both directions.

    A view is represented by points on a grid of its rays at three depths. A point that the other view sees
    counts by the cosine between the two rays, because a surface that faces one is oblique to the other.

    Args:
        T_world_camera: (N, 4, 4) poses, metres.
        camera: camera of all views.
        typical_depth_m: typical distance of the scene.
    """
    small = scaled(camera, _GRID_PX / max(camera.width_px, camera.height_px))
    small = straight_view(small) if bends_strongly(small) else small
    rays = pixel_rays(small).reshape(-1, 3)
    points_m = np.concatenate([rays * depth * typical_depth_m for depth in _DEPTHS])
    seen = np.empty((len(T_world_camera),) * 2)
    for i, T in enumerate(T_world_camera):
        for j, T_other in enumerate(T_world_camera):
            seen[i, j] = _seen(points_m, inverse(T_other) @ T, small)
    return np.minimum(seen, seen.T)


def _seen(points_m: FloatArray, T_other_own: FloatArray, camera: CameraIntrinsics) -> float:
    """Return the share of one view's (N, 3) points that another sees, weighted by the cosine between rays."""
    other_m = apply(T_other_own, points_m)
    x, y, z = other_m.T
    ahead = z > 1e-6
    depth_m = np.where(ahead, z, 1.0)
    u, v = camera.fx_px * x / depth_m + camera.cx_px, camera.fy_px * y / depth_m + camera.cy_px
    inside = (np.abs(u - (camera.width_px - 1) / 2) <= camera.width_px / 2) & (
        np.abs(v - (camera.height_px - 1) / 2) <= camera.height_px / 2
    )
    own_rays = points_m @ T_other_own[:3, :3].T
    lengths = np.linalg.norm(own_rays, axis=1) * np.linalg.norm(other_m, axis=1)
    cosines = np.einsum("ij,ij->i", own_rays, other_m) / np.maximum(lengths, 1e-12)
    return float(np.where(ahead & inside, np.maximum(cosines, 0.0), 0.0).mean())


def _spread(number: int, count: int) -> tuple[int, ...]:
    """Return ``count`` indices spread evenly over ``number``."""
    return tuple(np.linspace(0, number - 1, count).round().astype(int).tolist())
