"""Bytes of depth and colour images: our codings and other programs', lossless and at equal likeness."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any

import cv2
import numpy as np

from lab.benchmarks.benchmark import Benchmark
from lab.claims.depth.scenes import demo_scenes, real_frames, user_sets
from lab.training.dataset import FIRST_SEED
from lab.training.level_tables import sensed_views
from packetmesh.memory import peak_memory_bytes
from pipeline.delivery import levels, rvl, tiled
from pipeline.delivery.coding import DepthArray, areas_of
from pipeline.delivery.pictures import (
    read_av1,
    read_picture,
    read_scan,
    write_av1,
    write_jpeg,
    write_png,
    write_scan,
)
from pipeline.delivery.sink import units_per_m
from pipeline.types import ByteArray, DepthMap

ROOMS = 24
"""Held-out rooms of one view each."""
REGISTERED = ", registered"
QUALITIES = (40, 99)
"""Least and largest quality that is tried for a likeness."""
ZSTD_LEVEL = 19
Row = dict[str, Any]
Packed = bytes | bytearray
Image = tuple[str, ByteArray, DepthArray]
"""Group, (H, W, 3) RGB and (H, W) depth in the camera's units."""


@dataclass(frozen=True, slots=True)
class DepthCoder:
    """A lossless coder of depth images."""

    name: str
    pieces: str
    """Part of the image that is lost with a lost byte."""
    write: Callable[[DepthArray], list[Packed]]
    read: Callable[[list[Packed], tuple[int, int]], DepthArray]


@dataclass(frozen=True, slots=True)
class ColorCoder:
    """A coder of colour images, whose quality is from 0 to 100."""

    name: str
    side_px: int
    """Side of the pieces; 0 for whole images."""
    write: Callable[[ByteArray, int], bytes]
    read: Callable[[bytes, tuple[int, int], int], ByteArray]


def benchmark(rooms: int = ROOMS) -> Benchmark:
    """Encode all images with all coders; the time is the median of our encoding of a depth image.

    Args:
        rooms: number of held-out rooms.
    """
    images = list(_images(rooms))
    rows = [*_depth_rows(images), *_color_rows(images)]
    ours = [row["encode_s"] for row in rows if row["coder"] == "levels"]
    return Benchmark(
        statistics.median(ours), {}, peak_memory_bytes(), runs=tuple(rows), notes=tuple(map(_line, rows))
    )


def _images(rooms: int) -> Iterator[Image]:
    """Yield the images, group after group; the quality of AVIF was chosen on the validation rooms."""
    for split, group in (("validation", "validation rooms"), ("test", "held-out rooms")):
        views = [view for seed in range(rooms) for view in sensed_views(FIRST_SEED[split] + seed, views=1)]
        yield from ((group, view.rgb, view.depth) for view in views)
        yield from ((f"{group}{REGISTERED}", view.rgb, view.registered) for view in views)
    for site in (*demo_scenes(), *real_frames(), *user_sets()):
        yield from ((site.group, example.rgb, _units(example.sensor)) for example in site.examples())


def _units(depth: DepthMap) -> DepthArray:
    z_m = np.where(depth.valid, depth.z_m, 0.0).astype(np.float64)
    return np.rint(z_m * units_per_m(depth)).astype(np.uint16)


def _depth_rows(images: Sequence[Image]) -> Iterator[Row]:
    for group, members in groupby(images, key=lambda image: image[0]):
        depths = [depth for _, _, depth in members]
        base = sum(len(rvl.encode(depth)) for depth in depths)
        for coder in depth_coders():
            coded, encode_s = zip(*(_timed(partial(coder.write, depth)) for depth in depths), strict=True)
            both = zip(coded, depths, strict=True)
            read, decode_s = zip(
                *(_timed(partial(coder.read, pieces, depth.shape)) for pieces, depth in both), strict=True
            )
            size = sum(len(piece) for pieces in coded for piece in pieces)
            yield {
                "kind": "depth",
                "group": group,
                "coder": coder.name,
                "pieces": coder.pieces,
                "images": len(depths),
                "kb": size / 1e3 / len(depths),
                "of_base": size / base,
                "exact": all(map(np.array_equal, read, depths)),
                "encode_s": statistics.median(encode_s),
                "decode_s": statistics.median(decode_s),
            }


