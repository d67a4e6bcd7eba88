"""Images without the tiles that a node need not send, as the sink has them, and the bytes of these tiles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.delivery import coarse, levels
from pipeline.delivery.base_points import BaseView
from pipeline.delivery.coding import Images, Received, areas_of
from pipeline.delivery.tiled import SEAL_BYTES, TILE, Colors
from pipeline.types import BoolArray, CameraIntrinsics, DepthNoise, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class TileBytes:
    """Bytes of an image's tiles, without the protected part."""

    depth: IntArray
    """(rows, columns) of the depth tiles."""
    color: IntArray
    """(rows, columns) of the colour tiles, which may be larger."""

    def of(self, leave_out: BoolArray) -> tuple[int, int]:
        """Return the bytes of depth and of colour that are saved without some depth tiles.

        A colour tile is saved if all depth tiles in it are left out.

        Raises:
            InputError: ``leave_out`` has another number of tiles.
        """
        _check(self.depth.shape, leave_out)
        return int(self.depth[leave_out].sum()), int(
            self.color[whole_tiles(leave_out, self.color.shape)].sum()
        )


def tile_bytes(images: Images, colors: Colors) -> TileBytes:
    """Return the bytes of all tiles of a node's images, as the coding ``Tiled`` sends them."""
    areas, color_areas = areas_of(images.depth.shape, TILE), areas_of(images.depth.shape, colors.side_px)
    depth = levels.encode(images.depth, areas).tiles
    color = [colors.write(np.ascontiguousarray(images.rgb[area])) for area in color_areas]
    return TileBytes(
        _on_grid([len(tile) for tile in depth], images.depth.shape, TILE),
        _on_grid([len(tile) for tile in color], images.depth.shape, colors.side_px),
    )


def all_tiles(leave_out: BoolArray, color_grid: tuple[int, int]) -> BoolArray:
    """Return (T,) the tiles that are not sent, depth before colour, as ``Tiled.joined`` takes them."""
    return np.concatenate([leave_out.ravel(), whole_tiles(leave_out, color_grid).ravel()])


def without_tiles(images: Images, leave_out: BoolArray, color_side_px: int = TILE) -> Received:
    """Return what the sink has if all arrives that a node sends, and some tiles are not sent.

    In the tiles that are left out the sink has the base layer: coarse depth, which is no measurement, and
    coarse colour.

    Args:
        images: the node's images.
        leave_out: (rows, columns) True for tiles of 32 pixels that are not sent.
        color_side_px: side of colour tiles; one is left out if all depth tiles in it are.

    Raises:
        InputError: ``leave_out`` has another number of tiles than the images.
    """
    shape = (images.depth.shape[0], images.depth.shape[1])
    _check(grid_of(shape, TILE), leave_out)
    missing = pixels_of(leave_out, shape, TILE)
    whole = whole_tiles(leave_out, grid_of(shape, color_side_px))
    colorless = pixels_of(whole, shape, color_side_px)
    base = coarse.read_depth(coarse.write_depth(images.depth), shape)
    rgb = images.rgb
    if colorless.any():
        small = coarse.read_color(coarse.write_color(images.rgb), shape)
        rgb = np.where(colorless[..., None], small, rgb)
    return replace(
        Received.nothing(shape),
        rgb=rgb,
        rgb_known=np.ones(shape, np.bool_),
        depth=np.where(missing, 0, images.depth),
        coarse=np.where(missing, base, 0),
    )


def base_view(
    images: Images,
    units: float,
    intrinsics: CameraIntrinsics,
    T_world_camera: FloatArray,
    noise: DepthNoise | None = None,
) -> BaseView:
    """Return a node's base layer of depth as the sink decodes it.

    Args:
        images: the node's images.
        units: integer units of depth per metre.
        intrinsics: the node's camera.
        T_world_camera: (4, 4) believed pose.
        noise: noise of the sensor's depth; None means that of a Kinect.
    """
    shape = (images.depth.shape[0], images.depth.shape[1])
    blocks = coarse.read_blocks(coarse.write_depth(images.depth), shape)
    return BaseView(np.where(blocks > 0, blocks / units, np.nan), intrinsics, T_world_camera, noise)


def pixels_of(tiles: BoolArray, shape: tuple[int, int], side_px: int) -> BoolArray:
    """Return (H, W) True for the pixels of some tiles."""
    return tiles.repeat(side_px, axis=0).repeat(side_px, axis=1)[: shape[0], : shape[1]]


def whole_tiles(leave_out: BoolArray, larger: tuple[int, ...]) -> BoolArray:
    """Return the larger tiles, ``larger`` (rows, columns) of them, that contain only tiles to leave out."""
    ratio = -(-leave_out.shape[0] // larger[0]), -(-leave_out.shape[1] // larger[1])
    padding = [
        (0, rows * step - size) for rows, step, size in zip(larger, ratio, leave_out.shape, strict=True)
    ]
    whole = np.pad(leave_out, padding, constant_values=True)
    return np.asarray(whole.reshape(larger[0], ratio[0], larger[1], ratio[1]).all(axis=(1, 3)))


def _on_grid(sizes: list[int], shape: tuple[int, ...], side_px: int) -> IntArray:
    """Return the bytes of streams with their seals; an empty stream has none."""
    found = np.array(sizes)
    return np.where(found > 0, found + SEAL_BYTES, 0).reshape(grid_of(shape, side_px))


def grid_of(shape: tuple[int, ...], side_px: int) -> tuple[int, int]:
    """Return (rows, columns) of the tiles of an image."""
    return -(-shape[0] // side_px), -(-shape[1] // side_px)


def _check(grid: tuple[int, ...], leave_out: BoolArray) -> None:
    if leave_out.shape != grid:
        raise InputError(
            f"The image has {grid[0]} x {grid[1]} tiles, but {leave_out.shape} are marked to be left out; "
            f"mark each tile of {TILE} pixels"
        )
