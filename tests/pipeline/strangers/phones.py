"""The room as telephones' apps export it: photographs of two to four times the depth's columns and rows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

from pipeline.types import Rig
from tests.pipeline.strangers.images import ARKIT, photograph, quaternion, save_color, save_depth


def write_stray(folder: Path, rig: Rig) -> Path:
    """Stray Scanner: twice as many pixels; poses of cameras with z forward."""
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw"]
    for index, frame in enumerate(rig.frames):
        rgb, camera = photograph(frame, 2)
        save_color(folder / "rgb" / f"{index:06d}.png", rgb)
        save_depth(folder / "depth" / f"{index:06d}.png", frame)
        (folder / "confidence").mkdir(exist_ok=True)
        levels = np.full(frame.depth.z_m.shape, 2, np.uint8)
        Image.fromarray(levels).save(folder / "confidence" / f"{index:06d}.png")
        T = frame.T_world_camera
        numbers = [repr(float(value)) for value in (*T[:3, 3], *quaternion(T))]
        lines.append(", ".join([f"{60.0 + 0.1 * index}", f"{index:06d}", *numbers]))
    (folder / "odometry.csv").write_text("\n".join(lines) + "\n")
    np.savetxt(folder / "camera_matrix.csv", camera.matrix, delimiter=",")
    return folder


def write_polycam(folder: Path, rig: Rig) -> Path:
    """Polycam's raw data: three times as many pixels in JPEG; rows t_00 to t_23 of cameras with y up."""
    frames = folder / "keyframes"
    for name in ("corrected_cameras", "cameras"):
        (frames / name).mkdir(parents=True)
    for index, frame in enumerate(rig.frames):
        stem = f"{262195552056 + 33333 * index}"
        rgb, camera = photograph(frame, 3)
        save_color(frames / "corrected_images" / f"{stem}.jpg", rgb)
        save_depth(frames / "depth" / f"{stem}.png", frame)
        T = frame.T_world_camera @ ARKIT
        values = {f"t_{i}{j}": T[i, j] for i in range(3) for j in range(4)}
        values |= {"fx": camera.fx_px, "fy": camera.fy_px, "cx": camera.cx_px, "cy": camera.cy_px}
        values |= {"width": camera.width_px, "height": camera.height_px, "timestamp": int(stem)}
        (frames / "corrected_cameras" / f"{stem}.json").write_text(json.dumps(values))
    return folder


def write_record3d(folder: Path, rig: Rig) -> Path:
    """Record3D's EXR and JPG images: four times as many pixels; the matrix by columns, the scalar last."""
    poses = []
    (folder / "depth").mkdir(parents=True)
    for index, frame in enumerate(rig.frames):
        rgb, camera = photograph(frame, 4)
        save_color(folder / "rgb" / f"{index}.jpg", rgb)
        z_m = np.nan_to_num(frame.depth.z_m).astype(np.float32)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"R": z_m}).write(str(folder / "depth" / f"{index}.exr"))
        T = frame.T_world_camera @ ARKIT
        poses.append([*quaternion(T), *T[:3, 3]])
    values = {"w": camera.width_px, "h": camera.height_px, "K": camera.matrix.T.ravel().tolist()}
    (folder / "metadata.json").write_text(json.dumps(values | {"fps": 60, "poses": poses}))
    return folder


def write_scanner_app(folder: Path, rig: Rig) -> Path:
    """3D Scanner App: three times as many pixels in JPEG; matrices by rows; some depth has no photograph."""
    for index, frame in enumerate(rig.frames):
        number = f"{6 * index:05d}"
        rgb, camera = photograph(frame, 3)
        save_color(folder / f"frame_{number}.jpg", rgb)
        for own in (number, f"{6 * index + 1:05d}"):
            save_depth(folder / f"depth_{own}.png", frame)
            levels = np.full(frame.depth.z_m.shape, 2, np.uint8)
            Image.fromarray(levels).save(folder / f"conf_{own}.png")
            values = {
                "cameraPoseARFrame": (frame.T_world_camera @ ARKIT).ravel().tolist(),
                "intrinsics": camera.matrix.ravel().tolist(),
                "time": 40.0 + 0.1 * index,
                "frame_index": 6 * index,
            }
            (folder / f"frame_{own}.json").write_text(json.dumps(values))
    (folder / "info.json").write_text("{}")
    return folder
