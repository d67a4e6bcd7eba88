"""Pairs of images and 16-bit depth in millimetres in any folder, matched by name."""

from __future__ import annotations

import logging
from functools import partial
from pathlib import Path

from lab.datasets.pair import Load, load_pair

log = logging.getLogger(__name__)

PICTURES = {".png", ".jpg", ".jpeg"}
COLOR_FOLDERS = ("color", "rgb", "image")


def find(root: Path) -> list[Load]:
    """Return the pairs in ``root`` and in all folders below it; log how many pictures have no depth.

    These are pairs: ``color/NAME`` (or rgb/, image/) and ``depth/NAME.png``, ``NAME_rgb`` (or NAME_color) and
    ``NAME_depth.png``, ``color.png`` and ``depth.png``. A picture may be a JPEG instead of a PNG file.
    """
    folders = [root, *sorted(path for path in root.rglob("*") if path.is_dir())]
    return [partial(load_pair, *pair) for folder in folders for pair in _pairs(folder)]


def _pairs(folder: Path) -> list[tuple[Path, Path]]:
    """Return the paths of image and depth of each pair in this folder."""
    candidates = []
    for picture in _pictures(folder):
        stem, _, ending = picture.stem.rpartition("_")
        if picture.stem == "color":
            candidates.append((picture, folder / "depth.png"))
        elif ending in ("rgb", "color"):
            candidates.append((picture, folder / f"{stem}_depth.png"))
    if (folder / "depth").is_dir():
        pictures = [picture for color in COLOR_FOLDERS for picture in _pictures(folder / color)]
        candidates += [(picture, folder / "depth" / f"{picture.stem}.png") for picture in pictures]
    pairs = [(picture, depth) for picture, depth in candidates if depth.is_file()]
    if len(pairs) < len(candidates):
        log.warning("%d pictures in %s have no depth and are left out", len(candidates) - len(pairs), folder)
    return pairs


def _pictures(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES)
