"""Tiles that add nothing to a rig's surface, because another camera sends the same piece of surface.

The sink has the base layer of every camera (one depth for each block of 8 x 8 pixels, ``coarse``) and the
believed poses. A tile is left out if every base point in it is on the surface that another camera sees in
tiles that it sends, within the noise of both sensors, and seen from there about as densely and precisely.
A node receives one bit a tile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.delivery.base_points import BasePoints, BaseView, at_edges, base_points, surface_at
from pipeline.delivery.coarse import DEPTH_BLOCK
from pipeline.delivery.tiled import TILE
from pipeline.kernels.geometry import apply, inverse, project
from pipeline.types import BoolArray, FloatArray, IntArray

_BLOCKS = TILE // DEPTH_BLOCK
"""Blocks along each side of a tile."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Largest differences between two cameras' views of a tile that is left out.

    The defaults save most bytes among those with which the mesh of eight validation rooms lost at most .1
    points of F-score at 5 cm and .3 at 1 cm (``lab.between_cameras``).
    """

    sigmas: float = 2.0
    """Distance of a base point from the other camera's surface, in standard deviations of both sensors."""
    least_share: float = 0.25
    """Least ratio of the other camera's points per area, and of its inverse variance, to the tile's own."""
    missing_blocks: int = 15
    """Largest number of blocks without depth in a tile."""
    edge_blocks: int = 16
    """Largest number of blocks at depth edges in a tile."""
    shared: float = 0.8
    """Least share of a tile's base points that are on the other cameras' surfaces."""


STRICT = Limits(sigmas=2.0, least_share=0.5, missing_blocks=0, edge_blocks=0, shared=1.0)
"""Limits for tiles all of which is replaced, on smooth surfaces only; they save 40 to 55 % as many bytes."""


@dataclass(frozen=True, slots=True)
class SharedViews:
    """Tiles that each camera of a rig need not send."""

    leave_out: tuple[BoolArray, ...]
    """(rows, columns) of each camera, True for tiles to leave out."""
    shown_by: IntArray
    """(N, N) number of tiles that camera i leaves out and camera j shows, in whole or in part."""


