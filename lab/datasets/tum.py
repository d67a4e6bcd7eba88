"""TUM RGB-D sequences: pictures and depth with their own clocks.

Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.pair import Load, load_pair
from packetmesh.errors import InputError
from packetmesh.files import read_text
from pipeline.types import FloatArray

UNITS_PER_METRE = 5000.0
LARGEST_GAP_S = 0.02


def find(root: Path) -> list[Load]:
    """The frames of the sequence ``root``, or of all sequences below it.

    Raises:
        InputError: a list with a line that is no time and file.
    """
    pairs: list[Load] = []
    for listing in sorted(root.rglob("rgb.txt")):
        folder = listing.parent
        if (folder / "depth.txt").is_file():
            (rgb_s, pictures), (depth_s, depths) = _listed(listing), _listed(folder / "depth.txt")
            for i, j in associate(rgb_s, depth_s):
                files = folder / pictures[i], folder / depths[j]
                pairs.append(partial(load_pair, *files, UNITS_PER_METRE))
    return pairs


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
