"""The room as bags of ROS 1 and ROS 2, written by rosbags: three cameras that stand still."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.types import CameraIntrinsics, FloatArray, RgbdFrame, Rig
from tests.pipeline.importing.bag_parts import Info
from tests.pipeline.importing.bags import (
    BagWriter,
    color,
    depth_compressed,
    depth_metres,
    depth_metres_compressed,
    depth_millimetres,
    depth_rvl,
)
from tests.pipeline.strangers.images import photograph

Encode = Callable[[BagWriter, RgbdFrame, Any], Any]
"""Makes the message of one of a frame's images, with a header."""
START_S, MOMENTS = 1400.0, 2
LENS, ENLARGED = np.array([-0.28, 0.09, 0.001, -0.0005, 0.0]), 1.06
"""Distortion of raw images, and their matrix K in terms of the rectified images' P."""


@dataclass(frozen=True)
class Topics:
    """Storage and topics of a bag, by the names below each camera's namespace."""

    storage: str
    """ros1, ros2 (sqlite) or mcap."""
    color: str
    depth: str
    encode_color: Encode
    encode_depth: Encode
    times: int = 1
    """Colour images have so many times the columns and rows of the depth images."""
    rectified: bool = False
    """Whether camera_info also has the lens that the images had before they were rectified."""

    def __call__(self, folder: Path, rig: Rig) -> Path:
        """Write the bag; returns its path."""
        path = folder / ("room.bag" if self.storage == "ros1" else "room")
        folder.mkdir()
        bag = BagWriter(path, self.storage)
        with bag.writer:
            bag.write("/tf_static", _transforms(bag, rig), START_S)
            for moment in range(MOMENTS):
                for index, frame in enumerate(rig.frames):
                    self._write_moment(bag, frame, f"cam{index}", START_S + moment + 0.003 * index)
        return path

    def _write_moment(self, bag: BagWriter, frame: RgbdFrame, camera: str, time_s: float) -> None:
        optical, (rgb, large) = f"{camera}_optical_frame", photograph(frame, self.times)
        colored = replace(frame, rgb=rgb, intrinsics=large)
        for topic, encode, own in (
            (self.color, self.encode_color, colored),
            (self.depth, self.encode_depth, frame),
        ):
            bag.write(f"/{camera}/{topic}", encode(bag, own, bag.header(optical, time_s)), time_s)
            info = _info(own.intrinsics, optical, self.rectified).message(bag, time_s)
            bag.write(f"/{camera}/{topic.split('/')[0]}/camera_info", info, time_s)


def color_compressed(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    """JPEG of quality 95, as image_transport writes it."""
    data = cv2.imencode(".jpg", frame.rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])[1].reshape(-1)
    return bag.make("sensor_msgs/msg/CompressedImage", header, "bgr8; jpeg compressed bgr8", data)


def color_rgba(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    """Four bytes a pixel."""
    rgba = np.dstack([frame.rgb, np.full(frame.rgb.shape[:2], 255, np.uint8)])
    height_px, width_px = rgba.shape[:2]
    return bag.make(
        "sensor_msgs/msg/Image", header, height_px, width_px, "rgba8", 0, 4 * width_px, rgba.reshape(-1)
    )


def _info(camera: CameraIntrinsics, frame: str, rectified: bool) -> Info:
    """Return the CameraInfo: P is the camera; K and D are the raw images', if they are others."""
    raw = camera.matrix.copy()
    raw[:2] *= ENLARGED if rectified else 1.0
    P = np.hstack([camera.matrix, np.zeros((3, 1))])
    size = camera.width_px, camera.height_px
    return Info(raw, LENS if rectified else np.zeros(5), P, size, frame=frame)


def _transforms(bag: BagWriter, rig: Rig) -> Any:
    """Return the tree map, camera's body, camera's optical frame."""
    T_body_optical = np.eye(4)
    T_body_optical[:3, :3] = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
    links = []
    for index, frame in enumerate(rig.frames):
        T_map_body = frame.T_world_camera @ np.linalg.inv(T_body_optical)
        links.append(_link(bag, "map", f"cam{index}_link", T_map_body))
        links.append(_link(bag, f"cam{index}_link", f"cam{index}_optical_frame", T_body_optical))
    return bag.make("tf2_msgs/msg/TFMessage", links)


def _link(bag: BagWriter, parent: str, child: str, T_parent_child: FloatArray) -> Any:
    place = bag.make("geometry_msgs/msg/Vector3", *T_parent_child[:3, 3].tolist())
    turn = Rotation.from_matrix(T_parent_child[:3, :3]).as_quat().tolist()
    transform = bag.make(
        "geometry_msgs/msg/Transform", place, bag.make("geometry_msgs/msg/Quaternion", *turn)
    )
    return bag.make("geometry_msgs/msg/TransformStamped", bag.header(parent, START_S), child, transform)


_RAW, _JPEG = "rgb/image_raw", "rgb/image_raw/compressed"
_DEPTH, _PACKED = "depth/image_raw", "depth/image_raw/compressedDepth"
write_ros1 = Topics("ros1", _RAW, _DEPTH, color, depth_millimetres)
write_ros1_metres = Topics("ros1", _JPEG, _PACKED, color_compressed, depth_metres_compressed)
write_db3 = Topics("ros2", _RAW, _DEPTH, color_rgba, depth_metres)
write_db3_rvl = Topics("ros2", _RAW, _PACKED, color, depth_rvl)
write_mcap = Topics("mcap", _JPEG, _PACKED, color_compressed, depth_compressed)
write_mcap_large = Topics("mcap", _RAW, _DEPTH, color, depth_millimetres, times=2)
write_image_rect = Topics(
    "mcap", "rgb/image_rect_color", "depth/image_rect", color, depth_millimetres, rectified=True
)
