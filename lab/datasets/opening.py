"""Access to all data sets by kind and folder."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from difflib import get_close_matches
from pathlib import Path

from lab.datasets import folder, kitti, middlebury, nyu, sr300, sunrgbd, tum
from lab.datasets.pair import Load, Pair
from packetmesh.errors import InputError

SETS: dict[str, Callable[[Path], list[Load]]] = {
    "nyu": nyu.find,
    "kitti": kitti.find,
    "sunrgbd": sunrgbd.find,
    "tum": tum.find,
    "folder": folder.find,
    "middlebury": middlebury.find,
    "sr300": sr300.find,
}
"""For each kind of set, the function that finds its pairs in a folder."""
EXPECTED = {
    "nyu": "nyu_depth_v2_labeled.mat, or pictures *.jpg next to 16-bit depth *.png",
    "kitti": "DATE/DATE_drive_NUMBER_sync/image_02/data with ground-truth PNG or velodyne files",
    "sunrgbd": "folders with image/ and depth_bfx/ or depth/",
    "tum": "sequences with rgb.txt and depth.txt, less than 20 ms apart",
    "folder": "color/NAME and depth/NAME.png, NAME_rgb and NAME_depth.png, or color.png and depth.png",
    "middlebury": "im0.png, disp0.pfm and calib.txt, or motorcycle_left.png and motorcycle_disp.npz",
    "sr300": "depth_M_color.txt next to chateau.xml, and castel/image_0000.pgm with its depth_image_0000.bin",
}
"""The files of each kind of set, for the error message if they are missing."""


def open_set(spec: str) -> Iterator[Pair]:
    """Read the pairs of a set one by one; only the test pairs, if the folder lists them.

    NYU Depth v2 lists them in ``splits.mat``, KITTI in ``test_files.txt``.

    Args:
        spec: ``kind=path`` with a kind of ``SETS`` and the set's folder (or NYU's .mat file).

    Raises:
        InputError: unknown kind or folder, no pair there, or, while reading, an unusable file.
    """
    kind, _, path = spec.partition("=")
    kind = kind.strip().lower()
    if kind not in SETS:
        near = get_close_matches(kind, SETS, n=1, cutoff=0.4)
        hint = f"did you mean {near[0]}?" if near else f"try one of {', '.join(SETS)}."
        raise InputError(f"There is no kind of set '{kind}' for KIND=FOLDER; {hint}")
    if not path.strip():
        raise InputError(f"The set {spec} names no folder; try {kind}=/path/to/the/set")
    root = Path(path.strip()).expanduser()
    if not root.exists():
        raise InputError(f"The folder {root} of the set {kind} does not exist; check the path")
    pairs = SETS[kind](root)
    if not pairs:
        raise InputError(
            f"There is no pair of picture and depth in {root}; a {kind} set has {EXPECTED[kind]}"
        )
    return (load() for load in pairs)
