"""Clicks on a reconstructed room, and the true point that the same pixel shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from lab.measuring.rooms import Room, TrueView
from packetmesh.errors import InputError
from pipeline.kernels import geometry
from pipeline.measuring.marks import Mark, mark_on_ray
from pipeline.types import BoolArray, FloatArray

EDGE_PX = 4
"""A click is at least this far from a depth edge, because a hand does not aim better."""
EDGE_STEP = 0.05
"""Least Laplacian of the inverse depth at an edge, as a share of the inverse depth; that of a plane is 0."""
FLAT_PX, FLAT_M = 36, 0.0005
"""A place is flat if the true surface around it, up to the first distance in the image, is within the second
of one plane. The patch is large because a small patch of a cushion is as flat, but its normal is not that of
the plane that is fitted to the cushion's top."""


@dataclass(frozen=True, slots=True)
class Click:
    """A mark made by a click into one camera's image."""

    mark: Mark
    true_m: FloatArray
    """(3,) true point of the same pixel, world frame."""
    raw_m: FloatArray | None
    """(3,) point by the sensor's depth at this pixel and the true camera and pose; None in a hole."""
    true_normal: FloatArray | None
    """(3,) unit normal of the true surface around it; None if that is not flat."""
    log_error: float
    """Logarithm of the true distance from the camera over that of the mark."""


def clicks(room: Room, rng: np.random.Generator) -> Iterator[Click]:
    """Yield clicks at random pixels of random cameras, without end.

    The ray is that of the believed camera at the pose that the chain found. Pixels near depth edges and rays
    that miss the surface are left out.
    """
    away = [away_from_edges(view) for view in room.true]
    rays = [geometry.pixel_rays(frame.intrinsics) for frame in room.frames]
    points_m = [view.points_m() for view in room.true]
    while True:
        k = int(rng.integers(len(room.frames)))
        frame, view, T = room.frames[k], room.true[k], room.T_world_camera[k]
        v, u = (int(rng.integers(size)) for size in view.z_m.shape)
        if not away[k][v, u]:
            continue
        try:
            marked = mark_on_ray(room.surface, T[:3, 3], T[:3, :3] @ rays[k][v, u])
        except InputError:
            continue
        true_m, camera_m = points_m[k][v, u], view.T_world_camera[:3, 3]
        raw_z = float(frame.depth.z_m[v, u])
        raw_m = camera_m + (true_m - camera_m) * raw_z / view.z_m[v, u] if np.isfinite(raw_z) else None
        ranges_m = (
            np.linalg.norm(true_m - camera_m),
            np.linalg.norm(marked.point_m - T[:3, 3]),
        )
        error = float(np.log(ranges_m[0] / ranges_m[1]))
        yield Click(marked, true_m, raw_m, flat_normal(points_m[k], camera_m, u, v), error)


def away_from_edges(view: TrueView) -> BoolArray:
    """Return (H, W) True for pixels farther than ``EDGE_PX`` from every depth edge."""
    inverse = (1.0 / view.z_m).astype(np.float32)
    bend = np.abs(cv2.Laplacian(inverse, cv2.CV_32F)) > EDGE_STEP * inverse
    side = 2 * EDGE_PX + 1
    return cv2.dilate(bend.astype(np.uint8), np.ones((side, side), np.uint8)) == 0


def flat_normal(points_m: FloatArray, camera_m: FloatArray, u: int, v: int) -> FloatArray | None:
    """Return the (3,) normal, towards the camera, of the true surface around a pixel; None if it is not flat.

    Args:
        points_m: (H, W, 3) true points.
        camera_m: (3,) centre of the camera.
        u: column of the pixel.
        v: row of the pixel.
    """
    height, width = points_m.shape[:2]
    if not (FLAT_PX <= v < height - FLAT_PX and FLAT_PX <= u < width - FLAT_PX):
        return None
    square = np.s_[v - FLAT_PX : v + FLAT_PX + 1 : 8, u - FLAT_PX : u + FLAT_PX + 1 : 8]
    away_m = points_m[square].reshape(-1, 3)
    away_m = away_m - away_m.mean(axis=0)
    normal = np.linalg.eigh(away_m.T @ away_m)[1][:, 0]
    if np.abs(away_m @ normal).max() > FLAT_M:
        return None
    return normal * (1.0 if float((camera_m - points_m[v, u]) @ normal) > 0.0 else -1.0)
