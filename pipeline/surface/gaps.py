"""Gaps, the holes that a viewer sees: connected regions of the cameras' images without a surface."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from pipeline.kernels.geometry import has_ray
from pipeline.kernels.rays import Camera
from pipeline.quality import Gaps
from pipeline.types import BoolArray, DepthMap, FloatArray

LARGE_M2 = 0.01
"""Least area of a large gap: a hand fits through it."""


def gaps_of(seen: Sequence[DepthMap], cameras: Sequence[Camera]) -> Gaps:
    """Find and measure the gaps in the depth images of a mesh.

    The outer rim of a scene is no gap if no camera looks past it, nor is an edge of the mesh in front of
    other surface. An image in which no ray hits the mesh has no gaps.

    Args:
        seen: depth of the mesh in each camera, NaN where a ray misses.
        cameras: cameras of these images.
    """
    areas_m2 = [
        _areas_m2(depth, camera) for depth, camera in zip(seen, cameras, strict=True) if depth.valid.any()
    ]
    every_m2 = np.concatenate([np.empty(0), *areas_m2])
    return Gaps(len(every_m2), int((every_m2 >= LARGE_M2).sum()), float(every_m2.sum()))


def _areas_m2(depth: DepthMap, camera: Camera) -> FloatArray:
    """Return (G,) areas of the gaps in one image, which must have a pixel with depth."""
    unknown = ~depth.valid
    missed = unknown & has_ray(camera.intrinsics)
    count, patch = cv2.connectedComponents(missed.astype(np.uint8), connectivity=4)
    pixel_m2 = _filled_m(depth, unknown) ** 2 / (camera.intrinsics.fx_px * camera.intrinsics.fy_px)
    sums_m2: FloatArray = np.bincount(patch[missed], pixel_m2[missed], count).astype(float)
    return sums_m2[1:]


def _filled_m(depth: DepthMap, unknown: BoolArray) -> FloatArray:
    """Return (H, W) depth, at pixels without depth that of the nearest pixel with depth."""
    _, nearest = cv2.distanceTransformWithLabels(
        unknown.astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    known_m = np.zeros(int(nearest.max()) + 1)
    known_m[nearest[~unknown]] = depth.z_m[~unknown]
    filled_m: FloatArray = known_m[nearest]
    return filled_m
