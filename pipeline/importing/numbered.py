"""Import of recordings with numbered files: 7-Scenes, Redwood and Open3D, ScanNet, SUN RGB-D."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_TEXT_BYTES, read_text
from pipeline.importing.cameras import PRIMESENSE, camera_of
from pipeline.importing.depth_views import first_depth_values
from pipeline.importing.found_poses import FoundPoses, found_poses, poses_in_files, scanned_transform
from pipeline.importing.pairing import (
    COLOR_SUFFIXES,
    color_folder,
    depth_images,
    paired,
    pose_indices,
    require,
    visible,
)
from pipeline.importing.sequence import Candidate, Sequence, posed
from pipeline.importing.stored import read_color_of
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.poses import rounding_note
from pipeline.kernels.geometry import inverse
from pipeline.types import CameraIntrinsics, FloatArray

_SEVEN_SCENES = CameraIntrinsics.pinhole(585.0, 585.0, 320.0, 240.0, 640, 480)


def is_seven_scenes(folder: Path) -> bool:
    """Return whether a folder contains frame-000000.color.png or similar files."""
    return next(folder.glob("frame-*.color.*"), None) is not None


def read_seven_scenes(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read frames of 7-Scenes (Shotton et al., CVPR 2013), 3DMatch or BundleFusion; depth in millimetres.

    Raises:
        InputError: no frame has colour and depth, or the images have another size than the camera.
    """
    found = []
    colors = sorted(folder.glob("frame-*.color.*"))
    for color in colors:
        stem = color.name.split(".")[0]
        depth = next(iter(depth_images(folder, f"{stem}.depth.*")), None)
        if depth is not None:
            found.append((color, depth, folder / f"{stem}.pose.txt"))
    stem = colors[0].name.split(".")[0]
    require(found, folder, f"{stem}.depth.png next to {colors[0].name}")
    candidates, without, notes = _with_poses(found, found[0][2].name)
    default = _SEVEN_SCENES, "those of 7-Scenes; its depth is registered only roughly"
    camera, assumed = camera_of(folder, candidates[0].color, intrinsics, *default)
    return Sequence(candidates, camera, without_poses=without, notes=(*assumed, *notes))


def is_scannet(folder: Path) -> bool:
    """Return whether a folder contains color/, depth/, pose/ and intrinsic/."""
    return all((folder / name).is_dir() for name in ("color", "depth", "pose", "intrinsic"))


