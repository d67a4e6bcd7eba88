"""Rendered rooms as training data: shards on disk, split by room, and the augmentation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import atomic_path
from pipeline.kernels.geometry import scaled
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray

if TYPE_CHECKING:
    from lab.training.furniture import Catalogue
    from lab.worlds.render import Renderer
    from lab.worlds.scene import Scene

WIDTH_PX, HEIGHT_PX = 320, 240
ROOMS_PER_SHARD = 10
VIEWS_PER_ROOM = 5
FOCAL_PX = 262.5
"""Focal length of a Kinect at half size, for which the depth of rooms from a catalogue is computed."""
FIRST_SEED = {"train": 0, "validation": 1_000_000, "test": 2_000_000}
"""First room seed of each split; no room is in two splits."""


def render_shards(
    folder: Path, split: str, first_shard: int, last_shard: int, catalogue: Catalogue | None = None
) -> Iterator[Path]:
    """Render shards [first, last) of ten rooms each and yield their RGB files; existing ones are kept.

    A shard is ``<split>_<number>_rgb.npy`` (N, 240, 320, 3) uint8 and ``..._depth.npy`` (N, 240, 320) float16
    metres, NaN where the ray hits nothing; the RGB file appears last.
    """
    shards = range(first_shard, last_shard)
    return write_shards(folder, split, shards, FIRST_SEED[split], partial(room_views, catalogue=catalogue))


def write_shards(
    folder: Path,
    name: str,
    shards: range,
    first_seed: int,
    room: Callable[[int], Iterable[tuple[ByteArray, FloatArray]]],
) -> Iterator[Path]:
    """Write the missing shards, ten rooms each, and yield the RGB file of every shard.

    Args:
        folder: folder of the shards.
        name: beginning of the files' names.
        shards: numbers of the shards.
        first_seed: seed of the first room of shard 0.
        room: yields colours and depth of the views of the room of a seed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for shard in shards:
        rgb_file = folder / f"{name}_{shard:04d}_rgb.npy"
        if not rgb_file.exists():
            first = first_seed + shard * ROOMS_PER_SHARD
            seeds = range(first, first + ROOMS_PER_SHARD)
            colors, depths = zip(*(view for seed in seeds for view in room(seed)), strict=True)
            depth_file = rgb_file.with_name(rgb_file.name.replace("rgb", "depth"))
            for file, arrays in ((depth_file, depths), (rgb_file, colors)):
                with atomic_path(file) as temporary:
                    np.save(temporary, np.stack(arrays))
        yield rgb_file


@dataclass(frozen=True, slots=True)
class ViewedRoom:
    """A furnished room with its cameras, at the training size."""

    scene: Scene
    renderer: Renderer
    cameras: list[tuple[CameraIntrinsics, FloatArray]]
    """Intrinsics and T_world_camera."""
    rng: np.random.Generator
    """Random generator of the images."""
    focal_px: float
    """Focal length of the learned camera, for which ``canonical_m`` computes depth."""

    def canonical_m(self, z_m: FloatArray, intrinsics: CameraIntrinsics) -> FloatArray:
        """Return (H, W) float16 depth, metres, that the learned camera would measure for the same image."""
        return (z_m * (self.focal_px / intrinsics.fx_px)).astype(np.float16)


def viewed_room(
    seed: int, catalogue: Catalogue | None, threads: int = 1, views: int | None = None
) -> ViewedRoom:
    """Return the room of a seed with five cameras, or ``views`` of them.

    Args:
        seed: seed of the room and its views.
        catalogue: furniture of the room; None takes procedural pieces. With it, views differ in focal length;
            as in ``zoom``, their depth is that which the training camera would measure for the same image:
            true depth times 262.5 px / focal length (canonical cameras, Yin et al. 2023).
        threads: threads of the renderer; 0 takes all cores.
        views: number of cameras; None takes five.
    """
    from lab.training.varied_rooms import varied_room
    from lab.worlds.render import Renderer
    from lab.worlds.rooms import random_room
    from lab.worlds.viewpoints import random_views, varied_views

    count, rng = views or VIEWS_PER_ROOM, np.random.default_rng(seed)
    if catalogue is not None:
        scene = varied_room(seed, catalogue)
        renderer = Renderer(scene, threads)
        seen = varied_views(seed, scene, count, renderer, WIDTH_PX)
        cameras = [(intrinsics, pose) for pose, intrinsics in seen]
        return ViewedRoom(scene, renderer, cameras, rng, FOCAL_PX)
    scene = random_room(seed)
    renderer = Renderer(scene, threads)
    intrinsics = scaled(scene.intrinsics, WIDTH_PX / scene.intrinsics.width_px)
    cameras = [(intrinsics, pose) for pose in random_views(scene, rng, count, renderer)]
    return ViewedRoom(scene, renderer, cameras, rng, intrinsics.fx_px)


def room_views(seed: int, catalogue: Catalogue | None = None) -> Iterator[tuple[ByteArray, FloatArray]]:
    """Yield (240, 320, 3) uint8 colours and (240, 320) float16 depth, metres, of the views of one room."""
    room = viewed_room(seed, catalogue)
    for intrinsics, T_world_camera in room.cameras:
        view = room.renderer.view(intrinsics, T_world_camera, "fast", room.rng)
        yield view.rgb, room.canonical_m(view.z_m, intrinsics)


