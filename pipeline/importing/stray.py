"""Import of recordings of Stray Scanner: photographs or a video, and LiDAR depth of a telephone.

https://docs.strayrobots.io/apps/scanner/format.html
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_PIXELS, MAX_TEXT_BYTES, read_text
from pipeline.importing.cameras import camera_of
from pipeline.importing.pairing import color_folder, depth_images, paired, require
from pipeline.importing.sequence import Candidate, Sequence, posed
from pipeline.importing.stored import AnyImage, StoredImage, read_color_of
from pipeline.importing.video import TrackReader, contents_of
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_CAMERA = ("fx", "fy", "cx", "cy")
_MATRIX, _ODOMETRY, _VIDEO = "camera_matrix.csv", "odometry.csv", "rgb.mp4"


def is_stray(folder: Path) -> bool:
    """Return whether a folder contains depth/ and camera_matrix.csv or odometry.csv."""
    return (folder / "depth").is_dir() and any((folder / name).is_file() for name in (_MATRIX, _ODOMETRY))


def read_stray(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the frames of rgb/ or of the video; depth in millimetres, poses and cameras of odometry.csv.

    Raises:
        InputError: there is neither a photograph nor a video, or a file has another form.
    """
    pairs, notes = _pairs(folder)
    rows = _odometry(folder / _ODOMETRY)
    own_cameras = intrinsics is None and not (folder / _MATRIX).is_file()
    height_px, width_px = read_color_of(pairs[0][0]).shape[:2]
    found = []
    for color, depth in pairs:
        row = rows.get(_number(depth), {})
        confidence = folder / "confidence" / depth.with_suffix(".png").name
        found.append(
            Candidate(
                color,
                depth,
                _pose(row) if row.keys() >= set(_POSE) else None,
                row.get("timestamp"),
                camera=_camera(row, width_px, height_px) if own_cameras else None,
                confidence=confidence if confidence.is_file() else None,
            )
        )
    candidates, without, pose_notes = posed(found, f"pose in {_ODOMETRY} with the number of a frame")
    notes += pose_notes
    if not own_cameras:
        camera, assumed = camera_of(folder, candidates[0].color, intrinsics or folder / _MATRIX, None, "")
        return Sequence(candidates, camera, without_poses=without, notes=(*notes, *assumed))
    cameras = [candidate.camera for candidate in candidates if candidate.camera]
    if len(cameras) < len(candidates):
        raise InputError(
            f"{folder} has no {_MATRIX}, and its {_ODOMETRY} no fx, fy, cx and cy of every frame; try "
            "--intrinsics FILE"
        )
    return Sequence(candidates, cameras[0], without_poses=without, notes=notes)


def _pairs(folder: Path) -> tuple[list[tuple[AnyImage, Path]], tuple[str, ...]]:
    """Return colour and depth of each frame, and notes."""
    colors = color_folder(folder)
    if colors is not None:
        pairs, unpaired = paired(colors, folder / "depth")
        return [(pair.color, pair.depth) for pair in pairs], unpaired
    video = folder / _VIDEO
    if not video.is_file():
        raise InputError(
            f"{folder} has neither photographs in rgb/ nor the video {_VIDEO}; try to copy it again"
        )
    tracks = contents_of(video).tracks
    if not tracks or not tracks[0].stamps:
        raise InputError(f"{video} holds no image; try to copy it again")
    if tracks[0].width_px * tracks[0].height_px > MAX_IMAGE_PIXELS:
        raise InputError(
            f"{video} has images of {tracks[0].width_px} x {tracks[0].height_px} pixels, more than the "
            f"{MAX_IMAGE_PIXELS / 1e6:g} million that are read; try a smaller one"
        )
    track, reader = tracks[0], TrackReader(video, tracks[:1], decoded=True)
    depths = sorted(depth_images(folder / "depth", "*[0-9]*"), key=_number)
    require(depths, folder, "depth/000000.png")
    numbers = list(range(len(depths)))
    if len(depths) != len(track.stamps):  # images are missing: their numbers count frames of the video
        numbers = [_number(depth) - _number(depths[0]) for depth in depths]
    films: list[tuple[AnyImage, Path]] = [
        (StoredImage(video, f"frame {k}", partial(reader.frame, track, k)), depth)
        for k, depth in zip(numbers, depths, strict=True)
        if k < len(track.stamps)
    ]
    note = f"{_VIDEO} has {len(track.stamps)} frames and depth/ {len(depths)} images: {len(films)} are used"
    return films, (note,) if len(depths) != len(track.stamps) else ()


def _camera(row: dict[str, float], width_px: int, height_px: int) -> CameraIntrinsics | None:
    """Return the camera of a row; None if it has none."""
    if not row.keys() >= set(_CAMERA):
        return None
    fx, fy, cx, cy = (row[name] for name in _CAMERA)
    return CameraIntrinsics.pinhole(fx, fy, cx, cy, width_px, height_px)


def _number(depth: Path) -> int:
    return int(re.findall(r"\d+", depth.stem)[0])


def _pose(row: dict[str, float]) -> FloatArray | None:
    """Return the (4, 4) T_world_camera of a row, metres; None where tracking was lost."""
    values = np.array([row[name] for name in _POSE])
    if not np.isfinite(values).all() or np.linalg.norm(values[3:]) < 0.5:
        return None
    return rigid(Rotation.from_quat(values[3:]).as_matrix(), values[:3])


def _odometry(file: Path) -> dict[int, dict[str, float]]:
    """Return the rows of a trajectory by frame number, each as numbers by title; empty without a file.

    Raises:
        InputError: the file has another form.
    """
    if not file.is_file():
        return {}
    lines = [
        line for line in read_text(file, "trajectory", 100 * MAX_TEXT_BYTES).splitlines() if line.strip()
    ]
    try:
        titles, *rows = ([word for word in re.split(r"[,;\s]+", line.strip()) if word] for line in lines)
        values = [dict(zip(titles, map(float, row), strict=True)) for row in rows]
        return {int(row["frame"]): row for row in values}
    except (ValueError, KeyError, OverflowError):
        raise InputError(
            f"The trajectory {file} is not in Stray Scanner's format; try the titles timestamp, frame, x, y, "
            "z, qx, qy, qz, qw and a row of numbers a frame, or remove the file to import without poses"
        ) from None
