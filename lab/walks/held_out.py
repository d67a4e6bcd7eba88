"""Held-out walks through random rooms, rendered once and kept, and their frames in memory."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from lab.walks.path import NoWalkError
from lab.walks.walk import kinect, render_walk
from lab.worlds.rooms import random_room
from packetmesh.errors import InputError
from packetmesh.files import writable_folder
from pipeline.importing.recorded import DepthView, open_recording
from pipeline.types import FloatArray, RgbdFrame

FIRST_ROOM = 6_000_000
"""Seed of the first room. Thresholds were chosen with rooms of smaller seeds, such as 5,000,001 and
5,000,002, and with the living room."""
CACHE = Path("runs/walks")
"""Folder of the walks, ``SEED-FRAMES-WIDTH``; delete it when the rendering changes."""


@dataclass(frozen=True, slots=True)
class WalkTask:
    """A program, a walk, and the frames that are used."""

    program: str
    folder: Path
    """Folder of the rendered walk, or another recording."""
    every: int
    """Step from one frame to the next; 5 makes a fast walk."""


@dataclass(frozen=True)
class FramesInMemory:
    """A recording in memory, read completely before the clock starts; implements ``Recording``."""

    name: str
    times_s: FloatArray
    frames: tuple[RgbdFrame, ...]
    views: tuple[DepthView, ...]
    T_world_camera: None = None
    notes: tuple[str, ...] = ()

    def view(self, index: int) -> DepthView:
        """Return the depth of a frame."""
        return self.views[index]

    def frame(self, index: int) -> RgbdFrame:
        """Return colour and depth of a frame."""
        return self.frames[index]

    def first(self, count: int) -> FramesInMemory:
        """Return the first frames as a recording."""
        return FramesInMemory(self.name, self.times_s[:count], self.frames[:count], self.views[:count])


def held_out_walks(walks: int, frames: int, width_px: int, folder: Path = CACHE) -> list[Path]:
    """Return the folders of the first ``walks`` walks from ``FIRST_ROOM`` up; missing ones are rendered.

    Rooms that have no walk of ``frames`` frames are left out.

    Raises:
        InputError: ``frames`` is not positive, or a walk cannot be written.
    """
    if frames < 1:
        raise InputError(f"A walk of {frames} frames is not possible; it has at least 1")
    writable_folder(folder)
    found: list[Path] = []
    for seed in count(FIRST_ROOM):
        if len(found) >= walks:
            break
        path = folder / f"{seed}-{frames}-{width_px}"
        if not path.exists():
            unfinished = path.with_suffix(".part")
            shutil.rmtree(unfinished, ignore_errors=True)
            try:
                render_walk(random_room(seed), frames, kinect(width_px), unfinished)
            except NoWalkError:
                shutil.rmtree(unfinished, ignore_errors=True)
                continue
            unfinished.rename(path)
        found.append(path)
    return found


def frames_in_memory(folder: Path, every: int) -> FramesInMemory:
    """Read each ``every``-th frame of a walk.

    Raises:
        InputError: the folder has no walk, or an image is damaged.
    """
    recording = open_recording(folder)
    numbers: Iterable[Any] = range(0, len(recording.times_s), every)
    frames = tuple(recording.frame(k) for k in numbers)
    first = recording.view(0)
    views = tuple(DepthView(one.depth, one.intrinsics, first.T_color_depth, first.noise) for one in frames)
    return FramesInMemory(folder.name, np.asarray(recording.times_s)[::every], frames, views)
