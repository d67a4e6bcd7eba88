"""Registration of a separate depth camera's image to the colour camera's pixel grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from pipeline.kernels.geometry import apply, project, undistorted_rays
from pipeline.types import BoolArray, CameraIntrinsics, DepthMap, FloatArray, IntArray

RaysAt = Callable[[FloatArray], FloatArray]
"""Returns (N, 3) directions with z = 1 for (N, 2) positions in an image."""
REACH, OVERLAP = 0.5, 0.15
"""Half size of a depth pixel, and its enlargement to close the cracks that noise opens, in depth pixels."""
STEEPEST = 0.05
"""Largest change of depth over a pixel, as a share of the depth; a larger one is an edge (SPEC 2)."""
STEP = 0.02
"""Share of the depth by which a surface in a crack must be nearer than the surface behind the crack."""
NEAREST_M = 0.02
"""Least distance in front of the colour camera."""
WIDEST_PX = 64
"""Most colour pixels, in width and height, that one depth pixel may cover."""
AT_ONCE = 40_000
"""Number of depth pixels processed together."""


def register_depth(
    depth: DepthMap,
    depth_camera: CameraIntrinsics,
    color_camera: CameraIntrinsics,
    T_color_depth: FloatArray,
) -> DepthMap:
    """Return depth on the colour camera's pixel grid, NaN where no measured surface is visible.

    Every depth pixel becomes a small parallelogram in the colour image, inclined like its neighbourhood,
    so that a finer colour image has no gaps; the nearest one hides the others.
    ``cv2.registerDepth`` sets single pixels, leaves a grid of holes in a finer image, ignores distortion of
    the depth image and does not check whether a point is behind the camera.

    Args:
        depth: (h, w) metric, on the depth camera's grid.
        depth_camera: its intrinsics, whose distortion is removed.
        color_camera: target of the registration, with its distortion.
        T_color_depth: (4, 4) transform from the depth camera to the colour camera, metres.
    """
    z_m = carried(
        depth.z_m, lambda pixels: undistorted_rays(depth_camera, pixels), color_camera, T_color_depth
    )
    return DepthMap(z_m, depth.kind)


def carried(
    z_m: FloatArray, rays_at: RaysAt, color_camera: CameraIntrinsics, T_color_depth: FloatArray
) -> FloatArray:
    """Register depth of a camera given only by its rays, as ``register_depth``; returns (H, W) float32."""
    size = color_camera.height_px * color_camera.width_px
    own, near = np.full(size, np.inf, np.float32), np.full(size, np.inf, np.float32)
    limits = _limits(color_camera)
    for sides_m, center_m in _pieces(z_m, rays_at, T_color_depth):
        inside = _in_view(center_m, limits) & (sides_m[..., 2] > NEAREST_M).all(axis=0)
        at_px, seen_m, within = _covered(sides_m[:, inside], center_m[inside], color_camera)
        np.minimum.at(near, at_px, seen_m)
        np.minimum.at(own, at_px[within], seen_m[within])
    depth_m = np.where(near < (1.0 - STEP) * own, near, own)
    depth_m[np.isinf(depth_m)] = np.nan
    return depth_m.reshape(color_camera.height_px, color_camera.width_px)


def _pieces(
    z_m: FloatArray, rays_at: RaysAt, T_color_depth: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield (4, N, 3) midpoints of the left, right, upper and lower side of depth pixels and (N, 3) their
    centres, in the colour camera's frame.
    """
    z_m = z_m.astype(np.float64)
    slopes_m = np.stack([_slope(z_m, axis) for axis in (1, 0)], axis=-1)
    rows, columns = np.nonzero(np.isfinite(z_m) & (z_m > 0.0))
    for first in range(0, len(rows), AT_ONCE):
        v, u = rows[first : first + AT_ONCE], columns[first : first + AT_ONCE]
        pixels, here_m, slope_m = np.stack([u, v], axis=1).astype(float), z_m[v, u], slopes_m[v, u]
        points_m = [
            rays_at(pixels + offset) * (here_m + slope_m @ offset)[:, None]
            for offset in REACH * np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0], [0.0, 0.0]])
        ]
        *sides_m, center_m = (apply(T_color_depth, point_m) for point_m in points_m)
        yield np.stack(sides_m), center_m


