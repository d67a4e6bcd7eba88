"""Pairs of RGB-D views of random rooms with a given overlap, and their true pose.

``pair`` is deterministic in its split, index and overlap. Splits use disjoint rooms, and every index of a
split has a room of its own: validation pairs fit thresholds, held-out pairs only judge them.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from lab.places.overlap import OverlapMeter
from lab.places.views import TOLERANCE, is_usable, two_poses
from lab.worlds.raycast import RayCaster
from lab.worlds.render import Renderer
from lab.worlds.rooms import random_room
from lab.worlds.scene import Rng
from lab.worlds.sensor import sense_depth
from lab.worlds.viewpoints import random_views
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.files import atomic_path
from pipeline.acquisition import back_project
from pipeline.kernels.geometry import LEVEL_POSE, inverse
from pipeline.types import CameraIntrinsics, DepthMap, FloatArray, PointCloud, RgbdFrame

Split = Literal["validation", "held-out"]
VALIDATION: Split = "validation"
HELD_OUT: Split = "held-out"
FIRST_ROOM: dict[Split, int] = {VALIDATION: 3_000_000, HELD_OUT: 4_000_000}
"""Seed of the first room of each split; the networks' rooms have seeds below 3,000,000."""
NEXT_ROOM = 20_000
"""Step between the seeds of an index's rooms; the next room is tried if no two views of one fit."""
ROOMS = 40
"""Rooms that are tried for an index; indices are below ``NEXT_ROOM``."""
OTHER_ROOM = 2_000_000
"""Difference between the seeds of the two rooms of a pair of different rooms."""

CLASSES = (0.60, 0.40, 0.25, 0.15)
"""Overlaps of the benchmark."""
MIXED_FROM = 1000
"""First index of the pairs of any overlap; the benchmark's own are below."""
MIXED_MOST = 0.9
"""Largest overlap of the mixed pairs."""
UNRELATED = (0.1, 0.2)
"""Random numbers from 0 to 1 choose the mixed pairs: below the first value, views of different rooms; then,
below the second, views of one room without overlap."""

FOV_DEG = 57.0
"""Horizontal field of view of a Kinect."""
WIDTH_PX, HEIGHT_PX = 320, 240
_FOCAL_PX = 0.5 * WIDTH_PX / np.tan(np.radians(0.5 * FOV_DEG))
CAMERA = CameraIntrinsics.pinhole(
    _FOCAL_PX, _FOCAL_PX, 0.5 * (WIDTH_PX - 1), 0.5 * (HEIGHT_PX - 1), WIDTH_PX, HEIGHT_PX
)
CACHE = Path("runs/places")
VERSION = 1
"""Part of the cache's file names: raise it with every change of the pairs."""


@dataclass(frozen=True, slots=True)
class PlacesPair:
    """Two RGB-D views without known poses, and their truth."""

    source: RgbdFrame
    target: RgbdFrame
    T_target_source: FloatArray | None
    """(4, 4) true pose; None for views of different rooms, which have none."""
    overlap_share: float
    """True overlap (see ``OverlapMeter.share``), 0 to 1."""
    room: int
    """Seed of the room, that of the target for views of different rooms."""

    @property
    def clouds(self) -> tuple[PointCloud, PointCloud]:
        """Source and target as point clouds, each in the frame of its camera."""
        return back_project(self.source), back_project(self.target)


def pair(split: Split, index: int, overlap: float | None, folder: Path | None = CACHE) -> PlacesPair:
    """Return one pair, from the cache or rendered.

    Args:
        split: ``VALIDATION`` or ``HELD_OUT``.
        index: number of the pair in its split, 0 to 19,999; every index has a room of its own.
        overlap: wanted overlap, 0 to 0.9, met within 0.02; None takes two views of different rooms.
        folder: folder of the cache; None renders without a cache.

    Raises:
        InputError: the index or the overlap is out of range.
        PacketMeshError: no room that was tried has such views.
    """
    if not 0 <= index < NEXT_ROOM:
        raise InputError(f"There is no pair {index}; indices are 0 to {NEXT_ROOM - 1}")
    if overlap is not None and not 0.0 <= overlap <= MIXED_MOST:
        raise InputError(f"An overlap of {overlap:g} is not possible; it is 0 to {MIXED_MOST:g}")
    if folder is None:
        return _rendered(split, index, overlap)
    name = "apart" if overlap is None else f"{10_000.0 * overlap:05.0f}"
    path = folder / f"v{VERSION}" / f"{split}-{index:05d}-{name}.npz"
    found = _read(path)
    if found is None:
        found = _rendered(split, index, overlap)
        _write(path, found)
    return found


