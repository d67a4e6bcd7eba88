"""Import of sequences with associations.txt: ICL-NUIM, and TUM sequences prepared for ORB-SLAM.

Handa et al., "A Benchmark for RGB-D Visual Odometry, 3D Reconstruction and SLAM", ICRA 2014.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.cameras import camera_of
from pipeline.importing.handedness import mirrored_poses, y_points_up
from pipeline.importing.sequence import Candidate, Sequence, named_inside, posed
from pipeline.importing.tum import UNITS_PER_METRE, known_camera, poses_at, rows_in, seconds
from pipeline.io.images import NoDepthError, read_depth_values
from pipeline.types import CameraIntrinsics

_LISTS = ("assoc*.txt",)
_TRAJECTORIES = ("*.gt.freiburg", "groundtruth.txt", "*.freiburg")
_ICL = CameraIntrinsics.pinhole(481.2, 480.0, 319.5, 239.5, 640, 480)
"""Camera of ICL-NUIM. Its web page gives fy = -480, as y points up there; the images have y down."""
_ICL_NAMES = ("icl", "living", "office", "traj")


def is_associated(folder: Path) -> bool:
    """Return whether a folder contains associations.txt or a file with a similar name."""
    return _list_in(folder) is not None


def read_associated(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the pairs of colour and depth that a list names, with 5000 units in a metre.

    Raises:
        InputError: a line does not hold two times, each with a file; no files exist; or the camera has
            another size.
    """
    file = _list_in(folder)
    assert file is not None
    rows = rows_in(file, "list", 3, "a time in seconds and a file, twice")
    pairs = [
        (named_inside(folder, words[0], file.name), named_inside(folder, words[2], file.name))
        for _, words in rows
    ]
    there = [k for k, pair in enumerate(pairs) if all(path.is_file() for path in pair)]
    if not there:
        missing = next((path for pair in pairs for path in pair if not path.is_file()), file)
        raise InputError(
            f"{file} has no line whose two files exist, such as {missing}; try to unpack the images "
            "next to it"
        )
    depth = 0 if _is_depth(pairs[there[0]][0]) else 1
    times_s = np.array([_time_of_color(rows[k], depth) for k in there])
    trajectory, trajectory_notes = _trajectory(folder)
    poses = poses_at(trajectory, times_s) if trajectory else {}
    candidates, without, pose_notes = posed(
        [
            Candidate(pairs[k][1 - depth], pairs[k][depth], poses.get(n), float(times_s[n]))
            for n, k in enumerate(there)
        ],
        f"pose in {trajectory.name} at the time of an image"
        if trajectory
        else "groundtruth.txt or .gt.freiburg",
    )
    camera, notes = camera_of(folder, candidates[0].color, intrinsics, *_assumed_camera(folder))
    if len(there) < len(pairs):
        notes += (f"Files of {len(pairs) - len(there)} of {len(pairs)} lines of {file.name} do not exist",)
    notes += (*trajectory_notes, *pose_notes)
    completed = partial(_completed, file, trajectory)
    return Sequence(
        candidates, camera, UNITS_PER_METRE, without_poses=without, notes=notes, completed=completed
    )


def _completed(file: Path, trajectory: Path | None, sequence: Sequence) -> Sequence:
    """Return the sequence with a note on a scale that is assumed, and right-handed poses by its depth."""
    if not sequence.scale_stated:
        note = f"{file.name} is taken to mean 5000 units in a metre; --depth-scale names others"
        sequence = replace(sequence, notes=(*sequence.notes, note))
    if trajectory is None or trajectory.suffix != ".freiburg" or not y_points_up(sequence):
        return sequence
    return mirrored_poses(sequence, f"The y axis points up in {trajectory.name}: its poses were mirrored")


def _list_in(folder: Path) -> Path | None:
    return next((path for pattern in _LISTS for path in sorted(folder.glob(pattern))), None)


def _is_depth(path: Path) -> bool:
    """Return whether an image is a depth image, by one 16-bit channel."""
    try:
        read_depth_values(path)
    except NoDepthError:
        return True
    except InputError:
        return False
    return True


def _time_of_color(row: tuple[float, list[str]], depth: int) -> float:
    """Return the time of a line's colour image, seconds; it is the second image if ``depth`` is 0."""
    first_s, words = row
    if depth == 1:
        return first_s
    try:
        return seconds(float(words[1]))
    except ValueError:
        return first_s


def _trajectory(folder: Path) -> tuple[Path | None, tuple[str, ...]]:
    """Return the file of the poses, None without one, and a note if there are several."""
    files = list(dict.fromkeys(path for name in _TRAJECTORIES for path in sorted(folder.glob(name))))
    if len(files) < 2:
        return next(iter(files), None), ()
    return files[0], (
        f"Of {', '.join(path.name for path in files[:4])}, the poses of {files[0].name} were read",
    )


def _assumed_camera(folder: Path) -> tuple[CameraIntrinsics, str]:
    name = folder.resolve().name.lower()
    if next(folder.glob("*.gt.freiburg"), None) or name.startswith(_ICL_NAMES):
        return _ICL, "those of ICL-NUIM (481.2, 480)"
    return known_camera(folder)
