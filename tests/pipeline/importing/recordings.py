"""A rig written in the layouts of other people's data sets, as their documents describe them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.io.images import write_color
from pipeline.kernels.geometry import look_at
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame, Rig

CAMERA = CameraIntrinsics.pinhole(30.0, 30.5, 19.5, 14.5, 40, 30)


def orbit(count: int, radius_m: float = 2.0, step_deg: float = 10.0) -> Rig:
    """Cameras on a circle about the origin, each seeing something 2 m away, a corner of it unknown."""
    rng = np.random.default_rng(7)
    frames = []
    for index in range(count):
        angle = np.deg2rad(step_deg * index)
        z_m = (rng.integers(1500, 2500, (30, 40)) / 1000.0).astype(np.float32)
        z_m[:6, :8] = np.nan
        rgb = rng.integers(0, 256, (30, 40, 3), dtype=np.uint8)
        T = look_at((radius_m * np.cos(angle), radius_m * np.sin(angle), 0.5), (0.0, 0.0, 0.0))
        frames.append(RgbdFrame(f"node_{index:02d}", rgb, DepthMap(z_m), CAMERA, T))
    return Rig("orbit", tuple(frames))


def write_tum(folder: Path, rig: Rig) -> None:
    """Depth comes 8 ms after its picture, poses at 100 Hz; a picture and a depth image have no partner."""
    lists: dict[str, list[str]] = {name: ["# a comment"] for name in ("rgb", "depth", "groundtruth")}
    for index, frame in enumerate(rig.frames):
        time_s = 1305031452.79 + index / 30.0
        color, depth = f"rgb/{time_s:.6f}.png", f"depth/{time_s + 0.008:.6f}.png"
        write_color(folder / color, frame.rgb)
        _write_units(folder / depth, frame, 5000.0)
        lists["rgb"].append(f"{time_s:.6f} {color}")
        lists["depth"].append(f"{time_s + 0.008:.6f} {depth}")
        for late_s in (-0.015, 0.002, 0.017):
            T = frame.T_world_camera.copy()
            T[:3, 3] += 0.0 if late_s == 0.002 else 0.1
            values = [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()]
            lists["groundtruth"].append(f"{time_s + late_s:.4f} " + " ".join(f"{v:.9f}" for v in values))
    lists["rgb"].append("1305031000.0 rgb/without_depth.png")
    lists["depth"].append("1305031900.0 depth/without_color.png")
    for name, lines in lists.items():
        (folder / f"{name}.txt").write_text("\n".join(lines) + "\n")
    _write_camera(folder / "camera.json")


def write_seven_scenes(folder: Path, rig: Rig) -> None:
    """Unknown depth is 65535."""
    for index, frame in enumerate(rig.frames):
        stem = f"frame-{index:06d}"
        write_color(folder / f"{stem}.color.png", frame.rgb)
        _write_units(folder / f"{stem}.depth.png", frame, 1000.0, unknown=65535)
        np.savetxt(folder / f"{stem}.pose.txt", frame.T_world_camera, fmt="%.9g")
    (folder / "camera-intrinsics.txt").write_text("30 0 19.5\n0 30.5 14.5\n0 0 1\n")


def write_scannet(folder: Path, rig: Rig) -> None:
    """Numbers without zeros before them, and 4 x 4 cameras."""
    for index, frame in enumerate(rig.frames):
        write_color(folder / "color" / f"{index}.png", frame.rgb)
        _write_units(folder / "depth" / f"{index}.png", frame, 1000.0)
        (folder / "pose").mkdir(exist_ok=True)
        np.savetxt(folder / "pose" / f"{index}.txt", frame.T_world_camera, fmt="%.9f")
    (folder / "intrinsic").mkdir()
    matrix = np.eye(4)
    matrix[:3, :3] = CAMERA.matrix
    for of in ("color", "depth"):
        np.savetxt(folder / "intrinsic" / f"intrinsic_{of}.txt", matrix)
        np.savetxt(folder / "intrinsic" / f"extrinsic_{of}.txt", np.eye(4))


def write_redwood(folder: Path, rig: Rig) -> None:
    """Names with the number and the time of each image; the poses in one file."""
    lines = []
    for index, frame in enumerate(rig.frames):
        write_color(folder / "image" / f"{index + 1:07d}-{33333 * index:012d}.png", frame.rgb)
        _write_units(folder / "depth" / f"{index + 1:07d}-{33333 * index + 512:012d}.png", frame, 1000.0)
        rows = [" ".join(f"{value:.9f}" for value in row) for row in frame.T_world_camera]
        lines += [f"{index} {index} {index + 1}", *rows]
    (folder / "trajectory.log").write_text("\n".join(lines) + "\n")
    _write_camera(folder / "camera_intrinsic.json")


def write_colmap(folder: Path, rig: Rig, metres_a_unit: float = 1.0, sensor: bool = False) -> None:
    """A text model with dense depth maps, or with a sensor's images and points that were measured in them.

    The model's unit is so many metres long; COLMAP's pixels begin at their corners.
    """
    rng = np.random.default_rng(3)
    images, points = ["# a comment"], ["# a comment"]
    for index, frame in enumerate(rig.frames):
        name = f"room/view_{index}.png"
        write_color(folder / "images" / name, frame.rgb)
        T_camera_world = np.linalg.inv(frame.T_world_camera)
        x, y, z, w = Rotation.from_matrix(T_camera_world[:3, :3]).as_quat()
        place = T_camera_world[:3, 3] / metres_a_unit
        pose = [index + 1, w, x, y, z, *place, 1, name]
        features = []
        if sensor:
            _write_units(folder / "depth" / name, frame, 1000.0)
            for v, u in rng.integers(0, (30, 40), (20, 2)):
                z_m = np.nan_to_num(frame.depth.z_m[v, u], nan=2.0) * rng.choice([1.0, 1.0, 1.0, 1.6])
                ray = np.linalg.solve(CAMERA.matrix, [u, v, 1.0])
                world = frame.T_world_camera @ [*(z_m * ray), 1.0]
                points.append(
                    f"{len(points)} {' '.join(map(repr, (world[:3] / metres_a_unit).tolist()))} 0 0 0 0.5 1 0"
                )
                features += [f"{u + 0.5} {v + 0.5} {len(points) - 1}", "3.5 4.5 -1"]
        else:
            file = folder / "stereo" / "depth_maps" / f"{name}.geometric.bin"
            file.parent.mkdir(parents=True, exist_ok=True)
            values = np.nan_to_num(frame.depth.z_m / metres_a_unit).astype("<f4")
            file.write_bytes(b"40&30&1&" + values.tobytes())
        images += [" ".join(map(str, pose)), " ".join(features)]
    model = folder / "sparse"
    model.mkdir(parents=True)
    (model / "cameras.txt").write_text("# a comment\n1 PINHOLE 40 30 30 30.5 20 15\n")
    (model / "images.txt").write_text("\n".join(images) + "\n")
    (model / "points3D.txt").write_text("\n".join(points) + "\n")


LAYOUTS: dict[str, Callable[[Path, Rig], None]] = {
    "TUM": write_tum,
    "7-Scenes": write_seven_scenes,
    "ScanNet": write_scannet,
    "Redwood or Open3D": write_redwood,
    "COLMAP": write_colmap,
}


def write_sunrgbd(folder: Path, frame: RgbdFrame) -> None:
    """One frame, its millimetres rotated to the left by three bits."""
    write_color(folder / "image" / "0000001.png", frame.rgb)
    millimetres = _units(frame, 1000.0, 0)
    (folder / "depth_bfx").mkdir()
    rotated = (millimetres << 3) | (millimetres >> 13)
    cv2.imwrite(str(folder / "depth_bfx" / "0000001.png"), rotated.astype(np.uint16))
    np.savetxt(folder / "intrinsics.txt", CAMERA.matrix.reshape(1, 9))


def _write_units(path: Path, frame: RgbdFrame, units_per_metre: float, unknown: int = 0) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), _units(frame, units_per_metre, unknown))


def _units(frame: RgbdFrame, units_per_metre: float, unknown: int) -> np.ndarray:
    known = frame.depth.valid
    units = np.rint(np.where(known, frame.depth.z_m, 0.0).astype(np.float64) * units_per_metre)
    return np.where(known, units, unknown).astype(np.uint16)


def _write_camera(path: Path) -> None:
    """In Open3D's style: the matrix by columns."""
    matrix = CAMERA.matrix.T.ravel().tolist()
    path.write_text(json.dumps({"width": 40, "height": 30, "intrinsic_matrix": matrix}))