def read_scannet(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read a ScanNet scene as exported by its SensReader (Dai et al., CVPR 2017); depth in millimetres."""
    pairs, unpaired = paired(folder / "color", folder / "depth")
    found = [(pair.color, pair.depth, folder / "pose" / f"{pair.color.stem}.txt") for pair in pairs]
    candidates, without, lost = _with_poses(found, f"pose/{found[0][2].name}")
    notes = (*unpaired, *lost)
    first, intrinsic = candidates[0], folder / "intrinsic"
    height_px, width_px = read_color_of(first.color).shape[:2]
    if intrinsics is None:
        camera = read_intrinsics(intrinsic / "intrinsic_color.txt", (width_px, height_px))
    else:
        camera, _ = camera_of(folder, first.color, intrinsics, None, "")
    depth_height_px, depth_width_px = first_depth_values(folder, (one.depth for one in candidates)).shape
    if (depth_height_px, depth_width_px) == (height_px, width_px):
        return Sequence(candidates, camera, without_poses=without, notes=notes)
    depth_camera = read_intrinsics(intrinsic / "intrinsic_depth.txt", (depth_width_px, depth_height_px))
    extrinsics = [intrinsic / f"extrinsic_{of}.txt" for of in FRAMES]
    (T_body_color, color_off), (T_body_depth, depth_off) = map(_transform_or_identity, extrinsics)
    notes += rounding_note("A rotation of the extrinsics", max(color_off, depth_off))
    missing = " and ".join(file.name for file in extrinsics if not file.is_file())
    if missing:
        notes += (f"No {missing}: taken as the identity, so that depth may be shifted against the colour",)
    T_color_depth = inverse(T_body_color) @ T_body_depth
    return Sequence(
        candidates,
        camera,
        depth_camera=depth_camera,
        T_color_depth=T_color_depth,
        without_poses=without,
        notes=notes,
    )


FRAMES = ("color", "depth")


def is_open3d(folder: Path) -> bool:
    """Return whether a folder contains depth/ and color/, rgb/ or image/."""
    return (folder / "depth").is_dir() and color_folder(folder) is not None


def read_open3d(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read Redwood (Choi et al., CVPR 2015) or Open3D recordings; depth in mm, poses in a .log file."""
    colors = color_folder(folder)
    assert colors is not None
    pairs, unpaired = paired(colors, folder / "depth")
    poses, missing, trajectory = _trajectory(folder)
    indices = pose_indices(pairs, poses.count)
    found = [
        Candidate(pair.color, pair.depth, poses.T_world_camera.get(index))
        for index, pair in zip(indices, pairs, strict=True)
    ]
    candidates, without, notes = posed(found, missing, poses)
    default = PRIMESENSE, "a PrimeSense camera's from the factory"
    camera, assumed = camera_of(folder, candidates[0].color, intrinsics, *default)
    notes = (*unpaired, *assumed, *trajectory, *notes)
    return Sequence(candidates, camera, without_poses=without, notes=notes)


def _trajectory(folder: Path) -> tuple[FoundPoses, str, tuple[str, ...]]:
    """Return the poses of a recording's trajectory, a name for them if they are missing, and notes."""
    logs = [log for where in (folder, folder / "scene") for log in sorted(where.glob("*.log"))]
    named = [log for log in logs if "traj" in log.name]
    if not named:
        others = f" (not named so: {', '.join(log.name for log in logs[:4])})" if logs else ""
        return found_poses({}), f"trajectory .log{others}", ()
    notes = () if len(named) == 1 else (f"Of {len(named)} trajectories {named[0].name} was read",)
    poses = found_poses(read_trajectory_log(named[0]))
    return poses, f"pose in {named[0].name} with the number of an image", notes


def read_trajectory_log(file: Path) -> dict[int, FloatArray]:
    """Read (4, 4) matrices by frame number from Redwood's format: a line of three integers, then four rows.

    They are returned as they are in the file; ``found_poses`` makes poses of them.

    Raises:
        InputError: the file has another format.
    """
    words = read_text(file, "trajectory", 100 * MAX_TEXT_BYTES).split()
    try:
        rows = np.array(words, dtype=np.float64).reshape(-1, 19)
    except ValueError:
        raise InputError(
            f"The trajectory {file} is not in Redwood's format; try three integers and 4 x 4 numbers a frame"
        ) from None
    return {int(row[0]): row[3:].reshape(4, 4) for row in rows if np.isfinite(row[0])}


def is_sunrgbd(folder: Path) -> bool:
    """Return whether a folder contains image/ with one file, depth_bfx/ or depth/, and intrinsics.txt."""
    depth = (folder / "depth_bfx").is_dir() or (folder / "depth").is_dir()
    image = (folder / "image").is_dir() and len(visible((folder / "image").iterdir())) == 1
    return image and depth and (folder / "intrinsics.txt").is_file()


def read_sunrgbd(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the frame of a SUN RGB-D folder (Song et al., CVPR 2015), with merged depth if available."""
    colors = [path for path in visible((folder / "image").iterdir()) if path.suffix.lower() in COLOR_SUFFIXES]
    depths = [path for name in ("depth_bfx", "depth") for path in depth_images(folder / name, "*")]
    require(colors, folder, "an image in image/")
    require(depths, folder, "an image in depth_bfx/ or depth/")
    camera, notes = camera_of(folder, colors[0], intrinsics, None, "")
    return Sequence((Candidate(colors[0], depths[0]),), camera, rotated_bits=True, notes=notes)


def _with_poses(
    frames: list[tuple[Path, Path, Path]], what: str
) -> tuple[tuple[Candidate, ...], str, tuple[str, ...]]:
    """Return the candidates of colour, depth and pose files as ``posed`` does."""
    poses = poses_in_files(pose for _, _, pose in frames)
    found = [Candidate(color, depth, poses.T_world_camera.get(pose)) for color, depth, pose in frames]
    return posed(found, what, poses)


def _transform_or_identity(path: Path) -> tuple[FloatArray, float]:
    return scanned_transform(path) if path.is_file() else (np.eye(4), 0.0)
