"""Import of recordings of Stray Scanner: photographs and LiDAR depth of a telephone.

https://docs.strayrobots.io/apps/scanner/format.html
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import MAX_TEXT_BYTES, read_text
from pipeline.importing.cameras import camera_of
from pipeline.importing.pairing import color_folder, paired, thinned
from pipeline.importing.sequence import Candidate, Sequence, posed
from pipeline.io.images import read_color
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

CONFIDENCE_NOTE = "Depth to which the telephone gives its lowest confidence (0) is left out"
_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_CAMERA = ("fx", "fy", "cx", "cy")
_MATRIX, _ODOMETRY, _VIDEO = "camera_matrix.csv", "odometry.csv", "rgb.mp4"


def is_stray(folder: Path) -> bool:
    """Return whether a folder contains depth/ and camera_matrix.csv or odometry.csv."""
    return (folder / "depth").is_dir() and any((folder / name).is_file() for name in (_MATRIX, _ODOMETRY))


def read_stray(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the frames with a photograph in rgb/; depth in millimetres, poses and cameras of odometry.csv.

    Raises:
        InputError: the photographs are only in the video, or a file has another form.
    """
    colors = color_folder(folder)
    if colors is None:
        raise InputError(
            f"{folder} has no photographs in rgb/, and its video {_VIDEO} is not read; try in that folder: "
            f"mkdir rgb && ffmpeg -i {_VIDEO} -start_number 0 rgb/%06d.png"
        )
    every, unpaired = paired(colors, folder / "depth")
    pairs, rare = thinned(every)
    rows = _odometry(folder / _ODOMETRY)
    found = []
    for pair in pairs:
        color, depth = pair.color, pair.depth
        row = rows.get(_number(depth), {})
        confidence = folder / "confidence" / depth.with_suffix(".png").name
        found.append(
            Candidate(
                color,
                depth,
                _pose(row) if row.keys() >= set(_POSE) else None,
                row.get("timestamp"),
                confidence=confidence if confidence.is_file() else None,
            )
        )
    candidates, pose_notes = posed(found, f"pose in {_ODOMETRY} with the number of a frame")
    notes = (*unpaired, *rare, *pose_notes)
    if any(candidate.confidence for candidate in candidates):
        notes += (CONFIDENCE_NOTE,)
    if intrinsics is None and not (folder / _MATRIX).is_file():
        return _with_cameras(folder, candidates, rows, notes)
    camera, assumed = camera_of(folder, candidates[0].color, intrinsics or folder / _MATRIX, None, "")
    return Sequence(candidates, camera, notes=(*notes, *assumed))


def _with_cameras(
    folder: Path, candidates: tuple[Candidate, ...], rows: dict[int, dict[str, float]], notes: tuple[str, ...]
) -> Sequence:
    """Return the sequence with the camera that odometry.csv gives for each frame."""
    height_px, width_px = read_color(candidates[0].color).shape[:2]
    own = []
    for candidate in candidates:
        row = rows.get(_number(candidate.depth), {})
        if not row.keys() >= set(_CAMERA):
            raise InputError(
                f"{folder} has no {_MATRIX}, and its {_ODOMETRY} no fx, fy, cx and cy of every frame; try "
                "--intrinsics FILE"
            )
        fx, fy, cx, cy = (row[name] for name in _CAMERA)
        own.append(replace(candidate, camera=CameraIntrinsics.pinhole(fx, fy, cx, cy, width_px, height_px)))
    assert own[0].camera is not None
    return Sequence(tuple(own), own[0].camera, notes=notes)


def _number(depth: Path) -> int:
    return int(re.findall(r"\d+", depth.stem)[0])


def _pose(row: dict[str, float]) -> FloatArray | None:
    """Return the (4, 4) T_world_camera of a row, metres; None where tracking was lost."""
    values = np.array([row[name] for name in _POSE])
    if not np.isfinite(values).all() or np.linalg.norm(values[3:]) < 0.5:
        return None
    return rigid(Rotation.from_quat(values[3:]).as_matrix(), values[:3])


def _odometry(file: Path) -> dict[int, dict[str, float]]:
    """Return the numbers of each row by their titles, by the number of the frame; empty without a file."""
    if not file.is_file():
        return {}
    lines = [
        line for line in read_text(file, "trajectory", 100 * MAX_TEXT_BYTES).splitlines() if line.strip()
    ]
    titles, *rows = ([word for word in re.split(r"[,;\s]+", line.strip()) if word] for line in lines)
    try:
        values = [dict(zip(titles, map(float, row), strict=True)) for row in rows]
        return {int(row["frame"]): row for row in values}
    except (ValueError, KeyError):
        raise InputError(
            f"The trajectory {file} is not in Stray Scanner's format; try the titles timestamp, frame, x, y, "
            "z, qx, qy, qz, qw and a row of numbers a frame, or remove the file to import without poses"
        ) from None
