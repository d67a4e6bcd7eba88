"""Back-projection of depth pixels to points in the camera frame (eq. 3.4)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.geometry import has_ray, pixel_rays
from pipeline.types import BoolArray, DepthMap, FloatArray, IntArray, PointCloud, PointSource, RgbdFrame


def back_project(
    frame: RgbdFrame, depth: DepthMap | None = None, source: PointSource = PointSource.SENSOR
) -> PointCloud:
    """Convert each pixel with known depth to a point in the camera frame, after removing the distortion.

    Depth is z, along the optical axis, for every lens. So a pixel at 90 degrees to the axis or more, or
    beyond the range in which the lens model holds, has no depth and gives no point.

    Args:
        frame: source of colours, intrinsics and, when ``depth`` is None, the depth.
        depth: (H, W) metric depth on the frame's pixel grid.
        source: label of every point; only sensor points get ``sigma_m``, because the sensor model does not
            apply to inferred depth.

    Raises:
        InputError: the depth is relative, not on the grid of image and intrinsics, or nowhere known.

    >>> import numpy as np, packetmesh as pm
    >>> camera = pm.CameraIntrinsics.pinhole(100.0, 100.0, 1.0, 0.0, width_px=2, height_px=1)
    >>> rgb, depth = np.zeros((1, 2, 3), np.uint8), pm.DepthMap(np.array([[2.0, 3.0]], np.float32))
    >>> pm.back_project(pm.RgbdFrame("node", rgb, depth, camera, np.eye(4))).points_m.round(6).tolist()
    [[-0.02, 0.0, 2.0], [0.0, 0.0, 3.0]]
    """
    depth = frame.depth if depth is None else depth
    known = pixels_in_front(frame, depth)
    places = np.flatnonzero(known)
    z_m = depth.z_m.reshape(-1).take(places).astype(np.float64)
    points_m = pixel_rays(frame.intrinsics).reshape(-1, 3).take(places, axis=0)
    points_m *= z_m[:, None]
    return PointCloud(
        points_m=points_m,
        colors=frame.rgb.reshape(-1, 3).take(places, axis=0),
        pixels=np.stack([places % known.shape[1], places // known.shape[1]], axis=1),
        sigma_m=_sigma_m(frame, places, z_m) if source == PointSource.SENSOR else None,
        source=np.full(len(z_m), source, dtype=np.uint8),
    )


def pixels_in_front(frame: RgbdFrame, depth: DepthMap) -> BoolArray:
    """Return (H, W) True for the pixels from which ``back_project`` makes a point.

    Raises:
        InputError: as for ``back_project``.
    """
    _check_grid(frame, depth)
    known = depth.valid & (depth.z_m > 0) & has_ray(frame.intrinsics)
    if not known.any():
        raise InputError(
            f"The depth image of {frame.name} has no valid pixel; check the file and the depth scale."
        )
    return known


def without_rayless(frame: RgbdFrame) -> RgbdFrame:
    """Return the frame with unknown depth at pixels without a ray; the frame itself if it has none there."""
    camera = frame.intrinsics
    if frame.depth.z_m.shape != (camera.height_px, camera.width_px):
        return frame  # ``pixels_in_front`` explains the sizes
    rayless = ~has_ray(camera)
    if not np.any(rayless & frame.depth.valid):
        return frame
    z_m = np.where(rayless, np.float32(np.nan), frame.depth.z_m)
    return replace(frame, depth=replace(frame.depth, z_m=z_m))


def _sigma_m(frame: RgbdFrame, places: IntArray, z_m: FloatArray) -> FloatArray:
    """Return (N,) standard deviations, metres: that of the recording's average where it is known, else by the
    sensor's calibrated noise at normal incidence, or by a Kinect's."""
    sd_m = depth_sigma_m(z_m) if frame.noise is None else frame.noise.sd_m(z_m)
    if frame.averaging is None:
        return sd_m
    own_m = frame.averaging.sd_m.reshape(-1).take(places)
    return np.where(np.isfinite(own_m), own_m, sd_m)


def depth_sigma_m(z_m: FloatArray) -> FloatArray:
    """Return the standard deviation of a Kinect's depth ``z_m`` (axial model, Nguyen et al. 2012)."""
    return 0.0012 + 0.0019 * (np.asarray(z_m) - 0.4) ** 2


def _check_grid(frame: RgbdFrame, depth: DepthMap) -> None:
    if depth.kind != "metric":
        raise InputError(
            f"The depth of {frame.name} is relative, so it has no scale; align it with the sensor first."
        )
    height_px, width_px = depth.z_m.shape
    camera = frame.intrinsics
    for what, other_height_px, other_width_px in (
        ("colour image is", *frame.rgb.shape[:2]),
        ("intrinsics are for", camera.height_px, camera.width_px),
    ):
        if (other_height_px, other_width_px) != (height_px, width_px):
            raise InputError(
                f"The depth image of {frame.name} is {width_px} x {height_px}, but its {what} "
                f"{other_width_px} x {other_height_px}; give images of the size the camera was calibrated at."
            )
