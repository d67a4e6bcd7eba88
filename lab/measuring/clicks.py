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
"""A click is at least this far from a depth edge: a hand does not aim better."""
EDGE_STEP = 0.05
"""Least step of an edge, as a share of the depth, besides what a slanted surface has."""
FLAT_PX, FLAT_M = 12, 0.001
"""A place is flat if the true surface within this distance is within this of one plane."""


@dataclass(frozen=True, slots=True)
class Click:
    """A mark made by a click into one camera's image."""

    mark: Mark
    true_m: FloatArray
    """(3,) true point of the same pixel."""
    raw_m: FloatArray | None
    """(3,) the sensor's own measurement of it, by the true camera; None in a hole."""
    true_normal: FloatArray
    """(3,) true normal there."""
    flat: bool
    """Whether the true surface is flat around it."""
    log_error: float
    """Logarithm of the true distance from the camera over that of the mark."""


def clicks(room: Room, rng: np.random.Generator) -> Iterator[Click]:
    """Yield clicks at random pixels of random cameras, for ever.

    The ray is that of the believed camera at the pose that was found; clicks that miss the surface are no
    clicks.
    """
    away = [away_from_edges(view) for view in room.true]
    rays = [geometry.pixel_rays(frame.intrinsics) for frame in room.frames]
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
        own = geometry.pixel_rays(view.camera)[v, u]
        true_m, raw_z = _world_m(view, own * view.z_m[v, u]), float(frame.depth.z_m[v, u])
        raw_m = _world_m(view, own * raw_z) if np.isfinite(raw_z) else None
        ranges_m = (
            np.linalg.norm(true_m - view.T_world_camera[:3, 3]),
            np.linalg.norm(marked.point_m - T[:3, 3]),
        )
        error = float(np.log(ranges_m[0] / ranges_m[1]))
        yield Click(marked, true_m, raw_m, view.normals[v, u].astype(float), is_flat(view, u, v), error)


def away_from_edges(view: TrueView) -> BoolArray:
    """Return (H, W) True for pixels away from depth edges."""
    inverse = (1.0 / view.z_m).astype(np.float32)
    bend = np.abs(cv2.Laplacian(inverse, cv2.CV_32F)) > EDGE_STEP * inverse
    side = 2 * EDGE_PX + 1
    return cv2.dilate(bend.astype(np.uint8), np.ones((side, side), np.uint8)) == 0


def is_flat(view: TrueView, u: int, v: int) -> bool:
    """Return whether the true surface around a pixel is a plane."""
    height, width = view.z_m.shape
    if not (FLAT_PX <= v < height - FLAT_PX and FLAT_PX <= u < width - FLAT_PX):
        return False
    square = np.s_[v - FLAT_PX : v + FLAT_PX + 1 : 4, u - FLAT_PX : u + FLAT_PX + 1 : 4]
    points_m = geometry.pixel_rays(view.camera)[square] * view.z_m[square][..., None]
    own = view.T_world_camera[:3, :3].T @ view.normals[v, u]
    off_m = (points_m - geometry.pixel_rays(view.camera)[v, u] * view.z_m[v, u]) @ own
    return bool(np.abs(off_m).max() <= FLAT_M)


def _world_m(view: TrueView, point_m: FloatArray) -> FloatArray:
    return geometry.apply(view.T_world_camera, point_m[None])[0]
