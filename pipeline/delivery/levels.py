"""Exact coding of depth images in tiles that stand alone, by the levels that the camera gives (SPEC 13).

A camera that measures disparity gives few different depths: an image of millimetres has 100 to 330 of them,
its levels. A pixel is coded as the index of its level, so that equal steps of disparity are equal numbers.
The levels are sent once, in a header that every tile needs; a tile's bytes are read up to the first gap.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.delivery import arithmetic
from pipeline.delivery.arithmetic import (
    READ,
    WRITE,
    Coder,
    Mode,
    code_number,
    compiled,
    compiled_with_arrays,
    counts_of,
    finish,
    reader,
    writer,
)
from pipeline.delivery.coding import DepthArray
from pipeline.delivery.tile_model import BROKEN, MOST_WORDS_PER_PIXEL, Indices, code_tile
from pipeline.types import ByteArray

SHIPPED_TABLES = Path(__file__).resolve().parents[2] / "assets" / "depth" / "levels.npy"
"""(T, S) uint16 chances of a one in each slot, by table; ``lab.training.level_tables`` makes them."""
TABLES = ("few", "dense")
"""Names of the tables of chances: for levels of a disparity's steps, and for nearly all whole millimetres."""
VERSION = 1
"""Of tables and model; a header names it."""
_SAMPLE = 17
"""Every so many of the tiles with depth are coded with each table, to choose one."""
_COUNT_BYTES = 2
_NUMBERS = 18
"""Kinds of gaps between levels, by the binary digits of the gap before."""


Area = tuple[slice, slice]


@dataclass(frozen=True, slots=True)
class Coded:
    """A depth image as bytes."""

    header: bytes
    """Version, table and levels; without it no tile can be read."""
    tiles: tuple[bytes, ...]
    """Streams of the tiles in the order of their areas; empty where nothing was measured."""


@dataclass(frozen=True, slots=True)
class Levels:
    """What a header says."""

    table: int
    """Index in ``TABLES``."""
    values: DepthArray
    """(L,) the depths of the image, ascending; 1 <= index <= L names one in a tile."""


def encode(depth: DepthArray, areas: list[Area]) -> Coded:
    """Encode a depth image.

    Args:
        depth: (H, W) in integer units, 0 where nothing was measured.
        areas: rows and columns of the tiles.
    """
    values, indices = indices_of(depth)
    tiles = [np.ascontiguousarray(indices[area]) for area in areas]
    sample = [tile for tile in tiles if tile.any()][::_SAMPLE]
    sizes = [
        sum(len(_write_tile(tile, table, len(values))) for tile in sample) for table in range(len(TABLES))
    ]
    table = int(np.argmin(sizes))
    header = bytes([VERSION, table]) + len(values).to_bytes(_COUNT_BYTES, "big") + _write_levels(values)
    return Coded(header, tuple(_write_tile(tile, table, len(values)) for tile in tiles))


def indices_of(depth: DepthArray) -> tuple[DepthArray, Indices]:
    """Return the (L,) levels of a depth image, ascending, and the (H, W) indices of its pixels' levels.

    Indices start at 1; 0 stands where nothing was measured.
    """
    there = np.zeros(65_536, np.bool_)
    there[depth] = True
    there[0] = False
    index_of = np.where(there, np.cumsum(there), 0).astype(np.int32)
    return np.flatnonzero(there).astype(np.uint16), index_of[depth]


def read_header(header: bytes) -> Levels:
    """Read the header of ``Coded``.

    Raises:
        InputError: it has another version, or is none.
    """
    if header and header[0] != VERSION:
        raise InputError(
            f"The depth image is coded by version {header[0]} of its tables, and this program has version "
            f"{VERSION}; install the sender's version of PacketMesh"
        )
    if len(header) < 2 + _COUNT_BYTES or header[1] >= len(TABLES):
        raise InputError(f"{len(header)} bytes are no list of depth levels; try to receive them again")
    count = int.from_bytes(header[2 : 2 + _COUNT_BYTES], "big")
    values, complete = _read_levels(np.frombuffer(header[2 + _COUNT_BYTES :], np.uint8).copy(), count)
    if not complete:
        raise InputError(
            f"{len(header)} bytes are no list of {count} depth levels; try to receive them again"
        )
    return Levels(header[1], values)


def decode_tile(stream: ByteArray, levels: Levels, shape: tuple[int, int]) -> DepthArray:
    """Decode a tile, or its first pixels from the first bytes of its stream.

    Args:
        stream: (B,) bytes before the first gap; at least one.
        levels: from the image's header.
        shape: (h, w) of the tile.

    Returns:
        (n,) depths of the first n of h * w pixels, row after row.

    Raises:
        InputError: no tile starts with these bytes.
    """
    tile = np.zeros(shape, np.int32)
    count = _read_tile(np.array(stream), _table(levels.table), tile, len(levels.values))
    if count == BROKEN:
        raise InputError(f"The {stream.size} bytes are no tile of depths; try to receive them again")
    return np.concatenate([np.zeros(1, np.uint16), levels.values])[tile.ravel()[:count]]


@cache
def _table(table: int) -> NDArray[np.int64]:
    return counts_of(np.load(SHIPPED_TABLES)[table])


def _write_tile(tile: Indices, table: int, level_count: int) -> bytes:
    if not tile.any():
        return b""
    return _code_whole(_table(table), tile, level_count).tobytes()


@compiled_with_arrays
def _code_whole(counts: NDArray[np.int64], tile: Indices, level_count: int) -> ByteArray:
    coder = writer(counts, MOST_WORDS_PER_PIXEL * tile.size)
    code_tile(WRITE, coder, tile, level_count)
    return finish(coder)


@compiled_with_arrays
def _read_tile(stream: ByteArray, counts: NDArray[np.int64], tile: Indices, level_count: int) -> int:
    return code_tile(READ, reader(counts, stream), tile, level_count)


def _write_levels(values: DepthArray) -> bytes:
    coder = writer(_even(), MOST_WORDS_PER_PIXEL * values.size)
    _code_gaps(WRITE, coder, np.diff(values.astype(np.int64), prepend=0))
    return finish(coder).tobytes()


def _read_levels(stream: ByteArray, count: int) -> tuple[DepthArray, bool]:
    """Return the levels, and whether the stream has them all, each below 65,536."""
    gaps = np.zeros(count, np.int64)
    coder = reader(_even(), stream)
    _code_gaps(READ, coder, gaps)
    values = np.cumsum(gaps)
    complete = not coder[arithmetic.STOPPED] and values.max(initial=0) < 65_536
    return values.astype(np.uint16), complete


def _even() -> NDArray[np.int64]:
    return counts_of(np.full(_NUMBERS * 2 * arithmetic.LONGEST, arithmetic.ONE // 2), trust=2)


@compiled
def _code_gaps(mode: Mode, coder: Coder, gaps: NDArray[np.int64]) -> None:
    """Code the steps from 0 to the first level and from each to the next, each by the size of the last."""
    digits = 0
    for place in range(gaps.size):
        slot = digits * 2 * arithmetic.LONGEST
        gaps[place] = code_number(mode, coder, slot, gaps[place])
        if coder[arithmetic.STOPPED]:
            return
        digits = 0
        while gaps[place] >> (digits + 1) > 0:
            digits += 1
