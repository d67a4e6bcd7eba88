"""Images of rational and fisheye lenses as a pinhole camera sees them, for depth networks and overlaps.

Networks are trained on nearly straight images. Both cameras have the same optical axis, so that a surface has
the same depth in both, and depth is only moved from pixel to pixel.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from pipeline.kernels.geometry import pixel_rays, project
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, FloatArray

WIDEST = math.tan(math.radians(60.0))
"""Largest |x / z| and |y / z| that a straight view shows: farther out, images would be mostly stretched."""
_OUTSIDE_PX = -10.0
"""Coordinate, outside every image, that stands for a pixel that the other camera does not see."""


def bends_strongly(camera: CameraIntrinsics) -> bool:
    """Return whether a camera's images are replaced by a straight view.

    It is True for a fisheye and for a lens with coefficients beyond k1, k2, p1, p2 and k3.
    """
    return camera.fisheye or bool(np.any(camera.distortion[5:]))


def straight_view(camera: CameraIntrinsics) -> CameraIntrinsics:
    """Return the pinhole camera of the same size that sees all of a camera's image, up to ``WIDEST``."""
    size = np.array([camera.width_px, camera.height_px])
    most = np.nanmax(np.abs(pixel_rays(camera)[..., :2]), axis=(0, 1))
    focal_px = float((0.5 * size / np.clip(most, 1e-6, WIDEST)).min())
    cx, cy = (0.5 * size - 0.5).tolist()
    return CameraIntrinsics.pinhole(focal_px, focal_px, cx, cy, camera.width_px, camera.height_px)


def straight_image(rgb: ByteArray, camera: CameraIntrinsics, view: CameraIntrinsics) -> ByteArray:
    """Return a (H, W, 3) image of ``camera`` on the pixels of ``view``; black outside the image."""
    return cv2.remap(rgb, *maps_between(camera, view), cv2.INTER_LINEAR, borderValue=(0, 0, 0))


def straight_depth(depth: DepthMap, camera: CameraIntrinsics, view: CameraIntrinsics) -> DepthMap:
    """Return depth of ``camera`` on the pixels of ``view``, each from the nearest pixel; NaN outside."""
    z = cv2.remap(depth.z_m, *maps_between(camera, view), cv2.INTER_NEAREST, borderValue=math.nan)
    return DepthMap(z, depth.kind)


def bent_depth(depth: DepthMap, camera: CameraIntrinsics, view: CameraIntrinsics) -> DepthMap:
    """Return depth of ``view`` on the pixels of ``camera``; NaN where ``view`` does not see."""
    z = cv2.remap(depth.z_m, *maps_between(view, camera), cv2.INTER_LINEAR, borderValue=math.nan)
    return DepthMap(z, depth.kind)


def maps_between(source: CameraIntrinsics, target: CameraIntrinsics) -> tuple[FloatArray, FloatArray]:
    """Return (H, W) float32 columns and rows in ``source`` of the pixels of ``target``."""
    pixels = project(source, pixel_rays(target).reshape(-1, 3))
    pixels = np.nan_to_num(pixels, nan=_OUTSIDE_PX).reshape(target.height_px, target.width_px, 2)
    columns, rows = np.moveaxis(pixels.astype(np.float32), -1, 0)
    return columns, rows