def _color_rows(images: Sequence[Image]) -> Iterator[Row]:
    for group, members in groupby(images, key=lambda image: image[0]):
        found = [(rgb, depth) for _, rgb, depth in members]
        if group.endswith(REGISTERED):  # the colours are those of the group before
            continue
        base = [write_jpeg(rgb) for rgb, _ in found]
        wanted = [likeness(rgb, read_picture(jpeg)) for (rgb, _), jpeg in zip(found, base, strict=True)]
        for coder in COLOR_CODERS:
            rows = [
                _at_likeness(coder, rgb, depth, least)
                for (rgb, depth), least in zip(found, wanted, strict=True)
            ]
            yield {
                "kind": "color",
                "group": group,
                "coder": coder.name,
                "pieces": f"{coder.side_px} px" if coder.side_px else "whole",
                "images": len(found),
                "kb": sum(row["bytes"] for row in rows) / 1e3 / len(rows),
                "of_base": sum(row["bytes"] for row in rows) / sum(map(len, base)),
                **{
                    name: statistics.median(row[name] for row in rows)
                    for name in ("quality", "ssim", "rmse", "encode_s", "decode_s")
                },
            }


def _at_likeness(coder: ColorCoder, rgb: ByteArray, depth: DepthArray, least: float) -> Row:
    """Return size and errors of an image at the lowest quality at which it is at least so like its original.

    ``rmse`` is over the pixels with depth, whose colours are those of the surface's vertices, of 255.
    """
    low, high = QUALITIES
    while low < high:
        middle = (low + high) // 2
        if likeness(rgb, _coded(coder, rgb, middle)[1]) >= least:
            high = middle
        else:
            low = middle + 1
    size, image, encode_s, decode_s = _coded(coder, rgb, low)
    error = rgb[depth > 0].astype(np.float64) - image[depth > 0]
    return {
        "bytes": size,
        "quality": low,
        "ssim": likeness(rgb, image),
        "rmse": float(np.sqrt(np.mean(error**2))),
        "encode_s": encode_s,
        "decode_s": decode_s,
    }


def _coded(coder: ColorCoder, rgb: ByteArray, quality: int) -> tuple[int, ByteArray, float, float]:
    """Return bytes, decoded image, and seconds of encoding and decoding."""
    image, size, encode_s, decode_s = np.zeros_like(rgb), 0, 0.0, 0.0
    for area in areas_of(rgb.shape, coder.side_px or max(rgb.shape)):
        piece, spent_s = _timed(partial(coder.write, np.ascontiguousarray(rgb[area]), quality))
        size, encode_s = size + len(piece), encode_s + spent_s
        image[area], spent_s = _timed(partial(coder.read, piece, rgb[area].shape[:2], quality))
        decode_s += spent_s
    return size, image, encode_s, decode_s


def likeness(image: ByteArray, other: ByteArray) -> float:
    """Return the mean SSIM of the grey values of two images (Wang et al. 2004, Gaussian window of 1.5 px)."""
    one, two = (cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float64) for rgb in (image, other))
    mean = partial(cv2.GaussianBlur, ksize=(11, 11), sigmaX=1.5)
    a, b = mean(one), mean(two)
    varied, common = mean(one * one) + mean(two * two) - a * a - b * b, mean(one * two) - a * b
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return float(np.mean((2 * a * b + c1) * (2 * common + c2) / ((a * a + b * b + c1) * (varied + c2))))


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    started = time.perf_counter()
    return work(), time.perf_counter() - started


