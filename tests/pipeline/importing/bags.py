"""A rig recorded as a bag of ROS 1 or ROS 2."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.spatial.transform import Rotation

from pipeline.io.lenses import ros_name
from pipeline.types import RgbdFrame, Rig


class BagWriter:
    """Messages of one bag."""

    def __init__(self, path: Path, kind: str):
        self.is2 = kind != "ros1"
        self.store = get_typestore(Stores.ROS2_HUMBLE if self.is2 else Stores.ROS1_NOETIC)
        if not self.is2:
            transforms = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(transforms, "tf2_msgs/msg/TFMessage"))
        if self.is2:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self.writer: Any = Writer2(path, version=9, storage_plugin=plugin)
        else:
            self.writer = Writer1(path)
        self.connections: dict[str, Any] = {}

    def make(self, name: str, *values: Any, **named: Any) -> Any:
        return self.store.types[name](*values, **named)

    def header(self, frame: str, time_s: float) -> Any:
        seconds = int(time_s)
        stamp = self.make("builtin_interfaces/msg/Time", seconds, round((time_s - seconds) * 1e9))
        return self.make("std_msgs/msg/Header", *(() if self.is2 else (0,)), stamp, frame)

    def write(self, topic: str, message: Any, time_s: float) -> None:
        name = message.__msgtype__
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, name, typestore=self.store)
        serialise = self.store.serialize_cdr if self.is2 else self.store.serialize_ros1
        self.writer.write(self.connections[topic], round(time_s * 1e9), serialise(message, name))


def color(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    height, width = frame.rgb.shape[:2]
    data = np.ascontiguousarray(frame.rgb[..., ::-1]).reshape(-1)
    return bag.make("sensor_msgs/msg/Image", header, height, width, "bgr8", 0, 3 * width, data)


def depth_millimetres(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    """Rows padded by four bytes."""
    height, width = frame.depth.z_m.shape
    rows = np.zeros((height, width + 2), np.uint16)
    rows[:, :width] = _millimetres(frame)
    data = rows.view(np.uint8).reshape(-1)
    return bag.make("sensor_msgs/msg/Image", header, height, width, "16UC1", 0, 2 * width + 4, data)


def depth_metres(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    """NaN where unknown."""
    height, width = frame.depth.z_m.shape
    data = frame.depth.z_m.astype(np.float32).reshape(-1).view(np.uint8)
    return bag.make("sensor_msgs/msg/Image", header, height, width, "32FC1", 0, 4 * width, data)


def depth_compressed(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    """A PNG after twelve bytes."""
    png = cv2.imencode(".png", _millimetres(frame))[1].reshape(-1)
    data = np.concatenate([np.zeros(12, np.uint8), png])
    return bag.make("sensor_msgs/msg/CompressedImage", header, "16UC1; compressedDepth png", data)


def depth_rvl(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    """RVL after twelve bytes and the size."""
    height, width = frame.depth.z_m.shape
    data = bytes(12) + struct.pack("<II", width, height) + encode_rvl(_millimetres(frame).ravel())
    return bag.make(
        "sensor_msgs/msg/CompressedImage",
        header,
        "16UC1; compressedDepth rvl",
        np.frombuffer(data, np.uint8),
    )


def depth_metres_compressed(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    """Metres as a PNG of a / depth + b, as the transport quantises them."""
    a, b = 100.0 * 101.0, 1.0 - 100.0
    z_m = frame.depth.z_m
    inverse = np.where(frame.depth.valid, np.rint(a / np.where(frame.depth.valid, z_m, 1.0) + b), 0.0)
    png = cv2.imencode(".png", inverse.astype(np.uint16))[1].reshape(-1)
    data = np.concatenate([np.frombuffer(struct.pack("<iff", 0, a, b), np.uint8), png])
    return bag.make("sensor_msgs/msg/CompressedImage", header, "32FC1; compressedDepth png", data)


def encode_rvl(pixels: np.ndarray) -> bytes:
    """As the paper prints it: runs of zeros and of folded differences, three bits and a flag a nibble."""
    nibbles: list[int] = []

    def put(value: int) -> None:
        while True:
            nibble, value = value & 7, value >> 3
            nibbles.append(nibble | (8 if value else 0))
            if not value:
                return

    at, previous = 0, 0
    while at < len(pixels):
        start = at
        while at < len(pixels) and pixels[at] == 0:
            at += 1
        put(at - start)
        start = at
        while at < len(pixels) and pixels[at] != 0:
            at += 1
        put(at - start)
        for value in pixels[start:at].astype(int):
            difference = int(value) - previous
            put((difference << 1) ^ (difference >> 31))
            previous = int(value)
    nibbles += [0] * (-len(nibbles) % 8)
    words = [
        sum(n << (28 - 4 * k) for k, n in enumerate(nibbles[i : i + 8])) for i in range(0, len(nibbles), 8)
    ]
    return np.array(words, "<u4").tobytes()


DEPTHS: dict[str, Callable[[BagWriter, RgbdFrame, Any], Any]] = {
    "image": depth_millimetres,
    "image/metres": depth_metres,
    "image/compressedDepth": depth_compressed,
    "image/rvl": depth_rvl,
    "image/metresCompressed": depth_metres_compressed,
}


def write_bag(
    path: Path,
    rig: Rig,
    kind: str = "ros2",
    depth: str = "image",
    late_s: float = 0.01,
    leave_out: str = "nothing",
    moments: int = 3,
    T_color_depth: np.ndarray | None = None,
) -> None:
    """Cameras whose depth is ``late_s`` after their colour; topics with ``leave_out`` are not recorded.

    With ``T_color_depth``, depth has a frame of its own there, and the same lens.
    """
    bag = BagWriter(path, kind)
    depth_frame = "optical" if T_color_depth is None else "depth"
    with bag.writer:

        def write(topic: str, message: Any, time_s: float) -> None:
            if leave_out not in topic:
                bag.write(topic, message, time_s)

        write("/tf_static", _tree(bag, rig, T_color_depth), 100.0)
        for moment in range(moments):
            for index, frame in enumerate(rig.frames):
                name, time_s = f"/cam{index}", 100.0 + 0.5 * moment + 0.002 * index
                header = bag.header(f"cam{index}_optical", time_s)
                late = bag.header(f"cam{index}_{depth_frame}", time_s + late_s)
                write(f"{name}/color/image", color(bag, frame, header), time_s)
                write(f"{name}/color/camera_info", _camera_info(bag, frame, header), time_s)
                if T_color_depth is not None:
                    write(f"{name}/depth/camera_info", _camera_info(bag, frame, late), time_s)
                write(f"{name}/depth/{depth}", DEPTHS[depth](bag, frame, late), time_s)


def _tree(bag: BagWriter, rig: Rig, T_color_depth: np.ndarray | None) -> Any:
    links: list[Any] = []
    for index, frame in enumerate(rig.frames):
        links.append(link(bag, "map", f"cam{index}_optical", frame.T_world_camera))
        if T_color_depth is not None:
            links.append(link(bag, f"cam{index}_optical", f"cam{index}_depth", T_color_depth))
    return bag.make("tf2_msgs/msg/TFMessage", links)


def link(bag: BagWriter, parent: str, child: str, T: np.ndarray) -> Any:
    place = bag.make("geometry_msgs/msg/Vector3", *T[:3, 3].tolist())
    quaternion = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
    turn = bag.make("geometry_msgs/msg/Quaternion", *quaternion)
    transform = bag.make("geometry_msgs/msg/Transform", place, turn)
    return bag.make("geometry_msgs/msg/TransformStamped", bag.header(parent, 100.0), child, transform)


def _camera_info(bag: BagWriter, frame: RgbdFrame, header: Any) -> Any:
    K = frame.intrinsics
    region = bag.make("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False)
    P = np.hstack([K.matrix, np.zeros((3, 1))]).reshape(-1)
    values = K.distortion, K.matrix.reshape(-1), np.eye(3).reshape(-1), P
    size = K.height_px, K.width_px
    return bag.make("sensor_msgs/msg/CameraInfo", header, *size, ros_name(K), *values, 0, 0, region)


def _millimetres(frame: RgbdFrame) -> np.ndarray:
    known = frame.depth.valid
    return np.rint(np.where(known, frame.depth.z_m, 0.0).astype(np.float64) * 1000.0).astype(np.uint16)
