"""Names and coefficients of lenses in camera files."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.lens import COEFFICIENTS, FISHEYE_COEFFICIENTS
from pipeline.types import CameraIntrinsics, FloatArray

FISHEYE = "equidistant"
"""ROS's and Kalibr's name of the fisheye model, also used in the files that are written."""
_BROWN = "brown_conrady"
"""The RealSense SDK's name of the model plumb_bob; its variants differ from it if a coefficient is not 0."""
_FISHEYES = {FISHEYE, "fisheye", "opencv_fisheye", "kannala_brandt", "kannala_brandt4"}
_OPENCV = {"", "none", "plumb_bob", "radtan", _BROWN, "rational_polynomial"}
"""Names of OpenCV's model, which the number of coefficients extends."""
KNOWN = "plumb_bob with 5 coefficients, rational_polynomial with 8, 12 or 14, or equidistant with 4"


def is_fisheye_name(model: str) -> bool:
    """Return whether a file's name of a distortion model is that of a fisheye."""
    return _plain(model) in _FISHEYES


def is_known(model: str) -> bool:
    """Return whether a file's name of a distortion model is that of a supported lens; empty is OpenCV's."""
    return _plain(model) in _FISHEYES | _OPENCV


def _plain(model: str) -> str:
    """Return a name in ROS's form: brown_conrady for "Brown Conrady" and "distortion.brown_conrady"."""
    return model.lower().rpartition(".")[2].replace(" ", "_").replace("-", "_")


def ros_name(camera: CameraIntrinsics) -> str:
    """Return ROS's name of a camera's distortion model."""
    if camera.fisheye:
        return FISHEYE
    return "plumb_bob" if len(camera.distortion) == 5 else "rational_polynomial"


def lens_of(model: str, given: FloatArray) -> FloatArray | None:
    """Return a lens's coefficients as ``CameraIntrinsics`` has them; None if the lens is not supported.

    Args:
        model: the file's name of the distortion model; empty if it has none.
        given: (N,) its coefficients; missing ones are 0, and zeros at the end are dropped.
    """
    given = np.asarray(given, np.float64).ravel()
    used = len(np.trim_zeros(given, "b"))
    if not used and _plain(model).endswith(_BROWN):
        return np.zeros(COEFFICIENTS[0])
    counts = (FISHEYE_COEFFICIENTS,) if is_fisheye_name(model) else COEFFICIENTS
    count = next((count for count in counts if count >= used), None)
    if not is_known(model) or count is None or (used > counts[0] and len(given) not in counts):
        return None
    return np.pad(given[:count], (0, max(0, count - len(given))))
