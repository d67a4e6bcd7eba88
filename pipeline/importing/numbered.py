"""Import of recordings with numbered files: 7-Scenes, Redwood and Open3D, ScanNet, SUN RGB-D."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_TEXT_BYTES, read_bytes, read_text
from pipeline.importing.cameras import PRIMESENSE, camera_of
from pipeline.importing.sequence import DEPTH_SUFFIXES, Candidate, Sequence, posed
from pipeline.io.images import read_color, read_depth_values
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.poses import read_pose, rigid_or_none
from pipeline.kernels.geometry import inverse
from pipeline.types import CameraIntrinsics, FloatArray

MOST_CANDIDATES = 600
"""Largest number of frames that are considered; longer recordings are subsampled."""
COLOR_FOLDERS = ("color", "rgb", "image", "images")
_COLOR_SUFFIXES = (".jpg", ".jpeg", ".png", ".ppm")
_SEVEN_SCENES = CameraIntrinsics.pinhole(585.0, 585.0, 320.0, 240.0, 640, 480)


def is_seven_scenes(folder: Path) -> bool:
    """Return whether a folder contains frame-000000.color.png or similar files."""
    return next(folder.glob("frame-*.color.*"), None) is not None


def read_seven_scenes(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read frames of 7-Scenes (Shotton et al., CVPR 2013), 3DMatch or BundleFusion; depth in millimetres."""
    found = []
    colors, thinned = _thinned(sorted(folder.glob("frame-*.color.*")))
    for color in colors:
        stem = color.name.split(".")[0]
        depth = next(iter(_depths(folder, f"{stem}.depth.*")), None)
        if depth is not None:
            found.append(Candidate(color, depth, _pose_or_none(folder / f"{stem}.pose.txt")))
    _some(found, folder, "frame-000000.depth.png beside frame-000000.color.png")
    candidates, notes = posed(found, "frame-000000.pose.txt")
    default = _SEVEN_SCENES, "those of 7-Scenes, whose depth is not quite registered to the colour"
    camera, assumed = camera_of(folder, candidates[0].color, intrinsics, *default)
    return Sequence(candidates, camera, notes=(*thinned, *assumed, *notes))


def is_scannet(folder: Path) -> bool:
    """Return whether a folder contains color/, depth/, pose/ and intrinsic/."""
    return all((folder / name).is_dir() for name in ("color", "depth", "pose", "intrinsic"))


