"""NYU Depth v2: the labelled file, or folders of images that were made from it.

Silberman et al., "Indoor Segmentation and Support Inference from RGBD Images", ECCV 2012.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from lab.datasets.pair import Load, Pair, load_pair, window
from packetmesh.errors import InputError
from pipeline.types import BoolArray

LABELLED = "nyu_depth_v2_labeled.mat"
WIDTH_PX, HEIGHT_PX = 640, 480
CROP = np.s_[45:471, 41:601]
"""Rows and columns that evaluations use since Eigen et al., NIPS 2014; they exclude the white border."""
PARTNERS = [(r"rgb_(\d+)", r"sync_depth_\1"), (r"(.+)_colors", r"\1_depth"), (r"(.+)", r"\1")]
"""Patterns of image names, each with the name of the depth file; the first pattern that matches counts."""


def find(root: Path) -> list[Load]:
    """Return the frames of the labelled .mat file at or in ``root``, or of image folders below it.

    With a ``splits.mat`` in the same folder, only the standard 654 test images of the labelled 1449 are
    returned.

    Raises:
        InputError: h5py is missing, or a .mat file is damaged.
    """
    mat = root if root.is_file() else root / LABELLED
    tested = _tested(mat.parent / "splits.mat")
    if mat.is_file():
        return [
            partial(_from_mat, mat, row) for row in range(_count(mat)) if tested is None or row + 1 in tested
        ]
    pairs: list[Load] = []
    for picture in sorted(path for ending in ("jpg", "png") for path in root.rglob(f"*.{ending}")):
        depth = _partner(picture)
        numbered = picture.parent == root and picture.stem.isdecimal()
        if depth is not None and (tested is None or not numbered or int(picture.stem) in tested):
            pairs.append(partial(_from_files, picture, depth))
    return pairs


def _tested(file: Path) -> set[int] | None:
    """Return the numbers of the labelled test images, from one; None without the file."""
    if not file.is_file():
        return None
    try:
        return set(map(int, np.ravel(loadmat(file)["testNdxs"])))
    except (MatReadError, KeyError, ValueError, OSError, NotImplementedError):
        raise InputError(f"The split {file} has no testNdxs; try the splits.mat of NYU Depth v2") from None


def _partner(picture: Path) -> Path | None:
    """Return the depth file of an image; None if it has none, or is depth itself."""
    for of_picture, of_depth in PARTNERS:
        match = re.fullmatch(of_picture, picture.stem)
        if match:
            depth = picture.with_name(match.expand(of_depth) + ".png")
            return depth if depth != picture and depth.is_file() else None
    return None


def _from_files(picture: Path, depth: Path) -> Pair:
    pair = load_pair(picture, depth)
    return replace(pair, judged=judged(pair.rgb.shape))


def _from_mat(mat: Path, row: int) -> Pair:
    """Return a pair with raw depth if the file has it, because the other depth is in-painted."""
    try:
        with _h5py().File(mat, "r") as file:
            z_m = np.transpose(file["rawDepths" if "rawDepths" in file else "depths"][row]).astype(np.float32)
            rgb = np.ascontiguousarray(np.transpose(file["images"][row], (2, 1, 0)))
    except OSError:
        raise _damaged(mat) from None
    truth_m = np.where(z_m > 0, z_m, np.float32(np.nan))
    return Pair(mat / f"{row + 1:04d}", rgb, truth_m, judged(rgb.shape))


def judged(shape: tuple[int, ...]) -> BoolArray | None:
    """Return (480, 640) True inside the crop of Eigen et al.; None for images of another size."""
    return window(shape, *CROP) if shape[:2] == (HEIGHT_PX, WIDTH_PX) else None


def _count(mat: Path) -> int:
    """Return the number of images in the file."""
    try:
        with _h5py().File(mat, "r") as file:
            if "rawDepths" not in file and "depths" not in file:
                raise _damaged(mat)
            return len(file["images"])
    except (OSError, KeyError):
        raise _damaged(mat) from None


def _damaged(mat: Path) -> InputError:
    return InputError(
        f"The file {mat} is not the labelled NYU Depth v2 or is damaged; try to download it again"
    )


def _h5py() -> ModuleType:
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"Reading {LABELLED} needs the package h5py, which is not installed; try pip install h5py"
        ) from None
    return h5py
