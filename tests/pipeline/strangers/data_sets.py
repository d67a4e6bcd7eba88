"""The room in the layouts of public data sets. Every writer returns the path to import."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np

from pipeline.types import Rig
from tests.pipeline.strangers.images import (
    ARKIT,
    depth_units,
    photograph,
    quaternion,
    save_color,
    save_depth,
    save_open3d_camera,
    save_opencv_camera,
    text_of,
)

OFF_ORTHONORMAL = 2.5e-4
"""Largest entry of the stretch S in R (1 + S); R R^T then differs from 1 by twice as much, as in 7-Scenes."""
Y_UP = np.diag([1.0, -1.0, 1.0, 1.0])
"""ICL-NUIM's camera and world have y up, so that they are left-handed."""


def write_tum(folder: Path, rig: Rig) -> Path:
    """Depth comes 8 ms after its image, poses every 10 ms; only the right one is the camera's."""
    lists: dict[str, list[str]] = {name: [f"# {name}"] for name in ("rgb", "depth", "groundtruth")}
    for index, frame in enumerate(rig.frames):
        time_s = 1305031102.1753 + index / 30.0
        for name, late_s in (("rgb", 0.0), ("depth", 0.008)):
            lists[name].append(f"{time_s + late_s:.6f} {name}/{time_s + late_s:.6f}.png")
        save_color(folder / lists["rgb"][-1].split()[1], frame.rgb)
        save_depth(folder / lists["depth"][-1].split()[1], frame, 5000.0)
        for late_s in (-0.012, -0.002, 0.012):
            T = frame.T_world_camera
            place_m = T[:3, 3] + (0.0 if late_s == -0.002 else 0.3)
            lists["groundtruth"].append(f"{time_s + late_s:.4f} {text_of([*place_m, *quaternion(T)])}")
    for name, lines in lists.items():
        (folder / f"{name}.txt").write_text("\n".join(lines) + "\n")
    save_opencv_camera(folder / "calibration.yaml", rig.frames[0].intrinsics)
    return folder


def write_icl_nuim(folder: Path, rig: Rig) -> Path:
    """Depth is named first; the poses are mirrored."""
    pairs, poses = [], []
    for index, frame in enumerate(rig.frames, start=1):
        save_color(folder / "rgb" / f"{index}.png", frame.rgb)
        save_depth(folder / "depth" / f"{index}.png", frame, 5000.0)
        pairs.append(f"{index} depth/{index}.png {index} rgb/{index}.png")
        T = Y_UP @ frame.T_world_camera @ Y_UP
        poses.append(f"{index} {text_of([*T[:3, 3], *quaternion(T)])}")
    (folder / "associations.txt").write_text("\n".join(pairs) + "\n")
    (folder / "livingRoom2.gt.freiburg").write_text("\n".join(poses) + "\n")
    save_open3d_camera(folder / "camera.json", rig.frames[0].intrinsics)
    return folder


def write_seven_scenes(folder: Path, rig: Rig) -> Path:
    """Unknown depth is 65535; the rotations are not quite orthonormal."""
    stretch = np.random.default_rng(7).uniform(-OFF_ORTHONORMAL, OFF_ORTHONORMAL, (3, 3))
    for index, frame in enumerate(rig.frames):
        stem = f"frame-{index:06d}"
        save_color(folder / f"{stem}.color.png", frame.rgb)
        save_depth(folder / f"{stem}.depth.png", frame, unknown=65535)
        T = frame.T_world_camera.copy()
        T[:3, :3] = T[:3, :3] @ (np.eye(3) + 0.5 * (stretch + stretch.T))
        rows = ("\t ".join(f"{value: .7e}" for value in row) for row in T)
        (folder / f"{stem}.pose.txt").write_text("\t \n".join(rows) + "\t \n")
    np.savetxt(folder / "camera-intrinsics.txt", rig.frames[0].intrinsics.matrix)
    return folder