def read_scannet(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read a ScanNet scene as exported by its SensReader (Dai et al., CVPR 2017); depth in millimetres."""
    pairs, thinned = _thinned(_paired(folder / "color", folder / "depth"))
    found = [
        Candidate(color, depth, _pose_or_none(folder / "pose" / f"{color.stem}.txt"))
        for color, depth in pairs
    ]
    candidates, lost = posed(found, "pose in pose/")
    notes = (*thinned, *lost)
    first, beside = candidates[0], folder / "intrinsic"
    height_px, width_px = read_color(first.color).shape[:2]
    if intrinsics is None:
        camera = read_intrinsics(beside / "intrinsic_color.txt", (width_px, height_px))
    else:
        camera, _ = camera_of(folder, first.color, intrinsics, None, "")
    depth_height_px, depth_width_px = read_depth_values(first.depth).shape
    if (depth_height_px, depth_width_px) == (height_px, width_px):
        return Sequence(candidates, camera, notes=notes)
    depth_camera = read_intrinsics(beside / "intrinsic_depth.txt", (depth_width_px, depth_height_px))
    extrinsics = [beside / f"extrinsic_{of}.txt" for of in FRAMES]
    T_body_color, T_body_depth = map(_matrix_or_identity, extrinsics)
    missing = " and ".join(file.name for file in extrinsics if not file.is_file())
    if missing:
        notes += (f"No {missing}: taken as the identity, so that depth may be shifted against the colour",)
    T_color_depth = inverse(T_body_color) @ T_body_depth
    return Sequence(candidates, camera, depth_camera=depth_camera, T_color_depth=T_color_depth, notes=notes)


FRAMES = ("color", "depth")


def is_open3d(folder: Path) -> bool:
    """Return whether a folder contains depth/ and color/, rgb/ or image/."""
    return (folder / "depth").is_dir() and _color_folder(folder) is not None


def read_open3d(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read Redwood (Choi et al., CVPR 2015) or Open3D recordings; depth in mm, poses in a .log file."""
    color_folder = _color_folder(folder)
    assert color_folder is not None
    pairs, thinned = _thinned(list(enumerate(_paired(color_folder, folder / "depth"))))
    logs = [log for log in _logs(folder) if "traj" in log.name]
    poses = read_trajectory_log(logs[0]) if logs else {}
    found = [Candidate(color, depth, poses.get(index)) for index, (color, depth) in pairs]
    candidates, notes = posed(found, "trajectory .log")
    default = PRIMESENSE, "a PrimeSense camera's from the factory"
    camera, assumed = camera_of(folder, candidates[0].color, intrinsics, *default)
    return Sequence(candidates, camera, notes=(*thinned, *assumed, *notes))


def read_trajectory_log(file: Path) -> dict[int, FloatArray]:
    """Read T_world_camera by frame number from Redwood's format: a line of three integers, then four rows.

    Raises:
        InputError: the file has another format.
    """
    data = read_bytes(file, 100 * MAX_TEXT_BYTES, "trajectory")
    try:
        rows = np.array(data.split(), dtype=np.float64).reshape(-1, 19)
    except ValueError:
        raise InputError(
            f"The trajectory {file} is not in Redwood's format; try three integers and 4 x 4 numbers a frame"
        ) from None
    poses = ((int(row[0]), rigid_or_none(row[3:].reshape(4, 4))) for row in rows if np.isfinite(row[0]))
    return {index: T for index, T in poses if T is not None}


def is_sunrgbd(folder: Path) -> bool:
    """Return whether a folder contains image/ and depth_bfx/, or image/ and depth/ with intrinsics.txt."""
    depth = (folder / "depth_bfx").is_dir() or (folder / "depth").is_dir()
    return (folder / "image").is_dir() and depth and (folder / "intrinsics.txt").is_file()


def read_sunrgbd(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the frame of a SUN RGB-D folder (Song et al., CVPR 2015), with merged depth if available."""
    colors = [path for path in sorted((folder / "image").iterdir()) if path.suffix.lower() in _COLOR_SUFFIXES]
    depths = [path for name in ("depth_bfx", "depth") for path in _depths(folder / name, "*")]
    _some(colors, folder, "an image in image/")
    _some(depths, folder, "an image in depth_bfx/ or depth/")
    camera, notes = camera_of(folder, colors[0], intrinsics, None, "")
    return Sequence((Candidate(colors[0], depths[0]),), camera, rotated_bits=True, notes=notes)


def _paired(colors: Path, depths: Path) -> list[tuple[Path, Path]]:
    """Pair the images whose names have the same number, in order of the number."""
    by_number = [
        _by_number(path for path in folder.iterdir() if path.suffix.lower() in suffixes)
        for folder, suffixes in ((colors, _COLOR_SUFFIXES), (depths, DEPTH_SUFFIXES))
    ]
    both = sorted(by_number[0].keys() & by_number[1].keys())
    _some(both, colors.parent, f"an image in {depths.name}/ with the number of an image in {colors.name}/")
    return [(by_number[0][number], by_number[1][number]) for number in both]


def _depths(folder: Path, pattern: str) -> list[Path]:
    """List the depth images, sorted by name."""
    return [path for path in sorted(folder.glob(pattern)) if path.suffix.lower() in DEPTH_SUFFIXES]


def _by_number(paths: Iterable[Path]) -> dict[tuple[int, ...], Path]:
    """Index paths by the first number in the name (Redwood's frame number), or by all if it is not unique."""
    numbered = [(tuple(map(int, re.findall(r"\d+", path.stem))), path) for path in paths]
    by_first = {numbers[:1]: path for numbers, path in numbered if numbers}
    return by_first if len(by_first) == len(numbered) else dict(numbered)


def _thinned(items: list) -> tuple[list, tuple[str, ...]]:
    """Subsample a long list evenly; returns it with a note about the subsampling."""
    every = -(-len(items) // MOST_CANDIDATES) or 1
    note = f"Of {len(items)} frames one in {every} was looked at"
    return items[::every], (note,) if every > 1 else ()


def _some(items: list, folder: Path, missing: str) -> None:
    if not items:
        raise InputError(f"{folder} has no frame with colour and depth: it lacks {missing}; check the path")


def _pose_or_none(path: Path) -> FloatArray | None:
    """Read a pose; None if the file is missing, or has -inf because the recording lost track."""
    try:
        return read_pose(path)
    except InputError:
        return None


def _matrix_or_identity(path: Path) -> FloatArray:
    if not path.is_file():
        return np.eye(4)
    try:
        values = np.array(read_text(path, "extrinsics file").split(), dtype=np.float64)
    except ValueError:
        raise InputError(f"The extrinsics file {path} holds other things than numbers; check it") from None
    T = rigid_or_none(values.reshape(4, 4)) if values.size == 16 else None
    if T is None:
        raise InputError(f"The extrinsics file {path} is no rigid 4 x 4 transform; check the file")
    return T


def _color_folder(folder: Path) -> Path | None:
    return next((folder / name for name in COLOR_FOLDERS if (folder / name).is_dir()), None)


def _logs(folder: Path) -> list[Path]:
    return [*sorted(folder.glob("*.log")), *sorted((folder / "scene").glob("*.log"))]
