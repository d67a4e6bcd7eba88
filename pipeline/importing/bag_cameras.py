"""Cameras of the image topics of a bag, from its CameraInfo messages."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.intrinsics import check_camera
from pipeline.io.lenses import KNOWN, is_fisheye_name, lens_of
from pipeline.kernels.geometry import scaled_to
from pipeline.types import CameraIntrinsics, FloatArray

TRANSPORTS = ("compressed", "compressedDepth")
"""Last parts of the names of topics with compressed images."""
_RECTIFIED = re.compile(r"(?:^|[_/])rect(?:ified)?(?:[_/]|$)")
"""Part of the names of topics with rectified images, as of ``image_rect_color``."""
_SDK = re.compile(r"^(/device_\d+/sensor_\d+/[^/]+)/image/data$")
"""Image topics as the RealSense SDK names them."""


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """The camera of an image topic, or the reason why there is none."""

    camera: CameraIntrinsics | None
    why_not: str
    """A sentence with a remedy; empty if there is a camera."""
    notes: tuple[str, ...] = ()
    by_name: bool = True
    """Whether the camera_info was found by its name, not only by the frame of the images."""


def sdk_stream(topic: str) -> str | None:
    """Return the RealSense SDK's stream of an image topic, such as /device_0/sensor_1/Color_0; else None."""
    found = _SDK.match(topic)
    return found[1] if found else None


def camera_of_topic(reader: Any, topic: str, frame: str, size_px: tuple[int, int]) -> FoundCamera:
    """Find the CameraInfo of an image topic: by its name, or else by its frame and image size.

    Args:
        reader: the open bag.
        topic: name of the image topic.
        frame: frame of its images.
        size_px: width and height of its images.
    """
    infos = {own.topic: own for own in reader.connections if own.msgtype == "sensor_msgs/msg/CameraInfo"}
    expected = _names(topic)
    for name in expected:
        if name in infos and (message := _first(reader, infos[name])) is not None:
            return _found(message, name, size_px, _is_rectified(topic))
    alike = []
    for name, connection in sorted(infos.items()):
        message = _first(reader, connection)
        if message is not None and message.header.frame_id.lstrip("/") == frame:
            found = _found(message, name, size_px, _is_rectified(topic))
            if found.camera is not None:
                note = f"{name} is taken as the camera of {topic}: it has the same frame, {frame}"
                alike.append(
                    (common_parts(name, topic), replace(found, notes=(*found.notes, note), by_name=False))
                )
    best = max((score for score, _ in alike), default=0)
    nearest = [found for score, found in alike if score == best]
    if len(nearest) == 1:
        return nearest[0]
    known = f", which has only {', '.join(sorted(infos))}" if infos else ""
    return FoundCamera(
        None, f"no camera_info of {topic} is in the bag{known}; try to record {expected[0]}, too"
    )


def common_parts(first: str, second: str) -> int:
    """Return the number of equal leading parts of two topics' names."""
    same = [a == b for a, b in zip(first.split("/"), second.split("/"), strict=False)]
    return same.index(False) if False in same else len(same)


def camera_in(
    message: Any, topic: str, size_px: tuple[int, int], rectified: bool
) -> tuple[CameraIntrinsics, tuple[str, ...]]:
    """Return the camera of images from a CameraInfo of ROS 1 (fields D, K, P) or ROS 2 (d, k, p), and notes.

    Rectified images have the camera P and no distortion, others K and D. The camera is fitted to the images'
    size: by its binning, by its region of interest, or, with a note, in proportion.

    Args:
        message: the CameraInfo.
        topic: name of its topic.
        size_px: width and height of the images.
        rectified: whether the images are rectified.

    Raises:
        InputError: the lens is not supported, the camera is not calibrated, or it is for images of another
            size.
    """
    d, K, P = (_field(message, name) for name in "dkp")
    matrix, rectified_matrix = K.reshape(3, 3), P.reshape(3, 4)[:, :3]
    model = message.distortion_model
    if rectified and rectified_matrix[0, 0] > 0:
        matrix, d, model = rectified_matrix, np.zeros(5), ""
    elif rectified and np.any(d):
        raise InputError(
            f"The camera of {topic} has no projection matrix P, which the rectified images need; try to "
            "record the images before rectification"
        )
    if not (np.any(d) or is_fisheye_name(model)):
        model = ""
    lens = lens_of(model, d)
    if lens is None:
        raise InputError(
            f"The camera of {topic} has the lens {model} with {len(d)} coefficients; try a recording of "
            f"rectified images (image_rect), or {KNOWN}"
        )
    if not (matrix[0, 0] > 0 and matrix[1, 1] > 0):
        raise InputError(f"The camera of {topic} is not calibrated; try to record its real camera_info")
    size = message.width or size_px[0], message.height or size_px[1]
    whole = CameraIntrinsics(matrix.copy(), lens, *size, fisheye=is_fisheye_name(model))
    camera, notes = _of_images(whole, message, topic, size_px)
    check_camera(f"The camera of {topic}", camera)
    return camera, notes


