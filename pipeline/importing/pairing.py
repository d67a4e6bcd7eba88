"""Pairs of colour and depth images in the folders of a recording."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TypeAlias

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.sequence import DEPTH_SUFFIXES
from pipeline.importing.tum import associate

COLOR_FOLDERS = ("color", "rgb", "image", "images")
COLOR_SUFFIXES = (".jpg", ".jpeg", ".png", ".ppm")
_Numbered: TypeAlias = dict[tuple[Fraction, ...], Path]
"""Images by the numbers in their names."""
_TIME = re.compile(r"\d+\.\d+")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
"""Frame numbers and times, such as TUM's 1305031102.175304."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A colour and a depth image with the same number in their names."""

    position: int
    """Position of its number among all numbers in both folders, from 0."""
    number: int
    """First number in the names; -1 without one."""
    color: Path
    depth: Path


def paired(colors: Path, depths: Path) -> tuple[list[Pair], tuple[str, ...]]:
    """Pair the images whose names have the same number, in order of the number; also notes on the others.

    Raises:
        InputError: no two images have the same number, or two images of a folder have.
    """
    by_number = [
        _by_number(folder, [path for path in visible(folder.iterdir()) if path.suffix.lower() in suffixes])
        for folder, suffixes in ((colors, COLOR_SUFFIXES), (depths, DEPTH_SUFFIXES))
    ]
    if all(_is_time(path) for own in by_number for path in own.values()):
        by_number[1] = _at_nearest_time(*by_number)
    every = sorted(by_number[0].keys() | by_number[1].keys())
    both = by_number[0].keys() & by_number[1].keys()
    counts = f"{len(by_number[0])} and {len(by_number[1])} images"
    missing = f"an image in {depths.name}/ with the number of an image in {colors.name}/"
    require(list(both), colors.parent, f"{missing} ({colors.name}/ and {depths.name}/ have {counts})")
    pairs = [
        Pair(position, int(number[0]) if number else -1, by_number[0][number], by_number[1][number])
        for position, number in enumerate(every)
        if number in both
    ]
    note = f"{colors.name}/ and {depths.name}/ have {counts}, of which {len(both)} pairs have the same number"
    return pairs, () if len(both) == len(every) else (note,)


def pose_indices(pairs: list[Pair], count: int) -> list[int]:
    """Return the index of each pair's pose in a list of poses that has one for each frame of a recording.

    If images were deleted, there are more poses than pairs; then the numbers in the names are used.

    Args:
        pairs: all pairs of the recording.
        count: number of poses.
    """
    if count == len(pairs):
        return list(range(count))
    if count > pairs[-1].position + 1 and pairs[0].number in (0, 1):
        return [pair.number - pairs[0].number for pair in pairs]
    return [pair.position for pair in pairs]


def depth_images(folder: Path, pattern: str) -> list[Path]:
    """Return the depth images of a folder that match a pattern, sorted by name."""
    return [path for path in visible(folder.glob(pattern)) if path.suffix.lower() in DEPTH_SUFFIXES]


def visible(paths: Iterable[Path]) -> list[Path]:
    """Return the sorted paths without hidden files, such as the ._0.png of ZIP files made on a Mac."""
    return sorted(path for path in paths if not path.name.startswith("."))


def _by_number(folder: Path, paths: list[Path]) -> _Numbered:
    """Index paths by the first number in the name (Redwood's frame number), or by all if it is not unique."""
    paths = [path for path in paths if _NUMBER.search(path.stem)] or paths
    numbers = [tuple(map(Fraction, _NUMBER.findall(path.stem))) for path in paths]
    first = [own[:1] for own in numbers]
    keys = first if len(set(first)) == len(paths) else numbers
    found: _Numbered = {}
    for key, path in sorted(zip(keys, paths, strict=True), key=lambda pair: pair[1]):
        if key in found:
            raise InputError(
                f"{folder} has several images of the same number, {found[key].name} and {path.name}; try to "
                "move one of each away"
            )
        found[key] = path
    return found


def _is_time(path: Path) -> bool:
    return _TIME.fullmatch(path.stem) is not None


def _at_nearest_time(colors: _Numbered, depths: _Numbered) -> _Numbered:
    """Return the depth images by the time of the colour image less than 20 ms away, or else by their own."""
    keys = sorted(colors), sorted(depths)
    near = associate(*(np.array([float(key[0]) for key in own]) for own in keys))
    renamed = {keys[1][j]: keys[0][i] for i, j in near}
    return {renamed.get(key, key): path for key, path in depths.items()}


def require(items: list, folder: Path, missing: str) -> None:
    """Raise an InputError with the text ``missing`` if ``items``, a recording's frames, is empty."""
    if not items:
        raise InputError(f"{folder} has no frame with colour and depth: it lacks {missing}; check the names")


def color_folder(folder: Path) -> Path | None:
    """Return the folder of the colour images of a recording; None if there is none."""
    return next((folder / name for name in COLOR_FOLDERS if (folder / name).is_dir()), None)
