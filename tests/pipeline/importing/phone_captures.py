"""A rig written as telephones' apps write their captures: photographs three times as large as the depth."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from pipeline.types import CameraIntrinsics, RgbdFrame, Rig

TIMES = 3
PHOTO = CameraIntrinsics.pinhole(90.0, 91.5, 59.5, 44.5, 120, 90)
"""Three times as many pixels as ``recordings.CAMERA``: its cx is (19.5 + 0.5) * 3 - 0.5."""
_ARKIT = np.diag([1.0, -1.0, -1.0, 1.0])
"""ARKit's camera axes: y up, z backward."""


def photograph(frame: RgbdFrame) -> np.ndarray:
    return np.repeat(np.repeat(frame.rgb, TIMES, axis=0), TIMES, axis=1)


def write_stray(folder: Path, rig: Rig, low: bool = False, matrix: bool = True) -> None:
    """Poses are those of cameras with z forward; with ``low``, the left half has the lowest confidence."""
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy"]
    for index, frame in enumerate(rig.frames):
        _images(folder, f"{index:06d}", frame, "rgb", ".png", "depth")
        confidence = np.full((30, 40), 2, np.uint8)
        confidence[:, 20:] = 1
        confidence[:, :20] = 0 if low else 2
        (folder / "confidence").mkdir(exist_ok=True)
        Image.fromarray(confidence).save(folder / "confidence" / f"{index:06d}.png")
        T = frame.T_world_camera
        numbers = [0.1 * index, *T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat(), 90.0, 91.5, 59.5, 44.5]
        lines.append(f"{numbers[0]}, {index:06d}, " + ", ".join(repr(float(n)) for n in numbers[1:]))
    (folder / "odometry.csv").write_text("\n".join(lines) + "\n")
    if matrix:
        np.savetxt(folder / "camera_matrix.csv", PHOTO.matrix, delimiter=",")


def write_polycam(folder: Path, rig: Rig, corrected: bool = True) -> None:
    """As polyform's README says: rows t_00 to t_23 of cameras with y up, depth in millimetres."""
    frames = folder / "keyframes"
    prefix = "corrected_" if corrected else ""
    for index, frame in enumerate(rig.frames):
        stem = f"{262195552056 + 33333 * index}"
        _images(frames, stem, frame, f"{prefix}images", ".png", "depth")
        T = frame.T_world_camera @ _ARKIT
        values = {f"t_{i}{j}": T[i, j] for i in range(3) for j in range(4)}
        values |= {"fx": 90.0 + index, "fy": 91.5, "cx": 59.5, "cy": 44.5, "width": 120, "height": 90}
        (frames / f"{prefix}cameras").mkdir(parents=True, exist_ok=True)
        (frames / f"{prefix}cameras" / f"{stem}.json").write_text(json.dumps(values))
        (frames / "confidence").mkdir(exist_ok=True)
        levels = np.full((30, 40), 255, np.uint8)
        levels[:, :20] = 127
        levels[:10] = 0
        Image.fromarray(levels).save(frames / "confidence" / f"{stem}.png")
    (frames / "cameras").mkdir(exist_ok=True)


def write_record3d(folder: Path, rig: Rig, each: bool = False) -> None:
    """As its export as images: the matrix by columns, quaternions with the scalar last, depth in metres."""
    poses = []
    for index, frame in enumerate(rig.frames):
        (folder / "rgb").mkdir(parents=True, exist_ok=True)
        (folder / "depth").mkdir(exist_ok=True)
        Image.fromarray(photograph(frame)).save(folder / "rgb" / f"{index}.png")
        Image.fromarray(frame.depth.z_m).save(folder / "depth" / f"{index}.tiff")
        T = frame.T_world_camera @ _ARKIT
        poses.append([*Rotation.from_matrix(T[:3, :3]).as_quat(), *T[:3, 3]])
    values = {"w": 120, "h": 90, "K": PHOTO.matrix.T.ravel().tolist(), "poses": poses}
    if each:
        values["perFrameIntrinsicCoeffs"] = [[90.0 + k, 91.5, 59.5, 44.5] for k in range(len(poses))]
    (folder / "metadata.json").write_text(json.dumps(values))


def _images(folder: Path, stem: str, frame: RgbdFrame, colors: str, suffix: str, depths: str) -> None:
    for name in (colors, depths):
        (folder / name).mkdir(parents=True, exist_ok=True)
    Image.fromarray(photograph(frame)).save(folder / colors / f"{stem}{suffix}")
    z_m = np.where(frame.depth.valid, frame.depth.z_m, 0.0)
    cv2.imwrite(str(folder / depths / f"{stem}.png"), np.rint(1000.0 * z_m).astype(np.uint16))