def depth_coders() -> list[DepthCoder]:
    """Return ours and its peers; those of ``imagecodecs``, a development dependency, only if it is there."""
    ours = DepthCoder("levels", "32 px, up to the gap", _write_levels, _read_levels)
    whole = [
        DepthCoder(
            "PNG", "whole", lambda depth: [write_png(depth)], lambda pieces, _: read_picture(bytes(pieces[0]))
        ),
        DepthCoder(
            "RVL",
            "whole, up to the gap",
            lambda depth: [rvl.encode(depth)],
            lambda pieces, shape: _rvl(pieces[0], shape),
        ),
    ]
    try:
        import imagecodecs as peers
    except ImportError:
        return [ours, *whole]
    whole.append(
        DepthCoder(
            "RVL, Zstandard",
            "whole",
            lambda depth: [peers.zstd_encode(rvl.encode(depth), ZSTD_LEVEL)],
            lambda pieces, shape: _rvl(peers.zstd_decode(pieces[0]), shape),
        )
    )
    strip = (32, 1 << 16)
    cut = [
        _cut("JPEG-LS", "whole", (1 << 16, 1 << 16), peers.jpegls_encode, peers.jpegls_decode),
        _cut("JPEG-LS", "strips of 32 rows", strip, peers.jpegls_encode, peers.jpegls_decode),
    ]
    for effort in (2, 7):
        write = partial(peers.jpegxl_encode, lossless=True, effort=effort, numthreads=1)
        for pieces, size in (
            ("whole", (1 << 16, 1 << 16)),
            ("128 px", (128, 128)),
            ("64 px", (64, 64)),
            ("32 px", (32, 32)),
        ):
            cut.append(_cut(f"JPEG XL, effort {effort}", pieces, size, write, peers.jpegxl_decode))
    return [ours, *whole, *cut]


def _cut(
    name: str,
    pieces: str,
    size: tuple[int, int],
    write: Callable[[DepthArray], Packed],
    read: Callable[[Packed], DepthArray],
) -> DepthCoder:
    """Return a coder of pieces of (rows, columns), each of which is a file."""

    def areas(shape: tuple[int, ...]) -> list[tuple[slice, slice]]:
        return [
            (slice(top, top + size[0]), slice(left, left + size[1]))
            for top in range(0, shape[0], size[0])
            for left in range(0, shape[1], size[1])
        ]

    def encode(depth: DepthArray) -> list[Packed]:
        tiles = [np.ascontiguousarray(depth[area]) for area in areas(depth.shape)]
        return [write(tile) if tile.any() else b"" for tile in tiles]

    def decode(coded: list[Packed], shape: tuple[int, int]) -> DepthArray:
        depth = np.zeros(shape, np.uint16)
        for area, piece in zip(areas(shape), coded, strict=True):
            if piece:
                depth[area] = read(piece).reshape(depth[area].shape)
        return depth

    return DepthCoder(name, pieces, encode, decode)


def _write_levels(depth: DepthArray) -> list[Packed]:
    coded = levels.encode(depth, areas_of(depth.shape, tiled.TILE))
    return [coded.header, *coded.tiles]


def _read_levels(pieces: list[Packed], shape: tuple[int, int]) -> DepthArray:
    listed, depth = levels.read_header(bytes(pieces[0])), np.zeros(shape, np.uint16)
    for area, piece in zip(areas_of(shape, tiled.TILE), pieces[1:], strict=True):
        if piece:
            tile = depth[area].shape
            depth[area] = levels.decode_tile(np.frombuffer(piece, np.uint8), listed, tile).reshape(tile)
    return depth


def _rvl(stream: Packed, shape: tuple[int, int]) -> DepthArray:
    return rvl.decode(np.frombuffer(stream, np.uint8), shape[0] * shape[1]).reshape(shape)


COLOR_CODERS = (
    ColorCoder("JPEG", 0, write_jpeg, lambda stream, _, __: read_picture(stream)),
    ColorCoder("JPEG", 32, write_scan, read_scan.__wrapped__),
    *(ColorCoder("AVIF", side_px, write_av1, read_av1.__wrapped__) for side_px in (0, 128, 64, 32)),
)
"""Pieces are without headers; readers are those without a cache."""


def _line(row: Row) -> str:
    """Return a row as a line of text."""
    base = "RVL" if row["kind"] == "depth" else "JPEG"
    line = (
        f"{row['kind']}, {row['group']} ({row['images']}): {row['coder']}, {row['pieces']}: "
        f"{row['kb']:.1f} kB, {row['of_base']:.2f} of {base}'s, encoded in {1e3 * row['encode_s']:.0f} ms, "
        f"decoded in {1e3 * row['decode_s']:.0f} ms"
    )
    if "ssim" not in row:
        return line
    return f"{line}; quality {row['quality']:.0f}, SSIM {row['ssim']:.4f}, {row['rmse']:.2f} off"
