"""NYU Depth v2: the labelled file, and the folders of pictures that people make of it.

Silberman et al., "Indoor Segmentation and Support Inference from RGBD Images", ECCV 2012.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from lab.datasets.pair import Frame, Pair, Part, window
from packetmesh.errors import InputError
from pipeline.io.images import read_color, read_depth
from pipeline.types import BoolArray, CameraIntrinsics

LABELLED = "nyu_depth_v2_labeled.mat"
WIDTH_PX, HEIGHT_PX = 640, 480
CAMERA = CameraIntrinsics.pinhole(518.85790, 519.46961, 325.58245, 253.73617, WIDTH_PX, HEIGHT_PX)
"""Of the colour camera, from the set's toolbox (camera_params.m); its labelled pictures are undistorted."""
CROP = np.s_[45:471, 41:601]
"""Rows and columns that evaluations compare since Eigen et al., NIPS 2014: without the white border."""
PARTNERS = [(r"rgb_(\d+)", r"sync_depth_\1"), (r"(.+)_colors", r"\1_depth"), (r"(.+)", r"\1")]
"""Stems of pictures and of the depth that belongs to them, the first that fits."""
_CONTINUED = re.compile(r"(?<=\d)[a-z](?=(_out)?$)")


def find(root: Path) -> list[Frame]:
    """The frames of the labelled .mat file at or in ``root``, else of a tree of pictures.

    A ``splits.mat`` beside them marks the standard 795 training and 654 test pictures.

    Raises:
        InputError: h5py is missing, or a .mat file is damaged.
    """
    mat = root if root.is_file() else root / LABELLED
    parts = _parts(mat.parent / "splits.mat")
    if mat.is_file():
        return [
            Frame(name, partial(_from_mat, mat, row, name), parts.get(row + 1)) for row, name in _names(mat)
        ]
    frames = []
    for picture in sorted(path for ending in ("jpg", "png") for path in root.rglob(f"*.{ending}")):
        depth = _partner(picture)
        if depth is not None:
            name = f"{_scene(picture.parent.relative_to(root).as_posix(), root)}/{picture.stem}"
            number = int(picture.stem) if picture.parent == root and picture.stem.isdecimal() else 0
            frames.append(Frame(name, partial(_from_files, picture, depth, name), parts.get(number)))
    return frames


def _parts(file: Path) -> dict[int, Part]:
    """Part of each picture of the labelled set, counted from one; empty without the file."""
    if not file.is_file():
        return {}
    try:
        splits = loadmat(file)
        numbers: dict[Part, Any] = {"train": splits["trainNdxs"], "test": splits["testNdxs"]}
    except (MatReadError, KeyError, ValueError, OSError, NotImplementedError):
        raise InputError(
            f"The split {file} has no trainNdxs and testNdxs; try the splits.mat of NYU Depth v2"
        ) from None
    return {int(number): part for part, rows in numbers.items() for number in np.ravel(rows)}


def _scene(folder: str, root: Path) -> str:
    """The place: letters after its number (basement_0001a) only continue the recording."""
    return _CONTINUED.sub("", root.resolve().name if folder == "." else folder)


def _partner(picture: Path) -> Path | None:
    """The depth file of a picture; None if it has none, or is depth itself."""
    for of_picture, of_depth in PARTNERS:
        match = re.fullmatch(of_picture, picture.stem)
        if match:
            depth = picture.with_name(match.expand(of_depth) + ".png")
            return depth if depth != picture and depth.is_file() else None
    return None


def _from_files(picture: Path, depth: Path, name: str) -> Pair:
    return _pair(name, read_color(picture), read_depth(depth).z_m)


def _from_mat(mat: Path, row: int, name: str) -> Pair:
    """Raw depth where the file has it: the other was in-painted, which is no measurement."""
    try:
        with _h5py().File(mat, "r") as file:
            z_m = np.transpose(file["rawDepths" if "rawDepths" in file else "depths"][row]).astype(np.float32)
            rgb = np.transpose(file["images"][row], (2, 1, 0))
    except OSError:
        raise _damaged(mat) from None
    return _pair(name, np.ascontiguousarray(rgb), np.where(z_m > 0, z_m, np.float32(np.nan)))


def _pair(name: str, rgb: np.ndarray, z_m: np.ndarray) -> Pair:
    """Camera and crop hold for the set's own size only."""
    if rgb.shape[:2] != (HEIGHT_PX, WIDTH_PX):
        return Pair(name, rgb, z_m)
    return Pair(name, rgb, z_m, CAMERA, judged(rgb.shape))


def judged(shape: tuple[int, ...]) -> BoolArray:
    """(480, 640) True inside the crop of Eigen et al."""
    return window(shape, *CROP)


def _names(mat: Path) -> list[tuple[int, str]]:
    """Row and name of every picture in the file; the name has the scene where the file tells it."""
    try:
        with _h5py().File(mat, "r") as file:
            count = len(file["images"])
            if "rawDepths" not in file and "depths" not in file:
                raise KeyError("depths")
            scenes = (
                [_text(file, reference) for reference in np.ravel(file["scenes"])]
                if "scenes" in file
                else [""] * count
            )
    except (OSError, KeyError):
        raise _damaged(mat) from None
    return [(row, f"{_CONTINUED.sub('', scenes[row]) or mat.stem}/{row + 1:04d}") for row in range(count)]


def _damaged(mat: Path) -> InputError:
    return InputError(
        f"The file {mat} is not the labelled NYU Depth v2 or is damaged; try to download it again"
    )


def _text(file: Any, reference: Any) -> str:
    """Matlab's string behind a reference: one 16-bit character a row."""
    return "".join(map(chr, np.ravel(file[reference])))


def _h5py() -> ModuleType:
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"Reading {LABELLED} needs the package h5py, which is not installed; try pip install h5py"
        ) from None
    return h5py
