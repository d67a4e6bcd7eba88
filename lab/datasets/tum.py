"""TUM RGB-D sequences: pictures and depth with their own clocks.

Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.pair import Frame, Pair
from packetmesh.errors import InputError
from packetmesh.files import read_text
from pipeline.io.images import read_color, read_depth
from pipeline.io.intrinsics import read_intrinsics
from pipeline.types import CameraIntrinsics, FloatArray

UNITS_PER_METRE = 5000.0
LARGEST_GAP_S = 0.02
WIDTH_PX, HEIGHT_PX = 640, 480
_DEFAULT = ((525.0, 525.0, 319.5, 239.5), (0.0, 0.0, 0.0, 0.0, 0.0))
_CALIBRATED = {
    "1": ((517.3, 516.5, 318.6, 255.3), (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),
    "2": ((520.9, 521.0, 325.1, 249.7), (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)),
    "3": ((535.4, 539.2, 320.1, 247.6), (0.0, 0.0, 0.0, 0.0, 0.0)),
}
"""The benchmark's calibration of its three cameras: fx fy cx cy in pixels, and the distortion."""


def find(root: Path) -> list[Frame]:
    """The frames of the sequence ``root``, or of all sequences below it.

    Raises:
        InputError: a list with a line that is no time and file.
    """
    frames = []
    for listing in sorted(root.rglob("rgb.txt")):
        folder = listing.parent
        if not (folder / "depth.txt").is_file():
            continue
        (rgb_s, pictures), (depth_s, depths) = _listed(listing), _listed(folder / "depth.txt")
        for i, j in associate(rgb_s, depth_s):
            name = f"{folder.resolve().name}/{rgb_s[i]:.6f}"
            frames.append(Frame(name, partial(_load, name, folder, pictures[i], depths[j])))
    return frames


def associate(first_s: FloatArray, second_s: FloatArray) -> list[tuple[int, int]]:
    """Indices of times less than 20 ms apart, nearest pairs first, each time used once (associate.py).

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


def _listed(file: Path) -> tuple[FloatArray, list[str]]:
    """Times in ascending order and the files that belong to them."""
    rows = []
    for line in read_text(file, "list of a TUM sequence").splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        words = line.replace(",", " ").split()
        try:
            rows.append((float(words[0]), words[1]))
        except (ValueError, IndexError):
            raise InputError(
                f"The list {file} has the line '{line[:80]}'; try lines with a time in seconds and a file"
            ) from None
    rows.sort()
    return np.array([time_s for time_s, _ in rows]), [path for _, path in rows]


def _load(name: str, folder: Path, picture: str, depth: str) -> Pair:
    rgb, z_m = read_color(folder / picture), read_depth(folder / depth, UNITS_PER_METRE).z_m
    return Pair(name, rgb, z_m, _intrinsics(folder, rgb.shape))


def _intrinsics(folder: Path, shape: tuple[int, ...]) -> CameraIntrinsics | None:
    """Those of ``intrinsics.json`` in the sequence, else of the camera in its name; None at another size."""
    if (folder / "intrinsics.json").is_file():
        return read_intrinsics(folder / "intrinsics.json")
    if shape[:2] != (HEIGHT_PX, WIDTH_PX):
        return None
    camera = re.search(r"(?:freiburg|fr)([123])", folder.resolve().name)
    numbers, distortion = _CALIBRATED[camera[1]] if camera else _DEFAULT
    pinhole = CameraIntrinsics.pinhole(*numbers, WIDTH_PX, HEIGHT_PX)
    return replace(pinhole, distortion=np.array(distortion))
