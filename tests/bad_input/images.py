"""Images that are bad in ways of their own."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from tests.bad_input.geometry import Made
from tests.bad_input.makers import evil_npy, jpeg_of, npy_header, packed_tiff, png_of, tiff_of
from tests.bad_input.samples import HEIGHT, METRES, MM, WIDTH, data_of, npy, opencv, pfm

SIDE_PX = 30_000


def images() -> Iterator[Made]:
    for name, deep in (("color.png", False), ("depth.png", True)):
        yield name, "30,000 x 30,000", lambda deep=deep: png_of(SIDE_PX, SIDE_PX, deep)
        yield name, "30,000 x 30,000 by its header", png_of(SIDE_PX, SIDE_PX, deep, whole=False)
        yield name, "2^31 x 2^31", png_of(2**31 - 1, 2**31 - 1, deep, whole=False)
        yield name, "0 x 0", png_of(0, 0, deep, whole=False)
        yield name, "2^32 - 1 wide", png_of(2**32 - 1, 1, deep, whole=False)
        yield name, "rows that are not there", png_of(WIDTH, 5000, deep, whole=False)
    sizes = ((SIDE_PX, SIDE_PX), (0, 9), (-3, 4), (10**9, 10**9), (99_999, 1))
    for width, height in sizes:
        size = f"{width} x {height}"
        yield "color.ppm", size, f"P6 {width} {height} 255\n".encode() + bytes(300)
        yield "depth.pgm", size, f"P5 {width} {height} 65535\n".encode() + bytes(300)
        yield "depth.pfm", size, f"Pf\n{width} {height}\n-1.0\n".encode() + bytes(300)
        yield "color.npy", size, npy_header((height, width, 3), "|u1") + bytes(300)
        yield "depth.npy", size, npy_header((height, width), "<u2") + bytes(300)
        yield "map.bin", size, f"{width}&{height}&1&".encode() + bytes(300)
    yield "color.jpg", "65,535 x 65,535", jpeg_of(65_535, 65_535)
    yield "color.jpg", "0 x 0", jpeg_of(0, 0)
    for kind, order in (("<", b"II*\0"), (">", b"MM\0*")):
        for side in (SIDE_PX, 2**31, 0):
            yield "color.tif", f"{side} x {side} ({order[:2].decode()})", tiff_of(side, side, kind, order)
            yield "depth.tif", f"{side} x {side} ({order[:2].decode()})", tiff_of(side, side, kind, order)
    yield "depth.tif", "a folder that follows itself", tiff_of(4, 4, "<", b"II*\0", next_at=8)
    yield "color.tif", "30,000 x 30,000, well packed", lambda: packed_tiff(SIDE_PX)
    yield "depth.npy", "all NaN", npy(np.full((HEIGHT, WIDTH), np.nan, np.float32))
    yield "depth.npy", "infinite", npy(np.full((HEIGHT, WIDTH), np.inf, np.float32))
    yield "depth.npy", "pickled", npy(np.array([[{}]], object))
    yield "depth.npy", "a bad pickle", evil_npy()
    yield "color.npy", "complex", npy(np.ones((4, 4), complex))
    yield "color.npy", "seven dimensions", npy(np.ones((1,) * 7))
    yield "depth.npy", "no dimension", npy(np.float32(3.0))
    yield "depth.npy", "text", npy(np.array([["a", "b"]]))
    yield "depth.pfm", "NaN", pfm(np.full_like(METRES, np.nan))
    yield "depth.pfm", "the wrong byte order", pfm(METRES, "<").replace(b"-1.0", b"01.0")
    yield "depth.png", "zero everywhere", opencv(np.zeros_like(MM), ".png")
    good = data_of("depth.exr")
    at = good.index(b"dataWindow\0box2i\0") + 17 + 4
    for corner in (SIDE_PX, 2**31 - 1, -1):
        window = struct.pack("<iiii", 0, 0, corner, corner)
        yield "depth.exr", f"to {corner}, {corner}", good[:at] + window + good[at + 16 :]
