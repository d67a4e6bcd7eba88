"""Conversion of ROS messages to images and transforms."""

from __future__ import annotations

import re
import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from pipeline.importing.rvl import decode_rvl
from pipeline.kernels.geometry import rigid
from pipeline.types import ByteArray, FloatArray

_COLORS = {"rgb8": (3, [0, 1, 2]), "bgr8": (3, [2, 1, 0]), "rgba8": (4, [0, 1, 2]), "bgra8": (4, [2, 1, 0])}
_COLORS |= {"mono8": (1, [0, 0, 0]), "8UC1": (1, [0, 0, 0]), "8UC3": (3, [2, 1, 0])}
_DEPTHS: dict[str, np.dtype[Any]] = {
    "16UC1": np.dtype(np.uint16),
    "mono16": np.dtype(np.uint16),
    "32FC1": np.dtype(np.float32),
    "64FC1": np.dtype(np.float64),
}
_COMPRESSED_DEPTH = "compressedDepth"
_BRIGHTNESS = re.compile(
    r"(?:^|[_/])(?:ir|infra\d?|infrared|confidence|amplitude|intensity|gr[ae]y|mono)(?:[_/]|$)"
)
"""Part of the names of topics with brightness: /ir/image_raw, /kinect2/sd/image_ir, /tof/confidence_image."""
_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_HEADER_BYTES, _GREY_16 = 26, b"\x10\x00"
"""Size of a PNG up to its bit depth and colour type, and these two for one channel of 16 bits."""
_CONFIG_BYTES = 12
"""Size of the header of compressed depth: format and two parameters that quantise 32FC1, then PNG or RVL."""


def is_depth(message: Any, topic: str) -> bool:
    """Return whether an Image or CompressedImage contains depth, by its encoding and topic."""
    return _may_be_depth(message) and not is_brightness(message, topic)


def is_brightness(message: Any, topic: str) -> bool:
    """Return whether an Image has 16 bits of brightness, by its encoding and topic."""
    if not _may_be_depth(message) or "depth" in topic.lower():
        return False
    return getattr(message, "encoding", "") == "mono16" or _BRIGHTNESS.search(topic) is not None


def _may_be_depth(message: Any) -> bool:
    if hasattr(message, "format"):
        return _COMPRESSED_DEPTH in message.format or _is_png_of_16_bits(message)
    return message.encoding in _DEPTHS


def _is_png_of_16_bits(message: Any) -> bool:
    """Return whether the data are a PNG of one 16-bit channel, as which image_transport compresses depth."""
    data = np.asarray(message.data)[:_PNG_HEADER_BYTES].tobytes()
    return data.startswith(_PNG) and data[_PNG_HEADER_BYTES - 2 :] == _GREY_16


def stamp_s(raw: bytes, is_ros2: bool) -> float:
    """Read the time in seconds from a message's header without deserialising the message.

    It follows the sequence number in ROS 1, or four bytes that describe the encoding in ROS 2.
    """
    order = ">" if is_ros2 and raw[1] == 0 else "<"
    seconds, nanoseconds = struct.unpack_from(f"{order}II", raw, 4)
    return seconds + 1e-9 * nanoseconds


def size_of(message: Any, topic: str) -> tuple[int, int]:
    """Return width and height of an Image or CompressedImage; 0 and 0 if its data are damaged."""
    if not hasattr(message, "format"):
        return message.width, message.height
    try:
        image = depth_values_of(message, topic) if is_depth(message, topic) else color_of(message, topic)
    except InputError:
        return 0, 0
    return image.shape[1], image.shape[0]


def color_of(message: Any, topic: str) -> ByteArray:
    """Return an Image or CompressedImage as (H, W, 3) RGB.

    Raises:
        InputError: the encoding is unknown, or the image is damaged.
    """
    if hasattr(message, "format"):
        bgr = cv2.imdecode(np.asarray(message.data), cv2.IMREAD_COLOR)
        if bgr is None:
            raise InputError(f"An image of {topic} is damaged; try to record again")
        return np.ascontiguousarray(bgr[..., ::-1])
    if message.encoding not in _COLORS:
        raise InputError(
            f"{topic} has images of the encoding {message.encoding}; try to record it in one of "
            f"{', '.join(_COLORS)}"
        )
    channels, order = _COLORS[message.encoding]
    values = _rows(message, np.dtype(np.uint8), channels, topic)
    return np.ascontiguousarray(values.reshape(message.height, message.width, channels)[..., order])


def depth_values_of(message: Any, topic: str) -> NDArray[Any]:
    """Return (H, W) values: integer millimetres of 16UC1, or floating-point metres of 32FC1 (REP 118).

    The message must be one of depth (``is_depth``).

    Raises:
        InputError: the image is damaged.
    """
    if hasattr(message, "format"):
        return _compressed_depth(message, topic)
    type_ = _DEPTHS[message.encoding].newbyteorder(">" if message.is_bigendian else "<")
    return _rows(message, type_, 1, topic)


def transform_in(message: Any) -> FloatArray:
    """Return the (4, 4) matrix of a geometry_msgs Transform, metres."""
    q, t = message.rotation, message.translation
    rotation = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    return rigid(rotation, np.array([t.x, t.y, t.z]))


def _compressed_depth(message: Any, topic: str) -> NDArray[Any]:
    data = np.asarray(message.data)
    if _COMPRESSED_DEPTH not in message.format:
        data = np.concatenate([np.zeros(_CONFIG_BYTES, np.uint8), data])
    rvl = "rvl" in message.format.lower()
    values = _rvl(data.tobytes()) if rvl else cv2.imdecode(data[_CONFIG_BYTES:], cv2.IMREAD_UNCHANGED)
    if values is None or values.ndim != 2:
        raise InputError(
            f"A depth image of {topic} is damaged, or of another format than its '{message.format}'; try to "
            "record the topic without compression"
        )
    if not message.format.startswith("32FC1"):
        return values
    _, a, b = struct.unpack_from("<iff", data.tobytes())
    known = values > 0
    return np.where(known, a / np.where(known, values - b, 1.0), 0.0)


def _rvl(data: bytes) -> np.ndarray | None:
    """Decode RVL depth after the configuration, width and height; None if it is damaged."""
    try:
        width_px, height_px = struct.unpack_from("<II", data, _CONFIG_BYTES)
        return decode_rvl(data[_CONFIG_BYTES + 8 :], width_px, height_px)
    except (struct.error, ValueError):
        return None


def _rows(message: Any, type_: np.dtype, channels: int, topic: str) -> np.ndarray:
    """Return the (H, W * channels) values without the padding of the rows."""
    needed = message.width * channels * type_.itemsize
    if message.step < needed or len(message.data) < message.step * message.height:
        raise InputError(f"An image of {topic} is shorter than its size says; try to record again")
    rows = np.asarray(message.data)[: message.step * message.height].reshape(message.height, message.step)
    return np.ascontiguousarray(rows[:, :needed]).view(type_)