class Shards:
    """All finished shards of one split, memory-mapped; ``refresh`` finds newly rendered ones."""

    def __init__(self, folder: Path, split: str) -> None:
        self.folder, self.split = folder, split
        self.files: list[Path] = []
        self.arrays: list[tuple[np.ndarray, np.ndarray]] = []
        self.index: list[tuple[int, int]] = []
        self.refresh()

    def refresh(self) -> None:
        """Open the shards that were written since the last call."""
        for file in sorted(self.folder.glob(f"{self.split}_*_rgb.npy")):
            if file not in self.files:
                rgb = np.load(file, mmap_mode="r")
                depth = np.load(file.with_name(file.name.replace("rgb", "depth")), mmap_mode="r")
                self.index += [(len(self.files), row) for row in range(len(rgb))]
                self.files.append(file)
                self.arrays.append((rgb, depth))

    def __len__(self) -> int:
        return len(self.index)

    def __getitem__(self, item: int) -> tuple[ByteArray, FloatArray]:
        """Return (240, 320, 3) uint8 RGB and (240, 320) float32 metres."""
        shard, row = self.index[item]
        rgb, depth = self.arrays[shard]
        return np.asarray(rgb[row]), np.asarray(depth[row], dtype=np.float32)

    def evenly(self, count: int) -> Iterator[tuple[ByteArray, FloatArray]]:
        """Yield ``count`` images with their depth, evenly spread over all; there must be at least one."""
        for item in np.linspace(0, len(self) - 1, count).astype(int):
            yield self[item]


def rendered(folder: Path, split: str) -> Shards:
    """Return the shards of one split.

    Raises:
        InputError: there are none.
    """
    shards = Shards(folder, split)
    if not shards.index:
        raise InputError(f"There are no {split} shards in {folder}: render them first.")
    return shards


def augment(rgb: ByteArray, depth_m: FloatArray, rng: np.random.Generator) -> tuple[ByteArray, FloatArray]:
    """Return another plausible photograph of the same place, with its depth."""
    if rng.random() < 0.5:
        rgb, depth_m = rgb[:, ::-1], depth_m[:, ::-1]
    if rng.random() < 0.3:
        rgb, depth_m = zoom(rgb, depth_m, rng)
    return degrade(recolor(np.ascontiguousarray(rgb), rng), rng), depth_m


def zoom(
    rgb: ByteArray, depth_m: FloatArray, rng: np.random.Generator, largest: float = 1.6
) -> tuple[ByteArray, FloatArray]:
    """Return a random crop, enlarged up to ``largest`` times to full size.

    The network assumes a fixed focal length, so the depth is divided by the enlargement.
    """
    factor = rng.uniform(1.0, largest)
    width, height = round(WIDTH_PX / factor), round(HEIGHT_PX / factor)
    left, top = rng.integers(WIDTH_PX - width + 1), rng.integers(HEIGHT_PX - height + 1)
    window = np.s_[top : top + height, left : left + width]
    rgb = cv2.resize(np.ascontiguousarray(rgb[window]), (WIDTH_PX, HEIGHT_PX))
    depth_m = cv2.resize(
        np.ascontiguousarray(depth_m[window]), (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_NEAREST
    )
    return rgb, depth_m / factor


def recolor(rgb: ByteArray, rng: np.random.Generator) -> ByteArray:
    """Change brightness, contrast, gamma and white balance at random, and sometimes saturation.

    The white balance multiplies the brightness twice and the contrast once; networks were trained with that.
    """
    level = np.linspace(0.0, 1.0, 256)
    gamma, contrast, brightness = np.exp(rng.normal(0.0, (0.25, 0.2, 0.15)))
    balance = np.exp(rng.normal(0.0, 0.08, 3))
    curve = (level[:, None] ** gamma - 0.5) * contrast + 0.5 * brightness * balance
    curve = np.clip(curve * balance, 0.0, 1.0)
    table = np.round(255.0 * curve).astype(np.uint8)
    rgb = cv2.merge([cv2.LUT(rgb[..., c], table[:, c]) for c in range(3)])
    if rng.random() < 0.5:
        grey = cv2.cvtColor(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
        saturation = rng.uniform(0.0, 1.5)
        rgb = cv2.addWeighted(rgb, saturation, grey, 1.0 - saturation, 0.0)
    return rgb


def degrade(rgb: ByteArray, rng: np.random.Generator) -> ByteArray:
    """Add a cheap camera's errors, each only sometimes: defocus, sensor noise, JPEG blocks."""
    if rng.random() < 0.3:
        rgb = cv2.GaussianBlur(rgb, (0, 0), rng.uniform(0.3, 1.5))
    if rng.random() < 0.4:
        noise = rng.standard_normal(rgb.shape, dtype=np.float32) * np.float32(rng.uniform(1.0, 10.0))
        rgb = np.clip(rgb + noise, 0, 255).astype(np.uint8)
    if rng.random() < 0.2:
        _, code = cv2.imencode(".jpg", rgb, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(40, 95))])
        rgb = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
    return rgb
