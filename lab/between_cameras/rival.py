"""Redundancy removed at the sender by the relative pose (the idea of RPRR, Wang et al., arXiv 1707.05978).

A node warps the depth of the cameras that sent before into its own view and leaves out the tiles whose
depth is predicted. It knows its own depth exactly; of the others it has the base layer (which the sink must
send to it) or, if it hears them, all exact depth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from pipeline.acquisition import depth_sigma_m
from pipeline.delivery.left_out import pixels_of
from pipeline.delivery.tiled import TILE
from pipeline.kernels.geometry import apply, inverse, pixel_rays, project
from pipeline.types import BoolArray, CameraIntrinsics, FloatArray

Known = Literal["base", "exact"]
"""Depth of the other cameras that a node has."""


@dataclass(frozen=True, slots=True)
class Thresholds:
    """When a tile counts as predicted."""

    sigmas: float
    """Largest difference between measured and predicted depth, in standard deviations of both sensors."""
    share: float
    """Least share of the tile's measured pixels that are predicted."""


@dataclass(frozen=True, slots=True)
class DepthView:
    """A camera's depth image with its believed pose."""

    z_m: FloatArray
    """(H, W) metres; NaN where nothing was measured."""
    known_m: FloatArray
    """(H, W) the depth that other nodes have of it, metres."""
    intrinsics: CameraIntrinsics
    T_world_camera: FloatArray


def predicted_tiles(views: Sequence[DepthView], thresholds: Thresholds) -> tuple[BoolArray, ...]:
    """Return (rows, columns) tiles that each camera leaves out; the first camera sends all."""
    masks: list[BoolArray] = []
    for index, view in enumerate(views):
        shape = (view.z_m.shape[0], view.z_m.shape[1])
        predicted = np.zeros(shape, np.bool_)
        for other, mask in zip(views[:index], masks, strict=True):
            sent_m = np.where(pixels_of(mask, shape, TILE), np.nan, other.known_m)
            seen_m, sd_m = warped(other, sent_m, view)
            limit_m = thresholds.sigmas * np.hypot(depth_sigma_m(view.z_m), sd_m)
            with np.errstate(invalid="ignore"):
                predicted |= np.abs(view.z_m - seen_m) <= limit_m
        masks.append(_tiles(np.isfinite(view.z_m), predicted, thresholds.share))
    return tuple(masks)


def warped(other: DepthView, z_m: FloatArray, view: DepthView) -> tuple[FloatArray, FloatArray]:
    """Return another camera's depth in a view, and its standard deviation, (H, W); NaN where there is none.

    The nearest point wins; cracks of a pixel or two are closed by the mean of their neighbours.
    """
    known = np.isfinite(z_m)
    world_m = apply(other.T_world_camera, pixel_rays(other.intrinsics)[known] * z_m[known][:, None])
    here_m = apply(inverse(view.T_world_camera), world_m)
    sd_m = depth_sigma_m(z_m[known])
    ahead = here_m[:, 2] > 0.1
    here_m, sd_m = here_m[ahead], sd_m[ahead]
    u, v = np.rint(project(view.intrinsics, here_m)).astype(np.int64).T
    height, width = view.z_m.shape
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    place, depth_m, sd_m = v[inside] * width + u[inside], here_m[inside, 2], sd_m[inside]
    far_first = np.argsort(-depth_m, kind="stable")
    found = np.full((2, height * width), np.nan)
    found[0, place[far_first]] = depth_m[far_first]
    found[1, place[far_first]] = sd_m[far_first]
    return _closed(found[0].reshape(height, width)), _closed(found[1].reshape(height, width))


def _closed(z_m: FloatArray) -> FloatArray:
    """Fill pixels without a value by the mean of their 3 x 3 neighbours that have one, if at least four."""
    known = np.isfinite(z_m)
    total = cv2.boxFilter(np.where(known, z_m, 0.0), -1, (3, 3), normalize=False)
    number = cv2.boxFilter(known.astype(np.float64), -1, (3, 3), normalize=False)
    filled = ~known & (number > 3.5)
    return np.where(filled, total / np.maximum(number, 1.0), z_m)


def _tiles(measured: BoolArray, predicted: BoolArray, share: float) -> BoolArray:
    rows, columns = (-(-size // TILE) for size in measured.shape)
    padding = ((0, rows * TILE - measured.shape[0]), (0, columns * TILE - measured.shape[1]))

    def count(pixels: BoolArray) -> FloatArray:
        return np.pad(pixels, padding).reshape(rows, TILE, columns, TILE).sum(axis=(1, 3))

    there = count(measured)
    return np.asarray((there > 0) & (count(predicted & measured) >= share * there))
