"""Import of TUM RGB-D sequences: colour, depth and poses, each with separate times.

Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import MAX_TEXT_BYTES, read_bytes, text_in
from pipeline.importing.cameras import PRIMESENSE, camera_of
from pipeline.importing.sequence import Candidate, Sequence, existing, named_inside, posed
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

UNITS_PER_METRE = 5000.0
LARGEST_GAP_S = 0.02
MOST_COMPARED = 2000
"""First images of each list whose times are compared for a difference of their clocks."""
LARGEST_TIME_S = 1e11
_LENGTH_WITHIN = 0.05
"""Largest departure of a quaternion's length from 1."""
_MATRICES = (12, 16)
"""Numbers of a 3 x 4 and a 4 x 4 matrix."""
_W_FIRST = re.compile(r"^.*\bq\w*w\b.*\bq\w*x\b", re.MULTILINE)
"""A heading of EuRoC's order, in which the quaternion's scalar comes first."""
_CAMERAS = {
    "1": ((517.3, 516.5, 318.6, 255.3), (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),
    "2": ((520.9, 521.0, 325.1, 249.7), (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)),
    "3": ((535.4, 539.2, 320.1, 247.6), (0.0, 0.0, 0.0, 0.0, 0.0)),
}
"""Colour cameras of freiburg1 to 3, from the benchmark's web page."""


def is_tum(folder: Path) -> bool:
    """Return whether a folder contains rgb.txt and depth.txt."""
    return (folder / "rgb.txt").is_file() and (folder / "depth.txt").is_file()


def read_tum(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the pairs of colour and depth less than 20 ms apart, with poses at most 20 ms away, if any.

    Raises:
        InputError: a list has an invalid line, no two images are of one moment, or the camera has another
            size.
    """
    (rgb_s, pictures), (depth_s, depths) = listed(folder / "rgb.txt"), listed(folder / "depth.txt")
    pairs = associate(rgb_s, depth_s)
    if not pairs:
        raise InputError(_no_pair(folder, rgb_s, depth_s))
    truth = folder / "groundtruth.txt"
    poses = poses_at(truth, rgb_s)
    there, missing = existing(
        [
            Candidate(
                named_inside(folder, pictures[i], "rgb.txt"),
                named_inside(folder, depths[j], "depth.txt"),
                poses.get(i),
                float(rgb_s[i]),
            )
            for i, j in pairs
        ],
        f"{folder / 'rgb.txt'} or depth.txt",
        "try to unpack the images next to it",
    )
    candidates, without, notes = posed(
        there,
        f"pose in {truth.name} at the time of an image" if truth.is_file() else truth.name,
    )
    camera, assumed = camera_of(folder, candidates[0].color, intrinsics, *known_camera(folder))
    notes = (*_without_partner(len(pairs), len(pictures), len(depths)), *missing, *assumed, *notes)
    return Sequence(candidates, camera, UNITS_PER_METRE, without_poses=without, notes=notes)


def _without_partner(pairs: int, pictures: int, depths: int) -> tuple[str, ...]:
    """Return a sentence on the images of the two lists that are in no pair, if there are any."""
    if pairs == pictures == depths:
        return ()
    return (
        f"{pairs} pairs: {pictures - pairs} of {pictures} images of rgb.txt and {depths - pairs} of {depths} "
        f"of depth.txt have no partner less than {1000 * LARGEST_GAP_S:g} ms away and were left out",
    )


def _no_pair(folder: Path, rgb_s: FloatArray, depth_s: FloatArray) -> str:
    """Return the sentence on lists of which no two images are of one moment.

    It names the difference of their clocks if with that half of the colour images would have a partner.
    """
    told = (
        f"Of the {len(rgb_s)} images in {folder / 'rgb.txt'} and the {len(depth_s)} in depth.txt no two are "
        f"less than {1000 * LARGEST_GAP_S:g} ms apart"
    )
    if not len(rgb_s) or not len(depth_s):
        return f"{told}; check that the lists are whole"
    offset_s = round(_commonest_offset_s(rgb_s, depth_s), 3)
    pairs = len(associate(rgb_s, depth_s - offset_s))
    if 2 * pairs < len(rgb_s):
        return f"{told}; check that their clocks agree, and that the times are in seconds"
    change = "subtract this from" if offset_s > 0.0 else "add this to"
    return (
        f"{told}, but {pairs} would be pairs if the depth images were not {abs(offset_s):.3f} s "
        f"{'later' if offset_s > 0.0 else 'earlier'}; if the clocks differ, {change} the times in depth.txt"
    )


def _commonest_offset_s(rgb_s: FloatArray, depth_s: FloatArray) -> float:
    """Return the difference of a depth and a colour image's times that most pairs of images have."""
    offsets_s = np.sort((depth_s[:MOST_COMPARED] - rgb_s[:MOST_COMPARED, None]).ravel())
    alike = np.searchsorted(offsets_s, offsets_s + LARGEST_GAP_S, side="right") - np.arange(len(offsets_s))
    first = int(alike.argmax())
    return float(np.median(offsets_s[first : first + alike[first]]))


def associate(first_s: FloatArray, second_s: FloatArray) -> list[tuple[int, int]]:
    """Match times less than 20 ms apart, closest pairs first, each time once (associate.py); returns indices.

    Args:
        first_s: (N,) times, seconds, ascending.
        second_s: (M,) times, seconds, ascending.
    """
    first = np.searchsorted(second_s, first_s - LARGEST_GAP_S, side="right")
    last = np.searchsorted(second_s, first_s + LARGEST_GAP_S, side="left")
    near = [
        (abs(first_s[i] - second_s[j]), i, j) for i in range(len(first_s)) for j in range(first[i], last[i])
    ]
    of_first: dict[int, int] = {}
    taken = set()
    for _, i, j in sorted(near):
        if i not in of_first and j not in taken:
            of_first[i] = j
            taken.add(j)
    return sorted(of_first.items())


def listed(file: Path) -> tuple[FloatArray, list[str]]:
    """Read the times of a list, ascending, and the file of each.

    Raises:
        InputError: a line is not a time and a file.
    """
    rows = rows_in(file, "list of a TUM sequence", 1, "a time in seconds and a file")
    return np.array([time_s for time_s, _ in rows]), [words[0] for _, words in rows]


def rows_in(file: Path, what: str, least: int, form: str) -> list[tuple[float, list[str]]]:
    """Return the time in seconds and the other words of each line, sorted by time.

    Times in milliseconds, microseconds or nanoseconds since 1970 are recognised by their size.

    Args:
        file: the text file; empty lines and lines that begin with # are ignored.
        what: name of the file for errors.
        least: least number of words after the time.
        form: form of a line, for errors.

    Raises:
        InputError: the file cannot be read, or a line has no finite time or too few words.
    """
    rows = []
    for line in _text(file, what).splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        words = line.replace(",", " ").split()
        try:
            time = float(words[0])
        except ValueError:
            time = np.nan
        if not np.isfinite(time) or len(words) <= least:
            raise InputError(f"The {what} {file} has the line '{line[:80]}'; try lines with {form}")
        rows.append((seconds(time), words[1:]))
    rows.sort(key=lambda row: row[0])
    return rows


def seconds(time: float) -> float:
    """Return a time in seconds; above ``LARGEST_TIME_S`` it counts milli-, micro- or nanoseconds."""
    while abs(time) > LARGEST_TIME_S:
        time /= 1000.0
    return time


def _text(file: Path, what: str) -> str:
    return text_in(read_bytes(file, 100 * MAX_TEXT_BYTES, what), "replace")


def poses_at(file: Path, wanted_s: FloatArray) -> dict[int, FloatArray]:
    """Return (4, 4) T_world_camera, metres, by the index of each of (N,) times with a pose within 20 ms.

    The result is empty if the file does not exist.

    Raises:
        InputError: the lines are not a time, a position and a quaternion.
    """
    if not file.is_file():
        return {}
    form = "a time, tx ty tz in metres and a quaternion qx qy qz qw"
    rows = rows_in(file, "trajectory", 7, form)
    times_s = np.array([time_s for time_s, _ in rows])
    try:
        values = np.array([words[:7] for _, words in rows], dtype=np.float64).reshape(-1, 7)
    except ValueError:
        raise InputError(f"The trajectory {file} holds words where numbers belong; check the file") from None
    lengths = np.linalg.norm(values[:, 3:], axis=1)
    wrong = (lengths > 0.5) & (np.abs(lengths - 1.0) > _LENGTH_WITHIN)
    if wrong.any() or any(len(words) in _MATRICES for _, words in rows):
        row = " ".join(rows[int(wrong.argmax())][1])
        raise InputError(f"The trajectory {file} has the pose '{row[:80]}', no quaternion; try {form}")
    if _W_FIRST.search(_text(file, "trajectory")):
        values[:, 3:] = np.roll(values[:, 3:], -1, axis=1)
    found = {}
    for index, time_s in enumerate(wanted_s):
        nearest = int(np.abs(times_s - time_s).argmin()) if len(times_s) else 0
        if len(times_s) and abs(times_s[nearest] - time_s) <= LARGEST_GAP_S:
            position_m, quaternion = values[nearest, :3], values[nearest, 3:]
            if np.isfinite(values[nearest]).all() and np.linalg.norm(quaternion) > 0.5:
                found[index] = rigid(Rotation.from_quat(quaternion).as_matrix(), position_m)
    return found


def known_camera(folder: Path) -> tuple[CameraIntrinsics, str]:
    """Return the camera of a TUM sequence by its folder's name, else a Kinect's, and its description."""
    series = re.search(r"(?:freiburg|fr)([123])(?!\d)", folder.resolve().name)
    if series is None:
        return PRIMESENSE, "a Kinect's from the factory"
    values, distortion = _CAMERAS[series[1]]
    pinhole = CameraIntrinsics.pinhole(*values, 640, 480)
    camera = CameraIntrinsics(pinhole.matrix, np.array(distortion), 640, 480)
    return camera, f"those the benchmark gives for freiburg{series[1]}"
