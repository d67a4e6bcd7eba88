"""Conversion of Foxglove's messages to those of ROS: images, cameras and transforms.

Protocol buffers and JSON have the same fields (https://docs.foxglove.dev/docs/sdk/schemas).
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from pipeline.types import FloatArray

_TF = "tf2_msgs/msg/TFMessage"


def image(message: Any) -> SimpleNamespace:
    """Convert a RawImage to an Image of ROS."""
    data = _bytes(message.data)
    step = message.step or len(data) // max(1, message.height)
    size = {"height": message.height, "width": message.width}
    return SimpleNamespace(
        header=_header(message), **size, encoding=message.encoding, is_bigendian=0, step=step, data=data
    )


def compressed(message: Any) -> SimpleNamespace:
    """Convert a CompressedImage to one of ROS."""
    return SimpleNamespace(header=_header(message), format=message.format, data=_bytes(message.data))


def camera_info(message: Any) -> SimpleNamespace:
    """Convert a CameraCalibration to a CameraInfo of ROS."""
    return SimpleNamespace(
        header=_header(message),
        height=message.height,
        width=message.width,
        distortion_model=message.distortion_model,
        d=np.array(message.D, float),
        k=_numbers(message.K, 9),
        r=_numbers(message.R, 9),
        p=_numbers(message.P, 12),
        binning_x=0,
        binning_y=0,
        roi=SimpleNamespace(x_offset=0, y_offset=0, height=0, width=0),
    )


def transform(message: Any) -> SimpleNamespace:
    """Convert a FrameTransform to a TFMessage of ROS."""
    return SimpleNamespace(transforms=[_link(message)])


def transforms(message: Any) -> SimpleNamespace:
    """Convert FrameTransforms to a TFMessage of ROS."""
    return SimpleNamespace(transforms=[_link(own) for own in message.transforms])


SCHEMAS: dict[str, tuple[str, Callable[[Any], SimpleNamespace]]] = {
    "foxglove.RawImage": ("sensor_msgs/msg/Image", image),
    "foxglove.CompressedImage": ("sensor_msgs/msg/CompressedImage", compressed),
    "foxglove.CameraCalibration": ("sensor_msgs/msg/CameraInfo", camera_info),
    "foxglove.FrameTransform": (_TF, transform),
    "foxglove.FrameTransforms": (_TF, transforms),
}
"""Type of the ROS message and the conversion to it, by the name of the schema."""


def from_json(data: bytes) -> Any:
    """Return a JSON message with its fields as attributes."""
    return json.loads(data, object_hook=_Fields)


class _Fields(dict[str, Any]):
    """A JSON object; a field that is missing is 0, as in protocol buffers."""

    def __getattr__(self, name: str) -> Any:
        return self.get(name, 0)


def _link(message: Any) -> SimpleNamespace:
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=message.parent_frame_id or "", stamp=_stamp(message.timestamp)),
        child_frame_id=message.child_frame_id or "",
        transform=SimpleNamespace(translation=message.translation, rotation=message.rotation),
    )


def _header(message: Any) -> SimpleNamespace:
    return SimpleNamespace(frame_id=message.frame_id or "", stamp=_stamp(message.timestamp))


def _stamp(time: Any) -> SimpleNamespace:
    """Return a time as ROS has it; protocol buffers and JSON name its two numbers differently."""
    if isinstance(time, _Fields):
        return SimpleNamespace(sec=time.sec, nanosec=time.nsec)
    if not time:
        return SimpleNamespace(sec=0, nanosec=0)
    return SimpleNamespace(sec=time.seconds, nanosec=time.nanos)


def _bytes(data: bytes | str) -> np.ndarray:
    """Return data as (N,) uint8; JSON holds it in base64."""
    return np.frombuffer(base64.b64decode(data) if isinstance(data, str) else data, np.uint8)


def _numbers(values: Any, count: int) -> FloatArray:
    """Return (count,) numbers; zeros if there are more or fewer."""
    array = np.array(values, float).reshape(-1)
    return array if len(array) == count else np.zeros(count)
