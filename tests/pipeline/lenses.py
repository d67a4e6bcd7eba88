"""Cameras with each kind of lens, and OpenCV's projection as the reference."""

import cv2
import numpy as np

from pipeline.types import CameraIntrinsics, FloatArray

RATIONAL = (0.4899, -2.6336, 7.9e-4, -1.7e-4, 1.5327, 0.3653, -2.4525, 1.4580)
"""Colour camera of an Azure Kinect."""
KIND = {
    "brown": (301.0, (-0.25, 0.08, 1e-3, -2e-3, -0.01)),
    "rational": (152.0, RATIONAL),
    "prism": (301.0, (*RATIONAL, 1e-3, -2e-3, 3e-3, 1e-3)),
    "tilt": (301.0, (*RATIONAL, 1e-3, -2e-3, 3e-3, 1e-3, 0.02, -0.03)),
    "fisheye": (160.0, (-0.02, 0.01, -0.004, 0.001)),
}
"""Focal length in pixels, and coefficients, of lenses whose pixels in 320 x 240 all have rays."""


def camera(kind: str) -> CameraIntrinsics:
    """A camera whose pixels are not square and whose principal point is not in the middle."""
    focal_px, distortion = KIND[kind]
    matrix = np.array([[focal_px, 0.0, 161.3], [0.0, 1.01 * focal_px, 117.8], [0.0, 0.0, 1.0]])
    return CameraIntrinsics(matrix, np.array(distortion), 320, 240, kind == "fisheye")


def by_opencv(intrinsics: CameraIntrinsics, points_m: FloatArray) -> FloatArray:
    """(N, 2) pixels of (N, 3) points, by OpenCV's own functions."""
    points_m = np.ascontiguousarray(points_m, dtype=np.float64)
    how = np.zeros(3), np.zeros(3), intrinsics.matrix, intrinsics.distortion
    if intrinsics.fisheye:
        return cv2.fisheye.projectPoints(points_m[None], *how)[0][0]
    return cv2.projectPoints(points_m, *how)[0][:, 0]
