"""The room in files of many images: .r3d, .sens and .mkv, and with a video in place of photographs."""

from __future__ import annotations

import json
import struct
import zipfile
import zlib
from fractions import Fraction
from io import BytesIO
from pathlib import Path

import av
import cv2
import lzfse
import numpy as np
from PIL import Image

from pipeline.types import CameraIntrinsics, FloatArray, RgbdFrame, Rig
from tests.pipeline.strangers.images import ARKIT, depth_units, photograph, quaternion
from tests.pipeline.strangers.phones import write_stray

DEPTH_SIZE = 320, 288
"""Pixels of the depth mode NFOV_2X2BINNED; its sensor has 96 columns and 90 rows before the first ones."""
SENSOR_PX, CUT_PX = 512, (96, 90)


def jpeg(rgb: np.ndarray) -> bytes:
    file = BytesIO()
    Image.fromarray(rgb).save(file, "JPEG", quality=95)
    return file.getvalue()


def write_r3d(folder: Path, rig: Rig, times: int = 3, confidence: np.ndarray | None = None, **more) -> Path:
    """Record3D's file as viser's Record3dLoader reads it: lzfse, float32 metres, the matrix by columns."""
    folder.mkdir(parents=True)
    poses = []
    with zipfile.ZipFile(folder / "room.r3d", "w") as archive:
        for k, frame in enumerate(rig.frames):
            rgb, camera = photograph(frame, times)
            archive.writestr(f"rgbd/{k}.jpg", jpeg(rgb))
            z_m = frame.depth.z_m.astype("<f4")
            archive.writestr(f"rgbd/{k}.depth", lzfse.compress(z_m.tobytes()))
            levels = np.full(z_m.shape, 2, np.uint8) if confidence is None else confidence
            archive.writestr(f"rgbd/{k}.conf", lzfse.compress(levels.tobytes()))
            T = frame.T_world_camera @ ARKIT
            poses.append([*quaternion(T), *T[:3, 3]])
        height, width = rig.frames[0].depth.z_m.shape
        values = {"w": camera.width_px, "h": camera.height_px, "dw": width, "dh": height, "fps": 60}
        values |= {"K": camera.matrix.T.ravel().tolist(), "poses": poses, "initPose": poses[0]} | more
        archive.writestr("metadata", json.dumps({k: v for k, v in values.items() if v is not None}))
    return folder / "room.r3d"


def write_sens(
    folder: Path,
    rig: Rig,
    compressions: tuple[int, int] = (2, 1),
    T_color_depth: FloatArray | None = None,
    lost: tuple[int, ...] = (),
) -> Path:
    """ScanNet's SensorData, version 4: photographs of twice as many pixels; lost poses are -inf."""
    folder.mkdir(parents=True)
    big = photograph(rig.frames[0], 2)[1]
    small = rig.frames[0].intrinsics
    name = b"StructureSensor"
    out = [struct.pack("<IQ", 4, len(name)), name]
    for camera, T in ((big, np.eye(4)), (small, np.eye(4) if T_color_depth is None else T_color_depth)):
        matrix = np.eye(4)
        matrix[:3, :3] = camera.matrix
        out += [matrix.astype("<f4").tobytes(), np.asarray(T, "<f4").tobytes()]
    sizes = big.width_px, big.height_px, small.width_px, small.height_px
    out.append(struct.pack("<2i4IfQ", *compressions, *sizes, 1000.0, len(rig.frames)))
    for k, frame in enumerate(rig.frames):
        rgb = photograph(frame, 2)[0]
        color = {0: rgb.tobytes(), 1: cv2.imencode(".png", rgb[..., ::-1])[1].tobytes(), 2: jpeg(rgb)}
        units = depth_units(frame).astype("<u2").tobytes()
        depth = {0: units, 1: zlib.compress(units), 2: units}
        pose = np.full((4, 4), -np.inf) if k in lost else frame.T_world_camera
        images = color[compressions[0]], depth[compressions[1]]
        times = 1_000_000 + 33_333 * k, 1_000_500 + 33_333 * k
        out.append(struct.pack("<16f4Q", *pose.ravel(), *times, *map(len, images)))
        out += images
    out.append(struct.pack("<Q", 0))  # measurements of acceleration
    (folder / "scene0000_00.sens").write_bytes(b"".join(out))
    return folder / "scene0000_00.sens"