def _slope(z_m: FloatArray, axis: int) -> FloatArray:
    """Return (H, W) change of depth per pixel: the smaller of both sides, and 0 across an edge."""
    step = np.diff(z_m, axis=axis)
    unknown = np.full_like(np.take(z_m, [0], axis=axis), np.nan)
    before = np.concatenate([unknown, step], axis=axis)
    after = np.concatenate([step, unknown], axis=axis)
    smaller = np.where(np.fmin(np.abs(before), np.abs(after)) == np.abs(after), after, before)
    return np.where(np.abs(smaller) < STEEPEST * z_m, smaller, 0.0)


def _limits(camera: CameraIntrinsics) -> tuple[FloatArray, FloatArray]:
    """Return least and largest x / z and y / z in the image; infinite if the rim has pixels without a ray."""
    u, v = np.arange(-1, camera.width_px + 1), np.arange(-1, camera.height_px + 1)
    rim = [np.column_stack([u, np.full_like(u, edge)]) for edge in (-1, camera.height_px)]
    rim += [np.column_stack([np.full_like(v, edge), v]) for edge in (-1, camera.width_px)]
    rays = undistorted_rays(camera, np.concatenate(rim).astype(float))[:, :2]
    if np.isnan(rays).any():
        return np.full(2, -np.inf), np.full(2, np.inf)
    return rays.min(axis=0), rays.max(axis=0)


def _in_view(points_m: FloatArray, limits: tuple[FloatArray, FloatArray]) -> BoolArray:
    z_m = np.maximum(points_m[:, 2:], NEAREST_M)
    flat = points_m[:, :2] / z_m
    return (points_m[:, 2] > NEAREST_M) & ((flat >= limits[0]) & (flat <= limits[1])).all(axis=1)


def _covered(
    sides_m: FloatArray, center_m: FloatArray, camera: CameraIntrinsics
) -> tuple[IntArray, FloatArray, BoolArray]:
    """Return (P,) colour pixels covered by pieces, their depth, and False where only OVERLAP covers them.

    A piece is a parallelogram; (s, t) is the position of a pixel from its centre, in units of its sides.
    """
    sides = np.stack([project(camera, side_m) for side_m in sides_m])
    center = project(camera, center_m)
    imaged = np.isfinite(sides).all(axis=(0, 2)) & np.isfinite(center).all(axis=1)
    sides_m, center_m, center = sides_m[:, imaged], center_m[imaged], center[imaged]
    left, right, above, below = sides[:, imaged]
    across, down = right - left, below - above
    wide = 1.0 + OVERLAP / REACH
    half = np.minimum(0.5 * wide * (np.abs(across) + np.abs(down)), 0.5 * WIDEST_PX)
    piece, pixel = _pixels_around(center, half, camera)
    s, t = _shares(pixel - center[piece], across[piece], down[piece])
    touched = np.maximum(np.abs(s), np.abs(t)) <= REACH + OVERLAP
    piece, pixel, s, t = piece[touched], pixel[touched], s[touched], t[touched]
    slope_m = sides_m[[1, 3], :, 2] - sides_m[[0, 2], :, 2]
    seen_m = center_m[piece, 2] + slope_m[0, piece] * s + slope_m[1, piece] * t
    within = np.maximum(np.abs(s), np.abs(t)) <= REACH
    return pixel[:, 1] * camera.width_px + pixel[:, 0], seen_m.astype(np.float32), within


def _pixels_around(
    center: FloatArray, half: FloatArray, camera: CameraIntrinsics
) -> tuple[IntArray, IntArray]:
    """Return (P,) centre and (P, 2) position of each pixel at most (N, 2) ``half`` from (N, 2) centres."""
    first = np.maximum(np.ceil(center - half), 0.0).astype(np.int64)
    last = np.minimum(np.floor(center + half), (camera.width_px - 1, camera.height_px - 1)).astype(np.int64)
    extent = np.maximum(last - first + 1, 0)
    counts = extent.prod(axis=1)
    row = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    return row, first[row] + np.stack([number % extent[row, 0], number // extent[row, 0]], axis=1)


def _shares(offset: FloatArray, across: FloatArray, down: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Express image offsets as s ``across`` + t ``down``; s and t are infinite where these are parallel."""
    area = across[:, 0] * down[:, 1] - across[:, 1] * down[:, 0]
    seen = np.abs(area) > 1e-12
    safe = np.where(seen, area, 1.0)
    s = (offset[:, 0] * down[:, 1] - offset[:, 1] * down[:, 0]) / safe
    t = (across[:, 0] * offset[:, 1] - across[:, 1] * offset[:, 0]) / safe
    return np.where(seen, s, np.inf), np.where(seen, t, np.inf)
