"""Bags with every part chosen by the test: names of topics, CameraInfo, times, sizes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tests.pipeline.importing.bags import BagWriter

K = np.array([[139.125, 0.0, 81.0], [0.0, 139.125, 58.5], [0.0, 0.0, 1.0]])
P = np.array([[131.25, 0.0, 79.5, 0.0], [0.0, 131.25, 59.5, 0.0], [0.0, 0.0, 1.0, 0.0]])
D = np.array([-0.28, 0.09, 0.001, -0.0005, 0.0])
RATIONAL = np.array([0.45, -2.6, 6e-4, -3e-4, 1.5, 0.33, -2.4, 1.43])


@dataclass(frozen=True)
class Info:
    """A CameraInfo."""

    k: np.ndarray = field(default_factory=lambda: K)
    d: np.ndarray = field(default_factory=lambda: np.zeros(5))
    p: np.ndarray = field(default_factory=lambda: P)
    size: tuple[int, int] = (160, 120)
    model: str = "plumb_bob"
    binning: tuple[int, int] = (0, 0)
    region: tuple[int, int, int, int] = (0, 0, 0, 0)
    """x_offset, y_offset, width, height."""
    frame: str = "optical"

    def message(self, bag: BagWriter, time_s: float) -> Any:
        x, y, width, height = self.region
        roi = bag.make("sensor_msgs/msg/RegionOfInterest", x, y, height, width, bool(width))
        arrays = self.d.astype(float), self.k.ravel(), np.eye(3).ravel(), self.p.ravel()
        header = bag.header(self.frame, time_s)
        return bag.make(
            "sensor_msgs/msg/CameraInfo", header, *self.size[::-1], self.model, *arrays, *self.binning, roi
        )


@dataclass(frozen=True)
class Images:
    """Images of a topic: (moments, H, W, 3) colour or (moments, H, W) depth."""

    values: np.ndarray
    frame: str = "optical"
    late_s: float = 0.0
    stamp_s: Callable[[float], float] = lambda time_s: time_s
    """Time in the header of a message that comes into the bag at a time."""

    def message(self, bag: BagWriter, time_s: float, moment: int) -> Any:
        values = self.values[moment]
        encoding = {3: "rgb8", 2: "16UC1" if values.dtype == np.uint16 else "32FC1"}[values.ndim]
        header, size = bag.header(self.frame, self.stamp_s(time_s)), values.shape[:2]
        data = np.ascontiguousarray(values).view(np.uint8).reshape(-1)
        return bag.make("sensor_msgs/msg/Image", header, *size, encoding, 0, data.size // size[0], data)


def write_parts(path: Path, images: dict[str, Images], infos: dict[str, Info], kind: str = "ros1") -> Path:
    """Write the images of each topic every half second from 100 s on, and each CameraInfo once.

    The writer is that of rosbags.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    bag = BagWriter(path, kind)
    with bag.writer:
        for topic, info in infos.items():
            bag.write(topic, info.message(bag, 100.0), 100.0)
        moments = max(len(own.values) for own in images.values())
        for moment in range(moments):
            for topic, own in images.items():
                if moment < len(own.values):
                    time_s = 100.0 + 0.5 * moment + own.late_s
                    bag.write(topic, own.message(bag, time_s, moment), time_s)
    return path


def colors(moments: int = 1, size: tuple[int, int] = (160, 120)) -> np.ndarray:
    """Noise, different in every moment."""
    return np.random.default_rng(5).integers(0, 256, (moments, *size[::-1], 3), dtype=np.uint8)


def wall(moments: int = 1, size: tuple[int, int] = (160, 120), z_mm: int = 2000) -> np.ndarray:
    """A wall ahead, a millimetre farther in every moment."""
    return np.stack([np.full(size[::-1], z_mm + moment, np.uint16) for moment in range(moments)])


def rectified(raw: np.ndarray, info: Info) -> np.ndarray:
    """An image as ROS's image_proc makes it of a raw one."""
    size = raw.shape[1::-1]
    maps = cv2.initUndistortRectifyMap(info.k, info.d, np.eye(3), info.p[:, :3], size, cv2.CV_32FC1)
    return cv2.remap(raw, *maps, cv2.INTER_LINEAR)
