"""Import of captures of Polycam and 3D Scanner App: photographs and LiDAR depth, placed by ARKit.

Polycam: https://github.com/PolyCam/polyform; 3D Scanner App: its export "All Data".
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import read_json
from pipeline.importing.cameras import camera_of
from pipeline.importing.found_poses import found_poses
from pipeline.importing.pairing import require, visible
from pipeline.importing.sequence import DEPTH_SUFFIXES, Candidate, Sequence, posed
from pipeline.io.images import read_color
from pipeline.io.intrinsics import check_camera
from pipeline.types import CameraIntrinsics, FloatArray

Y_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
"""(4, 4) transform from camera axes with z forward, y down to ARKit's, with z backward and y up."""
POLYCAM_HIGHEST = 255
"""Value of high confidence in Polycam's images; low is 0, medium 127 by its documents and 54 in its files."""


def is_polycam(folder: Path) -> bool:
    """Return whether a folder has keyframes/ with depth/ and JSON files in cameras/, or is that folder."""
    return _keyframes(folder) is not None


def read_polycam(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the keyframes of Polycam's raw data; depth in millimetres.

    The corrected images and cameras are read if the folder has both.

    Raises:
        InputError: no keyframe has a photograph, a camera and depth, or a camera has another form.
    """
    frames = _keyframes(folder)
    assert frames is not None
    corrected = all(_filled(frames / f"corrected_{name}") for name in ("cameras", "images"))
    prefix = "corrected_" if corrected else ""
    files = visible((frames / f"{prefix}cameras").glob("*.json"))
    found = [(file, *images) for file in files if (images := _polycam_images(frames, prefix, file.stem))]
    require(found, frames, f"an image in {prefix}images/ and depth/ with a name of {prefix}cameras/")
    read = {file: _polycam_camera(file) for file, _, _ in found}
    poses = found_poses({file: T for file, (_, T) in read.items()})
    candidates, without, notes = posed(
        [
            Candidate(
                color,
                depth,
                poses.T_world_camera.get(file),
                camera=None if intrinsics else read[file][0],
                confidence=_if_file(frames / "confidence" / f"{depth.stem}.png"),
            )
            for file, color, depth in found
        ],
        f"pose in {prefix}cameras/",
        poses,
    )
    camera, _ = read[found[0][0]]
    if intrinsics:
        camera, _ = camera_of(folder, candidates[0].color, intrinsics, None, "")
    return Sequence(
        candidates,
        camera,
        highest_confidence=POLYCAM_HIGHEST,
        without_poses=without,
        notes=notes,
    )


def _polycam_images(frames: Path, prefix: str, stem: str) -> tuple[Path, Path] | None:
    """Return the colour and the depth image of a keyframe; None if one is missing."""
    colors = sorted((frames / f"{prefix}images").glob(f"{stem}.*"))
    depths = [path for path in sorted((frames / "depth").glob(f"{stem}.*")) if path.suffix in DEPTH_SUFFIXES]
    return (colors[0], depths[0]) if colors and depths else None


def _polycam_camera(file: Path) -> tuple[CameraIntrinsics, FloatArray]:
    """Read the camera of a keyframe, and its (4, 4) T_world_camera, metres."""
    values: Mapping[str, Any] = read_json(file, "camera of Polycam")
    try:
        fx, fy, cx, cy = (float(values[name]) for name in ("fx", "fy", "cx", "cy"))
        camera = CameraIntrinsics.pinhole(fx, fy, cx, cy, int(values["width"]), int(values["height"]))
        rows = [[float(values[f"t_{i}{j}"]) for j in range(4)] for i in range(3)]
    except (KeyError, TypeError, ValueError, OverflowError):
        raise InputError(
            f"The camera {file} is not in Polycam's format; try fx, fy, cx, cy, width, height, t_00 to t_23"
        ) from None
    check_camera(f"The camera {file}", camera)
    return camera, np.array([*rows, [0.0, 0.0, 0.0, 1.0]]) @ Y_DOWN


def is_scanner_app(folder: Path) -> bool:
    """Return whether a folder contains frame_00000.json and depth_00000.png or similar files."""
    return all(next(folder.glob(pattern), None) is not None for pattern in ("frame_*.json", "depth_*.png"))


def read_scanner_app(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the frames of 3D Scanner App that have a photograph and depth, which is in millimetres.

    Raises:
        InputError: no frame has both, or a file of a frame has another form.
    """
    found = [
        (color, depth)
        for color in visible(folder.glob("frame_*.jpg"))
        if (depth := folder / f"depth_{color.stem.partition('_')[2]}.png").is_file()
        and color.with_suffix(".json").is_file()
    ]
    require(found, folder, "frame_00000.jpg, frame_00000.json and depth_00000.png of one number")
    height_px, width_px = read_color(found[0][0]).shape[:2]
    read = {
        color: _scanner_app_camera(color.with_suffix(".json"), (width_px, height_px)) for color, _ in found
    }
    poses = found_poses({color: T for color, (_, T, _) in read.items()})
    times = [time_s for _, _, time_s in read.values() if time_s is not None]
    timed = len(times) == len(found) and bool((np.diff(times) > 0.0).all())
    candidates, without, notes = posed(
        [
            Candidate(
                color,
                depth,
                poses.T_world_camera.get(color),
                time_s=read[color][2] if timed else None,
                camera=None if intrinsics else read[color][0],
                confidence=_if_file(folder / depth.name.replace("depth_", "conf_")),
            )
            for color, depth in found
        ],
        "cameraPoseARFrame",
        poses,
    )
    camera = read[found[0][0]][0]
    if intrinsics:
        camera, _ = camera_of(folder, candidates[0].color, intrinsics, None, "")
    return Sequence(candidates, camera, without_poses=without, notes=notes)


def _scanner_app_camera(
    file: Path, size_px: tuple[int, int]
) -> tuple[CameraIntrinsics, FloatArray, float | None]:
    """Read the camera of a frame, its (4, 4) T_world_camera, metres, and its time, seconds, or None."""
    values: Mapping[str, Any] = read_json(file, "frame of 3D Scanner App")
    try:
        matrix = np.array(values["intrinsics"], np.float64).reshape(3, 3)
        T = np.array(values["cameraPoseARFrame"], np.float64).reshape(4, 4)
        time_s = None if values.get("time") is None else float(values["time"])
    except (KeyError, TypeError, ValueError, OverflowError):
        raise InputError(
            f"The frame {file} is not in 3D Scanner App's format; try intrinsics of 9 numbers and "
            "cameraPoseARFrame of 16, by rows"
        ) from None
    fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    camera = CameraIntrinsics.pinhole(fx, fy, cx, cy, *size_px)
    check_camera(f"The frame {file}", camera)
    return camera, T @ Y_DOWN, time_s


def _keyframes(folder: Path) -> Path | None:
    for place in (folder / "keyframes", folder):
        cameras = [
            file for name in ("corrected_cameras", "cameras") for file in (place / name).glob("*.json")
        ]
        if cameras and (place / "depth").is_dir():
            return place
    return None


def _if_file(path: Path) -> Path | None:
    return path if path.is_file() else None


def _filled(folder: Path) -> bool:
    return folder.is_dir() and any(folder.iterdir())
