"""Features of a colour image with their measured positions: those of SIFT, and the corners of AprilTags."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from pipeline.kernels.geometry import undistorted_rays
from pipeline.types import BoolArray, ByteArray, DepthNoise, FloatArray, IntArray, RgbdFrame

FEATURES = 1500
"""Largest number of SIFT features of an image, strongest first."""
CONTRAST = 0.005
"""Least contrast of a feature; OpenCV's default is 0.04, with which dim rooms have hardly any."""
WINDOW_PX = 2
"""A feature's depth is the median of the pixels up to this many rows and columns away."""
LEAST_MEASURED = 0.5
"""Least share of those pixels with measured depth."""
EDGE = 0.05
"""Largest range of those depths relative to the median, above the noise; a wider one is a depth edge."""
EDGE_SD = 6.0
"""Range of the depths that noise alone explains, in standard deviations."""
PIXEL_SD = 1.0
"""Standard deviation of a feature's place in the image, pixels."""
KINECT = DepthNoise(s0_m=0.0012, s1_m=0.0019, p=2.0, q=0.0)
"""Noise of a sensor that was not calibrated: about the Kinect's (Nguyen, Izadi, Lovell 2012)."""
TAGS = cv2.aruco.DICT_APRILTAG_36h11
"""Family of tags that is detected; families with fewer cells are also detected in noise."""


@dataclass(frozen=True, slots=True)
class LiftedFeatures:
    """Features of one frame that have a measured position in its camera frame."""

    name: str
    points_m: FloatArray
    """(N, 3) positions, strongest feature first."""
    sigma_m: FloatArray
    """(N,) standard deviation of the position."""
    sizes_m: FloatArray
    """(N,) diameter of the feature at its distance."""
    descriptors: ByteArray
    """(N, 128) SIFT descriptors."""
    tag_points_m: FloatArray
    """(K, 3) positions of tag corners."""
    tag_sigma_m: FloatArray
    """(K,) standard deviation of the position."""
    tag_keys: IntArray
    """(K,) four times the tag's number plus the number of its corner."""
    why_none: str = ""
    """Reason for which there are fewer than three positions, one sentence; else empty."""


class _Lifted(NamedTuple):
    """Measured positions of image places; places without one are left out."""

    rows: IntArray
    """(N,) rows of the places that have a position."""
    points_m: FloatArray
    sigma_m: FloatArray


def lifted_features(frame: RgbdFrame) -> LiftedFeatures:
    """Find SIFT features (Lowe 2004) and tag corners of a frame where its depth is measured and has no edge.

    A bad frame (images of different sizes, depth without a scale, a blank image) has no features, and
    ``why_none`` tells the reason.
    """
    if why_not := _why_not(frame):
        return _none(frame, why_not)
    gray = cv2.cvtColor(np.ascontiguousarray(frame.rgb), cv2.COLOR_RGB2GRAY)
    known = None if frame.rgb_known is None else frame.rgb_known.astype(np.uint8)
    found, descriptors = cv2.SIFT.create(FEATURES, 3, CONTRAST).detectAndCompute(gray, known)
    tag_keys, corners_px = _tags(gray, known)
    if not found and not len(tag_keys):
        return _none(
            frame, f"The colour image of {frame.name} has no features: it is blank, dark or blurred."
        )
    order = np.argsort([-key.response for key in found], kind="stable")
    keys = np.array([(*key.pt, key.size) for key in found]).reshape(-1, 3)[order]
    lifted, tags = (_lift(frame, places_px) for places_px in (keys[:, :2], corners_px))
    if len(lifted.rows) + len(tags.rows) < 3:
        return _none(
            frame,
            f"Of the {len(keys) + len(tag_keys)} features of {frame.name}'s colour image fewer than 3 have "
            "measured depth, away from depth edges.",
        )
    described = np.empty((0, 128)) if descriptors is None else descriptors[order][lifted.rows]
    per_px = lifted.points_m[:, 2] / frame.intrinsics.fx_px
    return LiftedFeatures(
        frame.name,
        lifted.points_m,
        lifted.sigma_m,
        keys[lifted.rows, 2] * per_px,
        described.astype(np.uint8),
        tags.points_m,
        tags.sigma_m,
        tag_keys[tags.rows],
    )


