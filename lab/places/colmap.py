"""Pose of two RGB-D views by pycolmap: SIFT features, essential matrix, and the scale from measured depth."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from lab.places.pairs import PlacesPair
from pipeline.types import ByteArray, FloatArray, RgbdFrame

LEAST_MATCHES = 8
"""With fewer matches, or features in an image, there is no pose."""


def colmap_pose(pair: PlacesPair) -> FloatArray | None:
    """Return the (4, 4) pose T_target_source; None if too few features match, or no match has both depths.

    All settings are pycolmap's defaults. Its translation has an unknown length, which is set to the median of
    the lengths that the measured depths of the inlier matches give.
    """
    import pycolmap

    pycolmap.logging.minloglevel = 2
    pycolmap.set_random_seed(0)
    frames = (pair.source, pair.target)
    extractor = pycolmap.FeatureExtractor.create(device=pycolmap.Device.cpu)
    found = [extractor.extract_from_uint8_array(_gray(frame)) for frame in frames]
    places_px = [np.array([(point.x, point.y) for point in points]).reshape(-1, 2) for points, _ in found]
    if min(map(len, places_px)) < LEAST_MATCHES:
        return None
    matches = pycolmap.FeatureMatcher.create(device=pycolmap.Device.cpu).match(*found[0], *found[1])
    cameras = [_camera(pycolmap, frame) for frame in frames]
    views = (cameras[0], places_px[0], cameras[1], places_px[1])
    geometry = pycolmap.estimate_calibrated_two_view_geometry(*views, matches)
    found_pose = pycolmap.estimate_two_view_geometry_pose(*views, geometry)
    inliers = np.asarray(geometry.inlier_matches).reshape(-1, 2)
    motion = geometry.cam2_from_cam1
    if not found_pose or motion is None or len(inliers) < LEAST_MATCHES:
        return None
    lifted_m = [lifted(frame, places_px[k][inliers[:, k]]) for k, frame in enumerate(frames)]
    T = np.vstack([motion.matrix(), [0.0, 0.0, 0.0, 1.0]])
    return with_measured_scale(T, *lifted_m)


def with_measured_scale(T: FloatArray, source_m: FloatArray, target_m: FloatArray) -> FloatArray | None:
    """Return the (4, 4) pose with the median length of the translation over the matches with both depths.

    Args:
        T: (4, 4) pose T_target_source with a unit or zero translation.
        source_m: (N, 3) points of the matches in the source's frame; NaN without a depth.
        target_m: (N, 3) the same points in the target's frame; NaN without a depth.

    Returns:
        The pose; None if no match has both depths.
    """
    known = np.isfinite(source_m).all(axis=1) & np.isfinite(target_m).all(axis=1)
    if not known.any():
        return None
    way_m = target_m[known] - source_m[known] @ T[:3, :3].T
    result = T.copy()
    result[:3, 3] *= np.median(way_m @ T[:3, 3])
    return result


def lifted(frame: RgbdFrame, places_px: FloatArray) -> FloatArray:
    """Return the (N, 3) points, camera frame, of (N, 2) image places, by the depth of the nearest pixel.

    They are NaN where that pixel has no depth. The centre of the first pixel is (0.5, 0.5), as in COLMAP.
    """
    lens = frame.intrinsics
    columns, rows = np.clip(places_px.astype(int), 0, (lens.width_px - 1, lens.height_px - 1)).T
    z_m = frame.depth.z_m[rows, columns].astype(np.float64)
    x = (places_px[:, 0] - 0.5 - lens.cx_px) / lens.fx_px
    y = (places_px[:, 1] - 0.5 - lens.cy_px) / lens.fy_px
    return np.stack([x * z_m, y * z_m, z_m], axis=1)


def _gray(frame: RgbdFrame) -> ByteArray:
    gray: ByteArray = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY)
    return gray


def _camera(pycolmap: Any, frame: RgbdFrame) -> Any:
    lens = frame.intrinsics
    parameters = np.array([lens.fx_px, lens.fy_px, lens.cx_px + 0.5, lens.cy_px + 0.5])
    return pycolmap.Camera(model="PINHOLE", width=lens.width_px, height=lens.height_px, params=parameters)
