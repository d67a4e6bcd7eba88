"""The place seen from above: outlines of floor and furniture, a camera's field of view, and its aim."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.kernels.geometry import pixel_rays
from pipeline.planning.places import floor_m
from pipeline.planning.seen import SeenPlace
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray

FLOOR_M = 0.1
"""Surface below this height above the floor is floor."""
TALLEST_M = 2.0
"""Surface above this height is ceiling or lamp."""
PIXEL_M = 0.01
"""Least size of a pixel of the image from which outlines are taken."""
MOST_PX = 2000
"""Largest side of that image."""
CLOSED_M = 0.03
"""Gaps and spots narrower than twice this are left out of the outlines."""
WEDGE_RAYS = 41
"""Number of points along the arc of a field of view."""


@dataclass(frozen=True, slots=True)
class Footprint:
    """Outlines of the measured surface from above; a part inside another one is a hole in it."""

    floor_m: tuple[FloatArray, ...]
    """(N, 2) outlines of the floor, x and y in the world."""
    things_m: tuple[FloatArray, ...]
    """(N, 2) outlines of furniture and walls between ``FLOOR_M`` and ``TALLEST_M``."""


def footprint(seen: SeenPlace) -> Footprint:
    """Return the outlines of the measured surface from above."""
    corners_m = seen.surface.vertices_m[seen.surface.triangles[~seen.guessed]]
    if not len(corners_m):
        return Footprint((), ())
    height_m = corners_m[:, :, 2].mean(axis=1) - floor_m(seen)
    things = (height_m > FLOOR_M) & (height_m < TALLEST_M)
    return Footprint(_outlines(corners_m[height_m <= FLOOR_M, :, :2]), _outlines(corners_m[things, :, :2]))


def _outlines(triangles_m: FloatArray) -> tuple[FloatArray, ...]:
    """Return the outlines of the area that (F, 3, 2) triangles cover, from an image of it."""
    if not len(triangles_m):
        return ()
    low_m = triangles_m.min(axis=(0, 1))
    pixel_m = max(PIXEL_M, float(np.ptp(triangles_m, axis=(0, 1)).max()) / MOST_PX)
    around = int(np.ceil(CLOSED_M / pixel_m)) + 1
    width, height = np.ceil(np.ptp(triangles_m, axis=(0, 1)) / pixel_m).astype(int) + 2 * around + 1
    image: ByteArray = np.zeros((height, width), np.uint8)
    for triangle in np.rint((triangles_m - low_m) / pixel_m).astype(np.int32) + around:
        cv2.fillConvexPoly(image, triangle, 255)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * around - 1, 2 * around - 1))
    image = cv2.morphologyEx(cv2.morphologyEx(image, cv2.MORPH_CLOSE, disc), cv2.MORPH_OPEN, disc)
    rings, _ = cv2.findContours(image, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    straight = [cv2.approxPolyDP(ring, 1.0, closed=True)[:, 0] for ring in rings]
    return tuple(low_m + pixel_m * (ring - around) for ring in straight if len(ring) > 2)


def wedge_m(T_world_camera: FloatArray, intrinsics: CameraIntrinsics, radius_m: float) -> FloatArray:
    """Return the (N, 2) outline of a camera's horizontal field of view from above, up to a distance.

    The field is that of the image's middle row; the first point is the camera.
    """
    row = pixel_rays(intrinsics)[intrinsics.height_px // 2]
    row = row[np.isfinite(row[:, 2])]
    row = row[np.unique(np.linspace(0, len(row) - 1, WEDGE_RAYS).astype(int))]
    ahead = (row @ T_world_camera[:3, :3].T)[:, :2]
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    eye_m = T_world_camera[:2, 3]
    return np.vstack([eye_m, eye_m + radius_m * ahead])
