"""Images that evaluate a depth network: held-out rooms, demo scenes, real frames, a user's sets."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from lab.training.evaluate import FIRST_TEST_ROOM, Example, demo, held_out_rooms
from packetmesh.errors import InputError
from pipeline.io.demos import CALIBRATED_SCENES
from pipeline.io.rigs import load_frame
from pipeline.types import DepthMap, RgbdFrame

HELD_OUT = "held-out rooms"
REAL = "real frames"
HELD_OUT_SCENES = 3
ROOMS_PER_SCENE = 50
VIEWS_PER_ROOM = 2
"""Views per room: a scene has 100 images, as in the thesis."""
INDOOR_CAP_M = 10.0
OUTDOOR_CAP_M = 80.0
OUTDOOR_SETS = ("kitti",)
SETS_VARIABLE = "PACKETMESH_DEPTH_SETS"
"""Variable that names more sets as ``kind=path``, separated like the folders of PATH."""
DATA_VARIABLE = "PACKETMESH_SHARED_DATA"
"""Variable that names the folder of real frames."""
DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
"""Folder of real frames, next to the repository, if ``PACKETMESH_SHARED_DATA`` is not set."""


@dataclass(frozen=True, slots=True)
class Site:
    """Images whose errors are reported together."""

    name: str
    group: str
    """``held-out rooms``, ``demo scenes``, ``real frames`` or a user's set."""
    examples: Callable[[], Iterator[Example]] = field(repr=False)
    """Returns the images; they depend only on the site's name, the code and the files of the site."""
    truth: bool = True
    """Whether the reference is the truth; otherwise it is the sensor's own depth, with unknown errors."""
    cap_m: float = INDOOR_CAP_M
    """Largest depth that is evaluated."""


def sites() -> tuple[Site, ...]:
    """Return all sites on this machine, the three held-out scenes first."""
    return (*held_out_scenes(), *demo_scenes(), *real_frames(), *user_sets())


def held_out_scenes(rooms: int = ROOMS_PER_SCENE, views: int = VIEWS_PER_ROOM) -> tuple[Site, ...]:
    """Return scenes 1 to 3: rooms of the test split, on which nothing was trained."""
    starts = range(FIRST_TEST_ROOM, FIRST_TEST_ROOM + HELD_OUT_SCENES * rooms, rooms)
    return tuple(
        Site(f"Scene {number}", HELD_OUT, partial(held_out_rooms, range(start, start + rooms), views))
        for number, start in enumerate(starts, 1)
    )


def demo_scenes() -> tuple[Site, ...]:
    """Return a site for each demo scene that needs no calibration, with the images of its nodes."""
    return tuple(Site(name, "demo scenes", partial(demo, name)) for name in CALIBRATED_SCENES)


def real_frames() -> tuple[Site, ...]:
    """Return a site for each registered RGB-D pair of the real data; none if there is no such folder."""
    return tuple(
        Site(folder.name, REAL, partial(real_frame, folder), truth=False) for folder in real_folders()
    )


def real_folders() -> tuple[Path, ...]:
    """Return the sorted folders of real frames: those with a depth.png; their other files are not checked."""
    data = Path(os.environ.get(DATA_VARIABLE, DATA))
    return tuple(sorted(depth.parent for depth in data.glob("*/depth.png")))


def load_real(folder: Path) -> RgbdFrame:
    """Return the registered pair in a folder, named after it."""
    color, depth, intrinsics = (folder / name for name in ("color.png", "depth.png", "intrinsics.json"))
    return load_frame(color, depth, intrinsics, name=folder.name)


def real_frame(folder: Path) -> Iterator[Example]:
    """Yield one real image, evaluated where the sensor has depth."""
    frame = load_real(folder)
    yield Example(frame.rgb, frame.depth, frame.depth.z_m)


def user_sets() -> tuple[Site, ...]:
    """Return a site for each set that ``PACKETMESH_DEPTH_SETS`` names, with all its images."""
    named = named_sets()
    kinds = [text.partition("=")[0].strip().lower() for text in named]
    return tuple(
        Site(
            text,
            f"set {kind}",
            partial(pairs, text),
            truth=False,
            cap_m=OUTDOOR_CAP_M if kind in OUTDOOR_SETS else INDOOR_CAP_M,
        )
        for text, kind in zip(named, kinds, strict=True)
    )


def named_sets() -> list[str]:
    """Return ``kind=path`` of each set that ``PACKETMESH_DEPTH_SETS`` names.

    Raises:
        InputError: a set lacks its kind or its path.
    """
    named = [text for text in os.environ.get(SETS_VARIABLE, "").split(os.pathsep) if text]
    for text in named:
        kind, _, path = text.partition("=")
        if not kind.strip() or not path.strip():
            raise InputError(
                f"{SETS_VARIABLE} names the set '{text}' without its kind or path; try nyu=/path/to/the/set"
            )
    return named


def set_paths() -> tuple[Path, ...]:
    """Return the folder, or file, of each set that ``PACKETMESH_DEPTH_SETS`` names."""
    return tuple(Path(text.partition("=")[2].strip()).expanduser() for text in named_sets())


def pairs(text: str) -> Iterator[Example]:
    """Yield the images of one set, ``kind=path``, evaluated in its usual crop.

    Raises:
        InputError: the kind is unknown, or the files are missing or unusable.
    """
    from lab.datasets import open_set

    for pair in open_set(text):
        judging_m = (
            pair.truth_m if pair.judged is None else np.where(pair.judged, pair.truth_m, np.float32(np.nan))
        )
        yield Example(pair.rgb, DepthMap(pair.truth_m), judging_m)