def kinect_calibration(
    color: CameraIntrinsics, depth: CameraIntrinsics, T_color_depth: FloatArray
) -> dict[str, object]:
    """The attachment of a recording: cameras in units of their sensors, whose corner is 0."""
    rows = 0.75 * color.width_px
    top = (rows - color.height_px) / 2
    units = [
        (
            "D0",
            "Depth",
            [(depth.cx_px + 0.5 + CUT_PX[0]) / SENSOR_PX, (depth.cy_px + 0.5 + CUT_PX[1]) / SENSOR_PX],
            [depth.fx_px / SENSOR_PX, depth.fy_px / SENSOR_PX],
            depth,
            np.eye(4),
            (1024, 1024),
        ),
        (
            "PV0",
            "PhotoVideo",
            [(color.cx_px + 0.5) / color.width_px, (color.cy_px + 0.5 + top) / rows],
            [color.fx_px / color.width_px, color.fy_px / rows],
            color,
            T_color_depth,
            (4096, 3072),
        ),
    ]
    cameras = []
    for location, purpose, centre, focal, camera, T, sensor in units:
        k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(camera.distortion, (0, 8 - len(camera.distortion)))
        numbers = [*centre, *focal, k1, k2, k3, k4, k5, k6, 0.0, 0.0, p2, p1]
        cameras.append(
            {
                "Intrinsics": {
                    "ModelParameterCount": 14,
                    "ModelParameters": [float(number) for number in numbers],
                    "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
                },
                "Location": f"CALIBRATION_CameraLocation{location}",
                "Purpose": f"CALIBRATION_CameraPurpose{purpose}",
                "Rt": {"Rotation": T[:3, :3].ravel().tolist(), "Translation": T[:3, 3].tolist()},
                "SensorWidth": sensor[0],
                "SensorHeight": sensor[1],
            }
        )
    return {"CalibrationInformation": {"Cameras": cameras}}


def write_matroska(
    file: Path,
    calibration: object | None,
    color: list[bytes],
    depth: list[np.ndarray],
    color_size: tuple[int, int],
    tag: bytes = b"MJPG",
    titles: tuple[str, str] = ("COLOR", "DEPTH"),
    late_ms: int = 1,
) -> None:
    """Write the tracks by FFmpeg's muxer; then their headers become those of k4arecorder."""
    options = {"allow_raw_vfw": "1", "write_crc32": "0"}
    with av.open(str(file), "w", format="matroska", options=options) as container:
        streams = []
        bits = {b"MJPG": 24, b"BGRA": 32, b"NV12": 12, b"YUY2": 16}[tag]
        sizes = color_size, depth[0].shape[::-1], depth[0].shape[::-1]
        for title, size in zip((*titles, "IR"), sizes, strict=True):
            stream = container.add_stream("rawvideo", rate=30)
            stream.width, stream.height = size
            stream.pix_fmt = "bgra" if title == titles[0] else "gray16be"
            stream.metadata["title"] = title
            streams.append(stream)
        if calibration is not None:
            data = json.dumps(calibration).encode() + b"\0"
            container.add_attachment("calibration.json", "application/octet-stream", data)
        container.start_encoding()
        for k, (photo, units) in enumerate(zip(color, depth, strict=True)):
            infrared = np.full(units.shape, 500, ">u2").tobytes()
            contents = photo, units.astype(">u2").tobytes(), infrared
            for stream, data, late in zip(streams, contents, (0, late_ms, late_ms), strict=True):
                packet = av.Packet(data)
                packet.stream, packet.time_base = stream, Fraction(1, 1000)
                packet.pts = packet.dts = 33 * k + late
                packet.is_keyframe = True
                container.mux_one(packet)
    written = file.read_bytes()
    for (width, height), kind in ((color_size, (bits, tag)), (sizes[1], (16, b"b16g"))):
        for own in (height, -height):
            for old in (32, 16):
                before = struct.pack("<IiiHHI", 40, width, own, 1, old, 0)
                after = struct.pack("<IiiHH4s", 40, width, height, 1, *kind)
                written = written.replace(before, after)
    file.write_bytes(written)


def write_kinect(folder: Path, rig: Rig) -> Path:
    """A recording of k4arecorder whose depth camera has the room's pixels in a corner of its image."""
    folder.mkdir(parents=True)
    color = rig.frames[0].intrinsics
    depth = CameraIntrinsics.pinhole(color.fx_px, color.fy_px, color.cx_px, color.cy_px, *DEPTH_SIZE)
    images = [_in_corner(frame) for frame in rig.frames]
    write_matroska(
        folder / "room.mkv",
        kinect_calibration(color, depth, np.eye(4)),
        [jpeg(frame.rgb) for frame in rig.frames],
        images,
        (color.width_px, color.height_px),
    )
    return folder / "room.mkv"


def _in_corner(frame: RgbdFrame) -> np.ndarray:
    units = np.zeros(DEPTH_SIZE[::-1], np.uint16)
    height, width = frame.depth.z_m.shape
    units[:height, :width] = depth_units(frame)
    return units


def write_stray_video(folder: Path, rig: Rig) -> Path:
    """Stray Scanner as it leaves the telephone: rgb.mp4 in place of photographs."""
    write_stray(folder, rig)
    photographs = sorted((folder / "rgb").iterdir())
    write_video(folder / "rgb.mp4", [np.asarray(Image.open(path)) for path in photographs])
    for path in photographs:
        path.unlink()
    (folder / "rgb").rmdir()
    return folder


def write_video(file: Path, images: list[np.ndarray], codec: str = "mpeg4") -> None:
    """Write (H, W, 3) RGB images as a video of 60 frames a second, with a full image every 12."""
    with av.open(str(file), "w") as container:
        options = {"qmin": "1", "qmax": "2", "sc_threshold": "1000000000"}
        stream = container.add_stream(codec, rate=60, options=options)
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt, stream.gop_size, stream.bit_rate = "yuv420p", 12, 20_000_000
        for image in images:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(image), "rgb24")))
        container.mux(stream.encode(None))
