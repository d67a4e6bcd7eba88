"""``python -m lab.training.level_tables [ROOMS]``: chances for the coding of depth levels, in ``assets``.

They are the shares of ones in each slot of the model (``pipeline.delivery.tile_model``) over images of rooms
of the training split: as a simulated Kinect delivers them (few levels), and registered to the pixels of a
second camera, which mixes the levels (dense). Neither demo scenes nor test rooms nor real frames are among
them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lab.training.dataset import FIRST_SEED, viewed_room
from lab.worlds.sensor import sense_depth
from packetmesh.files import atomic_path
from pipeline.delivery.arithmetic import BIT, BODY, COUNTS, MEMORY, ONE, WRITE, compiled_with_arrays, writer
from pipeline.delivery.coding import DepthArray, areas_of
from pipeline.delivery.levels import SHIPPED_TABLES, TABLES, indices_of
from pipeline.delivery.tile_model import MOST_WORDS_PER_PIXEL, SLOTS, Indices, code_tile
from pipeline.delivery.tiled import TILE
from pipeline.io.depth_to_color import register_depth
from pipeline.kernels.geometry import scaled
from pipeline.types import ByteArray, DepthMap

ROOMS = 40
VIEWS = 2
WIDTH_PX = 640
DEPTH_FOCAL = 1.1
"""Focal length of the depth camera, of the colour camera's, in images that are registered."""
T_COLOR_DEPTH = np.array(
    [[1.0, 0.0, 0.004, 0.025], [0.0, 1.0, 0.0, 0.0], [-0.004, 0.0, 1.0, 0.0], [0, 0, 0, 1]]
)
"""A Kinect's 2.5 cm, and a turn of a quarter of a degree."""


@dataclass(frozen=True, slots=True)
class SensedView:
    """A view of a room as a camera delivers it."""

    rgb: ByteArray
    """(H, W, 3)."""
    depth: DepthArray
    """(H, W) millimetres as a Kinect's depth camera gives them."""
    registered: DepthArray
    """(H, W) millimetres of a depth camera next to the colour camera, registered to its pixels."""


def sensed_views(seed: int, views: int = VIEWS) -> Iterator[SensedView]:
    """Yield views of a random room, 640 pixels wide."""
    room = viewed_room(seed, None, threads=0, views=views)
    for small, T_world_camera in room.cameras:
        camera = scaled(small, WIDTH_PX / small.width_px)
        view = room.renderer.view(camera, T_world_camera, "fast", room.rng)
        depth = sense_depth(view, camera, room.rng)
        matrix = camera.matrix @ np.diag([DEPTH_FOCAL, DEPTH_FOCAL, 1.0])
        registered = register_depth(depth, replace(camera, matrix=matrix), camera, T_COLOR_DEPTH)
        yield SensedView(view.rgb, _millimetres(depth), _millimetres(registered))


def count(depth: DepthArray, counts: NDArray[np.int64]) -> None:
    """Add the bits of an image's tiles to the counts of their slots."""
    values, indices = indices_of(depth)
    for area in areas_of(depth.shape, TILE):
        if indices[area].any():
            _count(counts, np.ascontiguousarray(indices[area]), len(values))


@compiled_with_arrays
def _count(counts: NDArray[np.int64], tile: Indices, level_count: int) -> None:
    coder = writer(counts, MOST_WORDS_PER_PIXEL * tile.size)
    coder[MEMORY] = np.iinfo(np.int64).max
    code_tile(WRITE, coder, tile, level_count)
    counts[:] = coder[COUNTS : coder[BODY]]


def _millimetres(depth: DepthMap) -> DepthArray:
    return np.rint(np.where(depth.valid, 1000.0 * depth.z_m, 0.0)).astype(np.uint16)


def main() -> None:
    """Write the tables, and print the number of images behind them."""
    rooms = int(sys.argv[1]) if len(sys.argv) > 1 else ROOMS
    counts = np.full((len(TABLES), 2 * SLOTS), BIT // 2, np.int64)
    for seed in range(FIRST_SEED["train"], FIRST_SEED["train"] + rooms):
        for view in sensed_views(seed):
            for depth, own in zip((view.depth, view.registered), counts, strict=True):
                count(depth, own)
    zeros, ones = counts[:, ::2], counts[:, 1::2]
    chances = np.rint(ones / (zeros + ones) * ONE)
    with atomic_path(SHIPPED_TABLES) as temporary:
        np.save(temporary, np.clip(chances, 1, ONE - 1).astype(np.uint16))
    print(f"{SHIPPED_TABLES}: {SHIPPED_TABLES.stat().st_size / 1e3:.1f} kB of {rooms * VIEWS} images")


if __name__ == "__main__":
    main()