def _found(message: Any, name: str, size_px: tuple[int, int], rectified: bool) -> FoundCamera:
    try:
        camera, notes = camera_in(message, name, size_px, rectified)
    except InputError as error:
        return FoundCamera(None, str(error))
    return FoundCamera(camera, "", notes)


def _field(message: Any, name: str) -> FloatArray:
    return np.asarray(getattr(message, name if hasattr(message, name) else name.upper()), float)


def _first(reader: Any, connection: Any) -> Any:
    for own, _, raw in reader.messages([connection]):
        return reader.deserialize(raw, own.msgtype)
    return None


def _is_rectified(topic: str) -> bool:
    return _RECTIFIED.search(topic) is not None


def _names(topic: str) -> list[str]:
    """Return the names of the CameraInfo of an image topic, the usual one first."""
    stream = sdk_stream(topic)
    if stream is not None:
        return [f"{stream}/info/camera_info", f"{stream}/camera_info"]
    parts = [part for part in topic.split("/") if part not in TRANSPORTS]
    return ["/".join([*parts[:-1], name]) for name in ("camera_info", "calibration")]


def _of_images(
    whole: CameraIntrinsics, message: Any, topic: str, size_px: tuple[int, int]
) -> tuple[CameraIntrinsics, tuple[str, ...]]:
    """Return the camera of images of ``size_px``, from the camera of the whole sensor, and notes.

    Raises:
        InputError: neither binning, nor the region of interest, nor resizing in proportion gives this size.
    """
    if size_px == (whole.width_px, whole.height_px):
        return whole, ()
    roi, bins = message.roi, (max(1, message.binning_x), max(1, message.binning_y))
    cropped = whole
    if roi.width and roi.height:
        matrix = whole.matrix.copy()
        matrix[:2, 2] -= (roi.x_offset, roi.y_offset)
        cropped = replace(whole, matrix=matrix, width_px=roi.width, height_px=roi.height)
    for camera in (_binned(cropped, bins), cropped, _binned(whole, bins)):
        if (camera.width_px, camera.height_px) == size_px:
            return camera, ()
    resized = None if roi.width and roi.height else scaled_to(whole, *size_px)
    if resized is None:
        raise InputError(
            f"The camera of {topic} is for {whole.width_px} x {whole.height_px} pixels, with "
            f"binning {bins[0]} x {bins[1]} and a region of {cropped.width_px} x {cropped.height_px}, but "
            f"the images have {size_px[0]} x {size_px[1]}; try to record the images that belong to it"
        )
    note = (
        f"{topic} is for {whole.width_px} x {whole.height_px} pixels and its images have {size_px[0]} x "
        f"{size_px[1]}: taken as the whole view, resized"
    )
    return resized, (note,)


def _binned(camera: CameraIntrinsics, bins: tuple[int, int]) -> CameraIntrinsics:
    """Return the camera after binning of ``bins`` columns and rows; pixel centres are integers (SPEC 1.1)."""
    matrix = camera.matrix.copy()
    matrix[[0, 1], [0, 1]] /= bins
    matrix[:2, 2] = (matrix[:2, 2] + 0.5) / bins - 0.5
    size_px = camera.width_px // bins[0], camera.height_px // bins[1]
    return replace(camera, matrix=matrix, width_px=size_px[0], height_px=size_px[1])
