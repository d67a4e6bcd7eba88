"""Pairs of colour and depth images in the folders of a recording."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.importing.sequence import DEPTH_SUFFIXES

MOST_CANDIDATES = 600
"""Largest number of frames that are considered; longer recordings are subsampled."""
COLOR_FOLDERS = ("color", "rgb", "image", "images")
COLOR_SUFFIXES = (".jpg", ".jpeg", ".png", ".ppm")


def paired(colors: Path, depths: Path) -> list[tuple[Path, Path]]:
    """Pair the images whose names have the same number, in order of the number."""
    by_number = [
        _by_number(path for path in folder.iterdir() if path.suffix.lower() in suffixes)
        for folder, suffixes in ((colors, COLOR_SUFFIXES), (depths, DEPTH_SUFFIXES))
    ]
    both = sorted(by_number[0].keys() & by_number[1].keys())
    counts = f"{len(by_number[0])} and {len(by_number[1])} images"
    missing = f"an image in {depths.name}/ with the number of an image in {colors.name}/"
    require(both, colors.parent, f"{missing} ({colors.name}/ and {depths.name}/ have {counts})")
    return [(by_number[0][number], by_number[1][number]) for number in both]


def depth_images(folder: Path, pattern: str) -> list[Path]:
    """List the depth images, sorted by name."""
    return [path for path in sorted(folder.glob(pattern)) if path.suffix.lower() in DEPTH_SUFFIXES]


def _by_number(paths: Iterable[Path]) -> dict[tuple[int, ...], Path]:
    """Index paths by the first number in the name (Redwood's frame number), or by all if it is not unique."""
    numbered = [(tuple(map(int, re.findall(r"\d+", path.stem))), path) for path in paths]
    by_first = {numbers[:1]: path for numbers, path in numbered if numbers}
    return by_first if len(by_first) == len(numbered) else dict(numbered)


def thinned(items: list) -> tuple[list, tuple[str, ...]]:
    """Subsample a long list evenly; returns it with a note about the subsampling."""
    every = -(-len(items) // MOST_CANDIDATES) or 1
    note = f"Of {len(items)} frames one in {every} was looked at"
    return items[::every], (note,) if every > 1 else ()


def require(items: list, folder: Path, missing: str) -> None:
    """Raise an InputError if a recording has no frame."""
    if not items:
        raise InputError(f"{folder} has no frame with colour and depth: it lacks {missing}; check the names")


def color_folder(folder: Path) -> Path | None:
    """Return the folder of the colour images of a recording; None if there is none."""
    return next((folder / name for name in COLOR_FOLDERS if (folder / name).is_dir()), None)
