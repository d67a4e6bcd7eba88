"""MCAP files of Foxglove's schemas, written by the mcap package: protocol buffers, JSON; and of ROS 1."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.json_format import MessageToDict
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema
from scipy.spatial.transform import Rotation

from pipeline.io.lenses import ros_name
from pipeline.types import CameraIntrinsics, RgbdFrame, Rig


class FoxgloveWriter:
    """Messages of one file."""

    def __init__(self, path: Path, encoding: str = "protobuf", chunked: bool = True):
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("wb")
        self._writer = Writer(self._file, use_chunking=chunked, chunk_size=20_000)
        self._writer.start(profile="", library="")
        self._encoding = encoding
        self._channels: dict[str, int] = {}

    def write(self, topic: str, message: Any, time_s: float) -> None:
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(
                topic, self._encoding, self._schema(message)
            )
        at_ns = round(time_s * 1e9)
        if self._encoding == "json":
            data = json.dumps(plain(message)).encode()
        else:
            data = message.SerializeToString()
        self._writer.add_message(self._channels[topic], at_ns, data, at_ns)

    def close(self) -> None:
        self._writer.finish()
        self._file.close()

    def _schema(self, message: Any) -> int:
        if self._encoding == "json":
            name = message.DESCRIPTOR.full_name
            return self._writer.register_schema(name, "jsonschema", b'{"type": "object"}')
        return register_schema(self._writer, type(message))


def plain(message: Any) -> Any:
    """Return a message as Foxglove's JSON schemas have it: bytes in base64, times as sec and nsec."""
    values = MessageToDict(message, preserving_proto_field_name=True)

    def timed(own: Any, source: Any) -> None:
        if "timestamp" in own:
            own["timestamp"] = {"sec": source.timestamp.seconds, "nsec": source.timestamp.nanos}
        for part, source_part in zip(
            own.get("transforms", []), getattr(source, "transforms", []), strict=True
        ):
            timed(part, source_part)

    timed(values, message)
    return values


def stamp(time_s: float) -> Timestamp:
    nanoseconds = round(time_s * 1e9)
    return Timestamp(seconds=nanoseconds // 10**9, nanos=nanoseconds % 10**9)


def raw(values: np.ndarray, frame: str, time_s: float) -> RawImage:
    """An image of bytes, of millimetres or of metres."""
    encoding = {3: "rgb8", 2: "16UC1" if values.dtype == np.uint16 else "32FC1"}[values.ndim]
    height, width = values.shape[:2]
    data = np.ascontiguousarray(values).tobytes()
    named = {"frame_id": frame, "timestamp": stamp(time_s), "step": len(data) // height}
    return RawImage(width=width, height=height, encoding=encoding, data=data, **named)


def png(values: np.ndarray, frame: str, time_s: float) -> CompressedImage:
    """A colour image, or depth in millimetres."""
    data = cv2.imencode(".png", values[..., ::-1] if values.ndim == 3 else values)[1].tobytes()
    return CompressedImage(timestamp=stamp(time_s), frame_id=frame, data=data, format="png")


def calibration(camera: CameraIntrinsics, frame: str, time_s: float) -> CameraCalibration:
    P = np.hstack([camera.matrix, np.zeros((3, 1))])
    return CameraCalibration(
        timestamp=stamp(time_s),
        frame_id=frame,
        width=camera.width_px,
        height=camera.height_px,
        distortion_model=ros_name(camera),
        D=camera.distortion.tolist(),
        K=camera.matrix.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=P.ravel().tolist(),
    )


def transform(parent: str, child: str, T: np.ndarray, time_s: float) -> FrameTransform:
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
    return FrameTransform(
        timestamp=stamp(time_s),
        parent_frame_id=parent,
        child_frame_id=child,
        translation=Vector3(x=T[0, 3], y=T[1, 3], z=T[2, 3]),
        rotation=Quaternion(x=x, y=y, z=z, w=w),
    )


def millimetres(frame: RgbdFrame) -> np.ndarray:
    z_m = np.where(frame.depth.valid, frame.depth.z_m, 0.0).astype(np.float64)
    return np.rint(1000.0 * z_m).astype(np.uint16)


def write_foxglove(
    path: Path,
    rig: Rig,
    encoding: str = "protobuf",
    compressed: bool = False,
    moments: int = 2,
    chunked: bool = True,
    metres: bool = False,
) -> Path:
    """Write cameras that stand still, at each moment, with their transforms as one message."""
    writer = FoxgloveWriter(path, encoding, chunked)
    for moment in range(moments):
        for index, frame in enumerate(rig.frames):
            camera, time_s = f"cam{index}", 1400.0 + 0.1 * moment + 0.002 * index
            if not index:
                tree = [
                    transform("world", f"cam{k}", own.T_world_camera, time_s)
                    for k, own in enumerate(rig.frames)
                ]
                writer.write("/tf", FrameTransforms(transforms=tree), time_s)
            depth = frame.depth.z_m.astype(np.float32) if metres else millimetres(frame)
            made = png if compressed else raw
            writer.write(f"/{camera}/color/image", made(frame.rgb, camera, time_s), time_s)
            writer.write(
                f"/{camera}/color/calibration", calibration(frame.intrinsics, camera, time_s), time_s
            )
            writer.write(f"/{camera}/depth/image", made(depth, camera, time_s + 0.001), time_s + 0.001)
    writer.close()
    return path


def write_ros1_mcap(path: Path, bag: Path) -> Path:
    """Convert a bag of ROS 1, as `mcap convert` does: the same bytes in another file."""
    from rosbags.rosbag1 import Reader

    with path.open("wb") as file, Reader(bag) as reader:
        writer = Writer(file)
        writer.start(profile="ros1", library="")
        channels: dict[int, int] = {}
        for connection, at_ns, data in reader.messages():
            if connection.id not in channels:
                name = connection.msgtype.replace("/msg/", "/")
                schema = writer.register_schema(name, "ros1msg", connection.msgdef.data.encode())
                channels[connection.id] = writer.register_channel(connection.topic, "ros1", schema)
            writer.add_message(channels[connection.id], at_ns, data, at_ns)
        writer.finish()
    return path
