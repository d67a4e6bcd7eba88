"""Anybody's pictures with depth, paired by name; depth in 16-bit millimetres."""

from __future__ import annotations

import logging
from functools import partial
from pathlib import Path

from lab.datasets.pair import Frame, Pair
from pipeline.io.images import read_color, read_depth
from pipeline.io.intrinsics import read_intrinsics

log = logging.getLogger(__name__)

PICTURES = {".png", ".jpg", ".jpeg"}
COLOR_FOLDERS = ("color", "rgb", "image")


def find(root: Path) -> list[Frame]:
    """The pairs in ``root`` and in all folders below it; each folder is one scene.

    ``color/NAME`` (or rgb/, image/) with ``depth/NAME.png``, ``NAME_rgb`` (or _color) with
    ``NAME_depth.png``, and ``color.png`` with ``depth.png``; intrinsics.json beside them if there.
    """
    frames = []
    for folder in [root, *sorted(path for path in root.rglob("*") if path.is_dir())]:
        scene = root.resolve().name if folder == root else folder.relative_to(root).as_posix()
        for stem, picture, depth in _pairs(folder):
            name = f"{scene}/{stem}"
            frames.append(Frame(name, partial(_load, name, picture, depth, folder / "intrinsics.json")))
    return frames


def _pairs(folder: Path) -> list[tuple[str, Path, Path]]:
    """Stem, picture and depth of each pair that lies in this folder."""
    wanted = []
    for picture in _pictures(folder):
        stem, _, ending = picture.stem.rpartition("_")
        if picture.stem == "color":
            wanted.append(("color", picture, folder / "depth.png"))
        elif ending in ("rgb", "color"):
            wanted.append((stem, picture, folder / f"{stem}_depth.png"))
    for color in COLOR_FOLDERS:
        if (folder / "depth").is_dir():
            wanted += [
                (file.stem, file, folder / "depth" / f"{file.stem}.png") for file in _pictures(folder / color)
            ]
    pairs = [entry for entry in wanted if entry[2].is_file()]
    if len(pairs) < len(wanted):
        log.warning("%d pictures in %s have no depth and are left out", len(wanted) - len(pairs), folder)
    return pairs


def _pictures(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES)


def _load(name: str, picture: Path, depth: Path, camera: Path) -> Pair:
    intrinsics = read_intrinsics(camera) if camera.is_file() else None
    return Pair(name, read_color(picture), read_depth(depth).z_m, intrinsics)
