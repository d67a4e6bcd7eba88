"""Import of captures of Polycam and Record3D: photographs and LiDAR depth of a telephone, placed by ARKit.

Polycam: https://github.com/PolyCam/polyform; Record3D: its export as EXR and JPG images.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import MAX_TEXT_BYTES, json_object, read_json, read_text
from pipeline.importing.cameras import camera_of
from pipeline.importing.found_poses import found_poses
from pipeline.importing.pairing import color_folder, paired, pose_indices, require, thinned, visible
from pipeline.importing.sequence import DEPTH_SUFFIXES, Candidate, Sequence, posed
from pipeline.importing.stray import CONFIDENCE_NOTE
from pipeline.io.intrinsics import check_camera
from pipeline.types import CameraIntrinsics, FloatArray

_Y_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
"""From camera axes with z forward and y down to ARKit's, with z backward and y up."""
_METADATA = ("metadata.json", "metadata")


def is_polycam(folder: Path) -> bool:
    """Return whether a folder has keyframes/ with depth/ and JSON files in cameras/, or is that folder."""
    return _keyframes(folder) is not None


def read_polycam(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the keyframes of Polycam's raw data, corrected if they are; depth in millimetres.

    Raises:
        InputError: no keyframe has a photograph, a camera and depth, or a camera has another form.
    """
    frames = _keyframes(folder)
    assert frames is not None
    corrected = all(_filled(frames / f"corrected_{name}") for name in ("cameras", "images"))
    prefix = "corrected_" if corrected else ""
    files, rare = thinned(visible((frames / f"{prefix}cameras").glob("*.json")))
    found = [(file, *images) for file in files if (images := _polycam_images(frames, prefix, file.stem))]
    require(found, frames, f"an image in {prefix}images/ and depth/ with a name of {prefix}cameras/")
    read = {file: _polycam_camera(file) for file, _, _ in found}
    poses = found_poses({file: T for file, (_, T) in read.items()})
    candidates, notes = posed(
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
    if any(candidate.confidence for candidate in candidates):
        notes += (CONFIDENCE_NOTE,)
    camera, _ = read[found[0][0]]
    if intrinsics:
        camera, _ = camera_of(folder, candidates[0].color, intrinsics, None, "")
    return Sequence(candidates, camera, notes=(*rare, *notes))


def _polycam_images(frames: Path, prefix: str, stem: str) -> tuple[Path, Path] | None:
    """Return the colour and the depth image of a keyframe; None if one is missing."""
    colors = sorted((frames / f"{prefix}images").glob(f"{stem}.*"))
    depths = [path for path in sorted((frames / "depth").glob(f"{stem}.*")) if path.suffix in DEPTH_SUFFIXES]
    return (colors[0], depths[0]) if colors and depths else None


def is_record3d(folder: Path) -> bool:
    """Return whether a folder contains metadata with a camera and poses, and images or rgbd/."""
    file = _metadata_in(folder)
    if file is None or not (_has_images(folder) or (folder / "rgbd").is_dir()):
        return False
    try:
        return json_object(read_text(file, "metadata", 100 * MAX_TEXT_BYTES), file, "metadata").keys() >= {
            "K",
            "w",
            "h",
        }
    except InputError:
        return False


def read_record3d(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read a Record3D export as images: rgb/, depth/ in metres, and metadata with the camera and poses.

    Raises:
        InputError: depth is compressed, or the metadata have another form.
    """
    file, colors = _metadata_in(folder), color_folder(folder)
    assert file is not None
    if colors is None or not _has_images(folder):
        raise InputError(
            f"{folder} holds Record3D's own compressed depth in rgbd/, which is not read; try Record3D's "
            "export as EXR and JPG images"
        )
    every, unpaired = paired(colors, folder / "depth")
    camera, each, matrices = _record3d_metadata(file)
    frames = pose_indices(every, max(len(each), max(matrices, default=-1) + 1))
    pairs, rare = thinned(list(zip(frames, every, strict=True)))
    poses = found_poses(matrices)
    own = {} if intrinsics else dict(enumerate(each))
    candidates, notes = posed(
        [
            Candidate(pair.color, pair.depth, poses.T_world_camera.get(k), camera=own.get(k))
            for k, pair in pairs
        ],
        f"poses in {file.name}",
        poses,
    )
    if intrinsics:
        camera, _ = camera_of(folder, candidates[0].color, intrinsics, None, "")
    return Sequence(candidates, camera, notes=(*unpaired, *rare, *notes))


def _record3d_metadata(file: Path) -> tuple[CameraIntrinsics, list[CameraIntrinsics], dict[int, FloatArray]]:
    """Read the camera, the cameras of the frames if they are given, and (4, 4) T_world_camera by frame."""
    values = json_object(read_text(file, "metadata", 100 * MAX_TEXT_BYTES), file, "metadata")
    try:
        size_px = int(values["w"]), int(values["h"])
        matrix = np.array(values["K"], dtype=np.float64).reshape(3, 3).T
        fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
        camera = CameraIntrinsics.pinhole(fx, fy, cx, cy, *size_px)
        rows = np.array(values.get("perFrameIntrinsicCoeffs") or [], dtype=np.float64).reshape(-1, 4)
        each = [CameraIntrinsics.pinhole(fx, fy, cx, cy, *size_px) for fx, fy, cx, cy in rows.tolist()]
        poses = np.array(values.get("poses") or [], dtype=np.float64).reshape(-1, 7)
    except (KeyError, TypeError, ValueError, OverflowError):
        raise InputError(
            f"The metadata {file} are not in Record3D's format; try w, h, K of 9 numbers and poses of 7"
        ) from None
    for one in (camera, *each):
        check_camera(f"The metadata {file}", one)
    return camera, each, {k: _from_arkit(row) for k, row in enumerate(poses) if np.linalg.norm(row[:4]) > 0.5}


def _from_arkit(row: FloatArray) -> FloatArray:
    """Return the (4, 4) T_world_camera of a quaternion, its scalar last, and a position in ARKit's axes."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_quat(row[:4]).as_matrix(), row[4:]
    return T @ _Y_DOWN


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
    return camera, np.array([*rows, [0.0, 0.0, 0.0, 1.0]]) @ _Y_DOWN


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


def _metadata_in(folder: Path) -> Path | None:
    return next((folder / name for name in _METADATA if (folder / name).is_file()), None)


def _has_images(folder: Path) -> bool:
    return color_folder(folder) is not None and (folder / "depth").is_dir()
