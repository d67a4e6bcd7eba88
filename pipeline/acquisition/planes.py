"""Local planes of a depth image at every pixel, and the noise of its depth.

All values are in 1/z: planes are linear in it, and a disparity sensor's steps are equal.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.kernels.ordering import stable_order
from pipeline.types import BoolArray, CameraIntrinsics, DepthMap, DepthNoise, FloatArray

FARTHEST_SD = 3.0
"""Standard deviations from a surface up to which a pixel belongs to it: noise alone exceeds three on one
side once in four hundred pixels, and hardly ever on both sides."""
STEEPEST_DEG = 85.0
"""Largest angle of incidence of a measured surface: Nguyen et al. 2012 found that a Kinect's depth fails
between 80 and 90 degrees. A depth step that would need a larger angle is an edge."""
LATERAL_PX = 1.0
"""Lateral error of a measurement: 0.8 pixels (Nguyen et al. 2012) and half a pixel of the grid. On a
slanted surface it becomes an error of the depth, so that noise grows with the angle."""
PLANE_PX = 5
"""Side of a local plane's window: the smallest with two pixels on either side of the centre."""
REACH = 0.005
"""Distance up to which a surface is followed, as a share of the diagonal: 4 pixels at 640 x 480, the width
of the band without depth that sensors leave along an edge."""
BINS = 12
"""Number of depth bins, with equally many pixels, in which noise and steps are estimated."""


@dataclass(frozen=True, slots=True)
class LocalPlanes:
    """The local plane at every pixel of a depth image."""

    inverse: FloatArray
    """(H, W) float32 1/z, 1/m; 0 where unknown."""
    right: FloatArray
    """(H, W) float32 change of 1/z from a pixel to its right neighbour, on the local plane."""
    down: FloatArray
    """(H, W) float32 change of 1/z to the neighbour below."""
    sd: FloatArray
    """(H, W) float32 standard deviation of 1/z, 1/m."""

    @property
    def known(self) -> BoolArray:
        """(H, W) True where a depth was measured."""
        return self.inverse > 0

    @property
    def reach_px(self) -> int:
        """Distance in pixels up to which a surface is followed."""
        return max(2, round(REACH * float(np.hypot(*self.inverse.shape))))


def local_planes(
    depth: DepthMap,
    intrinsics: CameraIntrinsics,
    noise: DepthNoise | None = None,
    least_sd_m: FloatArray | None = None,
) -> LocalPlanes:
    """Estimate the local planes of a depth image.

    Args:
        depth: (H, W) depth, metres.
        intrinsics: the camera, whose focal length determines which steps are too steep for a surface.
        noise: the sensor's calibrated noise; None estimates it from the image.
        least_sd_m: (H, W) least standard deviation of each depth, NaN where there is none.
    """
    inverse = inverse_depth(depth)
    steepest = float(np.tan(np.radians(STEEPEST_DEG))) / intrinsics.fx_px
    across, below = surface_steps(inverse, steepest)
    right = mean_around(*across, (PLANE_PX - 1, PLANE_PX))
    down = mean_around(*below, (PLANE_PX, PLANE_PX - 1))
    slope = np.hypot(right, down)
    if noise is None:
        sd = np.hypot(typical_step(inverse, (across, below)), LATERAL_PX * slope)
    else:
        z_m = 1.0 / np.where(inverse > 0.0, inverse, 1.0)
        sd = noise.sd_m(z_m, 1.0 / np.hypot(1.0, slope * z_m * intrinsics.fx_px)) * inverse**2
    if least_sd_m is not None:
        sd = np.fmax(sd, least_sd_m * inverse**2)
    return LocalPlanes(inverse, right, down, sd.astype(np.float32))


def inverse_depth(depth: DepthMap) -> FloatArray:
    """Return (H, W) float32 1/z, 1/m; 0 where the depth is unknown."""
    known = depth.valid & (depth.z_m > 0.0)
    inverse: FloatArray = (known / np.where(known, depth.z_m, 1.0)).astype(np.float32)
    return inverse


Steps = tuple[FloatArray, BoolArray]
"""(H, W) differences of 1/z from every pixel to the next, and True where both are on one surface."""


def surface_steps(inverse: FloatArray, steepest: float) -> Iterator[Steps]:
    """Yield steps to the right, then down; ``steepest`` is the largest on a surface, as a share of 1/z."""
    for axis in (1, 0):
        following = np.roll(inverse, -1, axis)
        following[(slice(None), -1) if axis else -1] = 0.0
        step = following - inverse
        yield step, (inverse > 0) & (following > 0) & (np.abs(step) <= steepest * inverse)


def mean_around(step: FloatArray, smooth: BoolArray, size_px: tuple[int, int]) -> FloatArray:
    """Return (H, W) means of surface steps in a window of ``size_px`` around every pixel; 0 without any."""
    total, count = (
        cv2.boxFilter(layer, -1, size_px, anchor=(2, 2), normalize=False, borderType=cv2.BORDER_CONSTANT)
        for layer in (np.where(smooth, step, np.float32(0.0)), smooth.astype(np.float32))
    )
    return total / np.maximum(count, 1.0)


def typical_step(inverse: FloatArray, both: tuple[Steps, Steps]) -> FloatArray:
    """Return (H, W) median nonzero step between neighbours on a surface at each pixel's depth.

    For quantised depth it is one step, otherwise about one standard deviation of the noise, for disparity,
    millimetres and stereo alike.
    """
    differ = [smooth & (step != 0) for step, smooth in both]
    at = np.concatenate([inverse[where] for where in differ])
    size = np.concatenate([np.abs(step[where]) for (step, _), where in zip(both, differ, strict=True)])
    if not len(at):
        return np.zeros_like(inverse)
    order = stable_order(at.view(np.int32))  # positive floats are ordered like their bits
    parts = np.array_split(order, min(BINS, len(at)))
    middle, typical = ([np.median(of[part]) for part in parts] for of in (at, size))
    return np.interp(inverse, middle, typical)