def bench_pairs(per_class: int) -> Iterator[tuple[int, float]]:
    """Yield index and overlap of the benchmark's pairs: ``per_class`` of each of ``CLASSES``."""
    for number in range(per_class * len(CLASSES)):
        yield number, CLASSES[number % len(CLASSES)]


def mixed_pairs(split: Split, count: int) -> Iterator[tuple[int, float | None]]:
    """Yield index and overlap of pairs for a verdict.

    On average, one in ten is from different rooms (overlap None), one in ten has no overlap, and the overlap
    of the others is drawn evenly from 0 to 0.9.
    """
    for index in range(MIXED_FROM, MIXED_FROM + count):
        rng = np.random.default_rng([FIRST_ROOM[split], index, 11])
        kind, overlap = rng.random(), float(np.round(rng.uniform(0.0, MIXED_MOST), 4))
        yield index, None if kind < UNRELATED[0] else 0.0 if kind < UNRELATED[1] else overlap


def rooms_of(split: Split, index: int) -> Iterator[tuple[int, Rng]]:
    """Yield the seed of each room to try for an index, with its source of randomness."""
    for k in range(ROOMS):
        seed = FIRST_ROOM[split] + index + k * NEXT_ROOM
        yield seed, np.random.default_rng([seed, 17])


def _rendered(split: Split, index: int, overlap: float | None) -> PlacesPair:
    for seed, rng in rooms_of(split, index):
        try:
            made = _apart(seed, rng) if overlap is None else _together(seed, rng, overlap)
        except InputError:  # the room is too full for a camera
            continue
        if made is not None:
            return made
    wanted = "of different rooms" if overlap is None else f"with an overlap of {overlap:g} +- {TOLERANCE:g}"
    raise PacketMeshError(f"No room for pair {index} of {split} has two views {wanted}; take another index")


def _together(seed: int, rng: Rng, overlap: float) -> PlacesPair | None:
    """Return two views of one room; None if no two have this overlap."""
    scene = random_room(seed)
    renderer = Renderer(scene, threads=1)
    poses = two_poses(scene, CAMERA, overlap, rng, renderer)
    if poses is None:
        return None
    source, target = (
        _photograph(renderer, T, name, rng)
        for T, name in ((poses.source, "source"), (poses.target, "target"))
    )
    T_target_source = inverse(poses.target) @ poses.source
    return PlacesPair(source, target, T_target_source, poses.overlap_share, seed)


def _apart(seed: int, rng: Rng) -> PlacesPair | None:
    """Return views of two rooms; None if a room has no usable view."""
    frames = []
    for name, room in (("source", seed + OTHER_ROOM), ("target", seed)):
        scene = random_room(room)
        renderer = Renderer(scene, threads=1)
        meter = OverlapMeter(RayCaster(scene, threads=1), CAMERA)
        views = random_views(scene, rng, 3, renderer)
        T = next((T for T in views if is_usable(meter.look(T))), None)
        if T is None:
            return None
        frames.append(_photograph(renderer, T, name, rng))
    return PlacesPair(frames[0], frames[1], None, 0.0, seed)


def _photograph(renderer: Renderer, T_world_camera: FloatArray, name: str, rng: Rng) -> RgbdFrame:
    """Return one view by the Kinect model, without its pose."""
    view = renderer.view(CAMERA, T_world_camera, "fast", rng)
    return _frame(name, view.rgb, sense_depth(view, CAMERA, rng).z_m)


def _frame(name: str, rgb: np.ndarray, z_m: FloatArray) -> RgbdFrame:
    return RgbdFrame(name, rgb, DepthMap(z_m), CAMERA, LEVEL_POSE, pose_known=False)


def _read(path: Path) -> PlacesPair | None:
    """Return a stored pair; None if there is none, or its file is damaged."""
    try:
        with np.load(path) as stored:
            source, target = (
                _frame(name, stored["rgb"][k], stored["z_m"][k])
                for k, name in enumerate(("source", "target"))
            )
            T = stored["T_target_source"]
            overlap_share, room = float(stored["overlap_share"]), int(stored["room"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return PlacesPair(source, target, T if np.all(np.isfinite(T)) else None, overlap_share, room)


def _write(path: Path, made: PlacesPair) -> None:
    frames = (made.source, made.target)
    with atomic_path(path) as temporary:
        np.savez_compressed(
            temporary,
            rgb=np.stack([frame.rgb for frame in frames]),
            z_m=np.stack([frame.depth.z_m for frame in frames]),
            T_target_source=np.full((4, 4), np.nan) if made.T_target_source is None else made.T_target_source,
            overlap_share=made.overlap_share,
            room=made.room,
        )
