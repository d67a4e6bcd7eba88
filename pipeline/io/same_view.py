"""Cameras that show the same view: of depth in another number of pixels, and comparison of two cameras."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.geometry import scaled_to
from pipeline.types import AnyPath, CameraIntrinsics


def depth_camera_of(
    camera: CameraIntrinsics, shape: tuple[int, ...], depth: AnyPath, color: AnyPath, remedy: str
) -> CameraIntrinsics | None:
    """Return the camera of a depth image: the colour camera, resized; None if both sizes are equal.

    Telephones store such depth: 256 x 192 pixels of the view that the photograph has in 1920 x 1440.

    Args:
        camera: the colour camera.
        shape: height and width of the depth image.
        depth: name of the depth image, for the error.
        color: name of the colour image.
        remedy: what to try if the depth image shows another view.

    Raises:
        InputError: the sides of the two images are not in proportion.
    """
    height_px, width_px = shape[:2]
    if (height_px, width_px) == (camera.height_px, camera.width_px):
        return None
    smaller = scaled_to(camera, width_px, height_px)
    if smaller is None:
        raise InputError(
            f"The depth image {depth} has {width_px} x {height_px} pixels but the colour image {color} "
            f"has {camera.width_px} x {camera.height_px}, whose sides are not in that proportion; {remedy}"
        )
    return smaller


def same_view_note(camera: CameraIntrinsics, depth_camera: CameraIntrinsics) -> str:
    """Return a sentence on depth that was taken for the same view."""
    return (
        f"Depth has {depth_camera.width_px} x {depth_camera.height_px} pixels and colour "
        f"{camera.width_px} x {camera.height_px}: taken as the same view, so that depth has the colour "
        "camera, resized"
    )


def alike(one: CameraIntrinsics, other: CameraIntrinsics, within_px: float = 0.01) -> bool:
    """Return whether two cameras have the same size and distortion, and matrices within ``within_px``."""
    sizes = (one.width_px, one.height_px) == (other.width_px, other.height_px)
    same_lens = (
        one.fisheye == other.fisheye
        and one.distortion.shape == other.distortion.shape
        and np.allclose(one.distortion, other.distortion, atol=1e-4)
    )
    return sizes and same_lens and np.allclose(one.matrix, other.matrix, rtol=0.0, atol=within_px)