def _why_not(frame: RgbdFrame) -> str:
    """Return the reason for which a frame's images cannot be used; empty if they can."""
    if frame.depth.kind != "metric":
        return f"The depth of {frame.name} is relative, so its features have no positions in metres."
    height_px, width_px = frame.depth.z_m.shape
    camera = frame.intrinsics
    if {frame.rgb.shape[:2], (camera.height_px, camera.width_px)} != {(height_px, width_px)}:
        return (
            f"The depth image of {frame.name} is {width_px} x {height_px}, its colour image "
            f"{frame.rgb.shape[1]} x {frame.rgb.shape[0]} and its camera {camera.width_px} x "
            f"{camera.height_px}, so its features have no depth."
        )
    return ""


def _none(frame: RgbdFrame, why: str) -> LiftedFeatures:
    points_m, values = np.empty((0, 3)), np.empty(0)
    keys, descriptors = np.empty(0, np.int64), np.empty((0, 128), np.uint8)
    return LiftedFeatures(frame.name, points_m, values, values, descriptors, points_m, values, keys, why)


def _lift(frame: RgbdFrame, places_px: FloatArray) -> _Lifted:
    """Return the positions of (M, 2) image places; those at depth edges or without depth are left out."""
    z_m, smooth = _depth_at(frame, places_px)
    rays = undistorted_rays(frame.intrinsics, places_px)
    rows = np.flatnonzero(smooth & np.isfinite(rays).all(axis=1))
    z_m = z_m[rows]
    across_m = PIXEL_SD * z_m / frame.intrinsics.fx_px
    return _Lifted(rows, rays[rows] * z_m[:, None], np.hypot(_sd_m(frame, z_m), across_m))


def _depth_at(frame: RgbdFrame, places_px: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return (M,) median depth around image places, and True where it is measured and has no edge."""
    height_px, width_px = frame.depth.z_m.shape
    steps = np.arange(-WINDOW_PX, WINDOW_PX + 1)
    columns, rows = np.rint(places_px).astype(np.intp).reshape(-1, 2).T
    columns = np.clip(columns[:, None, None] + steps, 0, width_px - 1)
    rows = np.clip(rows[:, None, None] + steps[:, None], 0, height_px - 1)
    around_m = frame.depth.z_m[rows, columns].reshape(len(rows), len(steps) ** 2).astype(np.float64)
    around_m[~(around_m > 0.0)] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # windows without any depth
        z_m = np.nanmedian(around_m, axis=1)
        range_m = np.nanmax(around_m, axis=1) - np.nanmin(around_m, axis=1)
    measured = np.isfinite(around_m).mean(axis=1) >= LEAST_MEASURED
    return z_m, measured & (range_m <= EDGE * z_m + EDGE_SD * _sd_m(frame, z_m))


def _sd_m(frame: RgbdFrame, z_m: FloatArray) -> FloatArray:
    return (frame.noise or KINECT).sd_m(z_m)


def _tags(gray: ByteArray, known: ByteArray | None) -> tuple[IntArray, FloatArray]:
    """Return keys and (K, 2) places of the corners of all tags; a tag seen twice is returned twice."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(TAGS), settings)
    corners, ids, _ = detector.detectMarkers(gray if known is None else gray * (known > 0))
    if ids is None:
        return np.empty(0, np.int64), np.empty((0, 2))
    keys = 4 * np.asarray(ids, np.int64).reshape(-1, 1) + np.arange(4)
    return keys.ravel(), np.asarray(corners, np.float64).reshape(-1, 2)