def request_bytes(leave_out: Sequence[BoolArray]) -> tuple[int, ...]:
    """Return the bytes of the request to each node: one bit a tile, nothing if it sends all."""
    return tuple(-(-mask.size // 8) if mask.any() else 0 for mask in leave_out)


@dataclass(frozen=True, slots=True)
class _Seen:
    """The (N,) points of one camera, seen from another one."""

    shared: BoolArray
    """Whether each is on the other camera's surface and seen as well from there."""
    rows: IntArray
    columns: IntArray
    """(N, 4) tiles of the other camera that hold its surface there."""


@dataclass(frozen=True, slots=True)
class _Sight:
    """A camera's base points, and what the others see of them."""

    of_block: IntArray
    """(h, w) index of each block's point; -1 where there is none."""
    known: BoolArray
    """(h, w) whether a block has depth."""
    others: dict[int, _Seen]
    """By index of the other camera."""
    candidates: BoolArray
    """(rows, columns) of tiles that may be left out."""

    def points_of(self, tile: tuple[int, int]) -> tuple[IntArray, int]:
        """Return the indices of the points in a tile, and the number of its blocks with depth."""
        top, left = _BLOCKS * tile[0], _BLOCKS * tile[1]
        area = (slice(top, top + _BLOCKS), slice(left, left + _BLOCKS))
        points = self.of_block[area].ravel()
        return points[points >= 0], int(self.known[area].sum())


def shared_views(
    views: Sequence[BaseView], order: Sequence[int] | None = None, limits: Limits | None = None
) -> SharedViews:
    """Return the tiles that each camera need not send.

    The cameras' tiles are judged in turn, the last camera's first: it sends least, and its gaps are large
    pieces, in which colour tiles are saved, too. A tile that replaces another one is always sent.

    Args:
        views: base layers of a rig's cameras.
        order: indices of the cameras, the one that sends most first; None takes them as given.
        limits: how much two cameras' views may differ; None takes the defaults.

    Raises:
        InputError: a base layer does not have the size of its camera's image, or ``order`` does not name
            every camera once.
    """
    order, limits = list(range(len(views)) if order is None else order), limits or Limits()
    if sorted(order) != list(range(len(views))):
        raise InputError(f"The order {order} does not name each of {len(views)} cameras once")
    for index, view in enumerate(views):
        _check(index, view)
    sights = [_sight(views, index, limits) for index in range(len(views))]
    leave_out = [np.zeros(sight.candidates.shape, np.bool_) for sight in sights]
    needed = [mask.copy() for mask in leave_out]
    shown_by = np.zeros((len(views), len(views)), np.int64)
    for camera in reversed(order):
        for row, column in np.argwhere(sights[camera].candidates & ~needed[camera]).tolist():
            replacements = _replacements(sights[camera], (row, column), leave_out, limits.shared)
            if replacements is not None:
                leave_out[camera][row, column] = True
                for other, rows, columns in replacements:
                    needed[other][rows, columns] = True
                    shown_by[camera, other] += len(rows) > 0
    return SharedViews(tuple(leave_out), shown_by)


def _check(index: int, view: BaseView) -> None:
    height, width = view.intrinsics.height_px, view.intrinsics.width_px
    expected = (-(-height // DEPTH_BLOCK), -(-width // DEPTH_BLOCK))
    if view.z_m.shape != expected:
        raise InputError(
            f"The base layer of camera {index} has the shape {view.z_m.shape}, but its images of "
            f"{width} x {height} pixels have {expected} blocks; give one depth a block"
        )


def _sight(views: Sequence[BaseView], index: int, limits: Limits) -> _Sight:
    """Return what a camera and all others see of the camera's tiles."""
    view, own = views[index], base_points(views[index])
    others = {
        other: _seen_from(views[other], view, own, limits) for other in range(len(views)) if other != index
    }
    of_block = np.full(view.z_m.shape, -1)
    of_block[own.rows, own.columns] = np.arange(len(own.rows))
    return _Sight(of_block, np.isfinite(view.z_m), others, _candidates(view, of_block, limits))


def _seen_from(other: BaseView, view: BaseView, own: BasePoints, limits: Limits) -> _Seen:
    """Return which points of a camera are on another one's surface, seen as well from there."""
    points_m, normals = own.points_m, own.normals
    there_m = apply(inverse(other.T_world_camera), points_m)
    pixels = np.full((len(points_m), 2), np.nan)
    ahead = there_m[:, 2] > 0.0
    pixels[ahead] = project(other.intrinsics, there_m[ahead])
    surface = surface_at(other, pixels)
    from_other_m = points_m - other.T_world_camera[:3, 3]
    from_own_m = points_m - view.T_world_camera[:3, 3]
    own_z_m = view.z_m[own.rows, own.columns].astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        slope_other = -np.sum(normals * from_other_m, axis=1) / there_m[:, 2]
        slope_own = -np.sum(normals * from_own_m, axis=1) / own_z_m
        sd_other_m, sd_own_m = other.sd_m(surface.z_m), view.sd_m(own_z_m)
        distance_m = np.abs(there_m[:, 2] - surface.z_m) * slope_other
        sd_m = np.hypot(sd_other_m * slope_other, sd_own_m * slope_own)
        density_other = _density(other, from_other_m, normals)
        density_own = _density(view, from_own_m, normals)
        shared = (
            (slope_other > 0.0)
            & (distance_m <= limits.sigmas * sd_m)
            & (density_other >= limits.least_share * density_own)
            & (sd_own_m**2 >= limits.least_share * sd_other_m**2)
        )
    return _Seen(shared, surface.rows // _BLOCKS, surface.columns // _BLOCKS)


def _density(view: BaseView, away_m: FloatArray, normals: FloatArray) -> FloatArray:
    """Return (K,) pixels per square metre of surface at points ``away_m`` (K, 3) from the camera."""
    distance_m = np.linalg.norm(away_m, axis=1)
    cosine = np.abs(np.sum(away_m * normals, axis=1)) / distance_m
    return view.intrinsics.fx_px * view.intrinsics.fy_px * cosine / distance_m**2


def _candidates(view: BaseView, of_block: IntArray, limits: Limits) -> BoolArray:
    """Return the tiles with base points, enough of them with a normal, few missing blocks and few edges."""
    known = np.isfinite(view.z_m)
    few_missing = tile_sums(~known) <= limits.missing_blocks
    few_edges = tile_sums(at_edges(view.z_m)) <= limits.edge_blocks
    least = limits.shared * tile_sums(known)
    return np.asarray(few_missing & few_edges & (least > 0) & (tile_sums(of_block >= 0) >= least))


def tile_sums(blocks: BoolArray | FloatArray) -> FloatArray:
    """Return (rows, columns) the sum over the (h, w) blocks of each tile: of marks, their number."""
    rows, columns = (-(-size // _BLOCKS) for size in blocks.shape)
    padding = ((0, rows * _BLOCKS - blocks.shape[0]), (0, columns * _BLOCKS - blocks.shape[1]))
    padded = np.pad(np.asarray(blocks, np.float64), padding)
    return np.asarray(padded.reshape(rows, _BLOCKS, columns, _BLOCKS).sum(axis=(1, 3)))


def _replacements(
    sight: _Sight, tile: tuple[int, int], leave_out: Sequence[BoolArray], share: float
) -> list[tuple[int, IntArray, IntArray]] | None:
    """Return the tiles (camera, rows, columns) that show a share of a tile's base points; None if none do."""
    points, total = sight.points_of(tile)
    found = []
    for other, seen in sight.others.items():
        rows, columns = seen.rows[points], seen.columns[points]
        sent = seen.shared[points] & ~leave_out[other][rows, columns].any(axis=1)
        found.append((other, rows[sent], columns[sent]))
        points = points[~sent]
        total_shared = sum(len(rows) for _, rows, _ in found)
        if total_shared >= share * total:
            return found
    return None