def write_scannet(folder: Path, rig: Rig, times: int = 1) -> Path:
    """Write what SensReader exports: 4 x 4 cameras, the colour camera's with ``times`` as many pixels."""
    cameras = {"depth": rig.frames[0].intrinsics, "color": photograph(rig.frames[0], times)[1]}
    for name in ("pose", "intrinsic"):
        (folder / name).mkdir(parents=True)
    for index, frame in enumerate(rig.frames):
        save_color(folder / "color" / f"{index}.jpg", photograph(frame, times)[0])
        save_depth(folder / "depth" / f"{index}.png", frame)
        np.savetxt(folder / "pose" / f"{index}.txt", frame.T_world_camera, fmt="%f")
    for name, camera in cameras.items():
        matrix = np.eye(4)
        matrix[:3, :3] = camera.matrix
        np.savetxt(folder / "intrinsic" / f"intrinsic_{name}.txt", matrix, fmt="%f")
        np.savetxt(folder / "intrinsic" / f"extrinsic_{name}.txt", np.eye(4), fmt="%f")
    return folder


def write_redwood(folder: Path, rig: Rig) -> Path:
    """The world has the axes of the first camera: y points down."""
    T_first_world, lines = np.linalg.inv(rig.frames[0].T_world_camera), []
    for index, frame in enumerate(rig.frames):
        save_color(folder / "image" / f"{index + 1:07d}-{33333 * index:012d}.png", frame.rgb)
        save_depth(folder / "depth" / f"{index + 1:07d}-{33333 * index + 512:012d}.png", frame)
        rows = [text_of(row, 10) for row in T_first_world @ frame.T_world_camera]
        lines += [f"{index} {index} {index + 1}", *rows]
    (folder / "trajectory.log").write_text("\n".join(lines) + "\n")
    save_open3d_camera(folder / "camera.json", rig.frames[0].intrinsics)
    return folder


def write_open3d(folder: Path, rig: Rig) -> Path:
    """Write the folders of Open3D's reconstruction system, with the trajectory that it integrates along."""
    lines = []
    for index, frame in enumerate(rig.frames):
        save_color(folder / "color" / f"{index:05d}.jpg", frame.rgb)
        save_depth(folder / "depth" / f"{index:05d}.png", frame)
        lines += [f"{index} {index} {index + 1}", *(text_of(row, 8) for row in frame.T_world_camera)]
    (folder / "scene").mkdir()
    (folder / "scene" / "trajectory.log").write_text("\n".join(lines) + "\n")
    save_open3d_camera(folder / "camera_intrinsic.json", rig.frames[0].intrinsics)
    return folder


def write_sun_rgbd(folder: Path, rig: Rig) -> Path:
    """One frame without a pose, the bits of its millimetres rotated by three."""
    (frame,) = rig.frames
    save_color(folder / "image" / "0000001.jpg", frame.rgb)
    millimetres = depth_units(frame)
    (folder / "depth").mkdir()
    rotated = (millimetres << 3) | (millimetres >> 13)
    cv2.imwrite(str(folder / "depth" / "0000001.png"), rotated.astype(np.uint16))
    (folder / "intrinsics.txt").write_text(text_of(frame.intrinsics.matrix, 6) + "\n")
    return folder


def write_nerfstudio(folder: Path, rig: Rig) -> Path:
    """Camera axes are ARKit's, and a pixel's centre has the coordinate 0.5."""
    K, frames = rig.frames[0].intrinsics, []
    for index, frame in enumerate(rig.frames, start=1):
        names = f"images/frame_{index:05d}.png", f"depths/frame_{index:05d}.png"
        save_color(folder / names[0], frame.rgb)
        save_depth(folder / names[1], frame)
        pose = (frame.T_world_camera @ ARKIT).tolist()
        frames.append({"file_path": names[0], "depth_file_path": names[1], "transform_matrix": pose})
    camera = {"fl_x": K.fx_px, "fl_y": K.fy_px, "cx": K.cx_px + 0.5, "cy": K.cy_px + 0.5}
    camera |= {"w": K.width_px, "h": K.height_px, "camera_model": "OPENCV"}
    (folder / "transforms.json").write_text(json.dumps(camera | {"frames": frames}))
    return folder
