"""Base layers of cameras as points and surfaces: one depth for each block of pixels (``coarse``)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.acquisition import depth_sigma_m
from pipeline.delivery.coarse import DEPTH_BLOCK, SAME_SURFACE
from pipeline.kernels.geometry import apply, undistorted_rays
from pipeline.types import BoolArray, CameraIntrinsics, DepthNoise, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class BaseView:
    """A camera's base layer with its believed pose."""

    z_m: FloatArray
    """(ceil(H / 8), ceil(W / 8)) depth at the middle of each block, metres; NaN where it is unknown."""
    intrinsics: CameraIntrinsics
    T_world_camera: FloatArray
    """(4, 4) believed pose."""
    noise: DepthNoise | None = None
    """Noise of the sensor's depth; None means that of a Kinect."""

    def sd_m(self, z_m: FloatArray) -> FloatArray:
        """Return the standard deviation of measured depth ``z_m``, metres."""
        return depth_sigma_m(z_m) if self.noise is None else self.noise.sd_m(z_m)


@dataclass(frozen=True, slots=True)
class BasePoints:
    """The base points of a camera that have a normal, in the world frame."""

    rows: IntArray
    columns: IntArray
    """(N,) block of each point."""
    points_m: FloatArray
    """(N, 3)."""
    normals: FloatArray
    """(N, 3) unit normals towards the camera."""


@dataclass(frozen=True, slots=True)
class SurfaceAt:
    """The surface that a camera sees at K places."""

    z_m: FloatArray
    """(K,) its depth, metres; NaN where it is unknown."""
    rows: IntArray
    columns: IntArray
    """(K, 4) blocks between which it was interpolated; any where the depth is unknown."""


def block_centers(size: int) -> FloatArray:
    """Return the middle of each block along a side of ``size`` pixels, in pixels."""
    starts = np.arange(0, size, DEPTH_BLOCK)
    return starts + 0.5 * (np.minimum(DEPTH_BLOCK, size - starts) - 1)


def _block_points(view: BaseView) -> FloatArray:
    """Return (h, w, 3) points of all blocks, world frame; NaN where the depth is unknown."""
    u, v = np.meshgrid(
        block_centers(view.intrinsics.width_px), block_centers(view.intrinsics.height_px), indexing="xy"
    )
    rays = undistorted_rays(view.intrinsics, np.stack([u, v], axis=-1).reshape(-1, 2))
    points_m = rays * view.z_m.reshape(-1, 1).astype(np.float64)
    return apply(view.T_world_camera, points_m).reshape(*view.z_m.shape, 3)


def base_points(view: BaseView) -> BasePoints:
    """Return the base points whose neighbours in row and column are on the same surface."""
    points_m = np.pad(_block_points(view), ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    z_m = np.pad(view.z_m.astype(np.float64), 1, constant_values=np.nan)
    here = points_m[1:-1, 1:-1]
    across = _step(points_m, z_m, 1)
    down = _step(points_m, z_m, 0)
    normals = np.cross(across, down)
    with np.errstate(invalid="ignore", divide="ignore"):
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    towards = view.T_world_camera[:3, 3] - here
    normals *= np.sign(np.sum(normals * towards, axis=-1, keepdims=True))
    rows, columns = np.nonzero(np.isfinite(normals).all(axis=-1))
    return BasePoints(rows, columns, here[rows, columns], normals[rows, columns])


def _step(points_m: FloatArray, z_m: FloatArray, axis: int) -> FloatArray:
    """Return (h, w, 3) differences between the neighbours before and after, or to the only one there is."""
    inner = (slice(1, -1), slice(1, -1))
    before, after = list(inner), list(inner)
    before[axis], after[axis] = slice(0, -2), slice(2, None)
    ends = []
    for end in (tuple(before), tuple(after)):
        same = np.abs(z_m[end] - z_m[inner]) <= SAME_SURFACE * z_m[inner]
        ends.append(np.where(same[..., None], points_m[end], points_m[inner]))
    step = ends[1] - ends[0]
    step[np.all(step == 0.0, axis=-1)] = np.nan
    return step


def surface_at(view: BaseView, pixels: FloatArray) -> SurfaceAt:
    """Return the surface that a camera sees at (K, 2) pixels, which may be outside of its image, or NaN.

    The four blocks around a pixel must have depth and be on one surface. Between them the inverse depth is
    interpolated, which is exact on planes.
    """
    height, width = view.z_m.shape
    position = (pixels[:, ::-1] - 0.5 * (DEPTH_BLOCK - 1)) / DEPTH_BLOCK
    inside = np.all((position >= 0) & (position <= (height - 1, width - 1)), axis=1)
    position = np.where(inside[:, None], position, 0.0)
    top, left = np.minimum(np.floor(position), (height - 2, width - 2)).astype(np.int64).clip(0).T
    bottom, right = np.minimum(top + 1, height - 1), np.minimum(left + 1, width - 1)
    down, across = position[:, 0] - top, position[:, 1] - left
    rows, columns = np.stack([top, top, bottom, bottom], 1), np.stack([left, right, left, right], 1)
    weights = np.stack(
        [(1 - down) * (1 - across), (1 - down) * across, down * (1 - across), down * across], 1
    )
    corners_m = view.z_m[rows, columns].astype(np.float64)
    middle_m = 1.0 / np.sum(weights / corners_m, axis=1)
    one_surface = inside & (np.ptp(corners_m, axis=1) <= SAME_SURFACE * middle_m)
    return SurfaceAt(np.where(one_surface, middle_m, np.nan), rows, columns)


def at_edges(z_m: FloatArray) -> BoolArray:
    """Return (h, w) True for blocks beside which, in row or column, the depth jumps."""
    edge = np.zeros(z_m.shape, np.bool_)
    for axis in (0, 1):
        nearer, farther = np.moveaxis(z_m, axis, 0)[:-1], np.moveaxis(z_m, axis, 0)[1:]
        with np.errstate(invalid="ignore"):
            jump = np.abs(farther - nearer) > SAME_SURFACE * np.minimum(nearer, farther)
        along = np.moveaxis(edge, axis, 0)
        along[:-1] |= jump
        along[1:] |= jump
    return edge
