"""Decoder of RVL, a lossless code of depth (Wilson, "Fast lossless depth image compression", ISS 2017)."""

from __future__ import annotations

import numba
import numpy as np

from pipeline.types import IntArray

MAX_PIXELS = 50_000_000


def decode_rvl(data: bytes, width_px: int, height_px: int) -> IntArray:
    """Decode (H, W) uint16 depth: alternating runs of zeros and of differences, in groups of three bits.

    Raises:
        ValueError: the data end too early or have more pixels than the image, or it exceeds ``MAX_PIXELS``.
    """
    if not 0 < width_px * height_px <= MAX_PIXELS:
        raise ValueError(f"an image of {width_px} x {height_px} pixels")
    words = np.frombuffer(data, "<u4", len(data) // 4).astype(np.uint32)
    pixels = np.zeros(width_px * height_px, np.uint16)
    if not _decoded(words, pixels):
        raise ValueError("data that end too soon or hold too many pixels")
    return pixels.reshape(height_px, width_px)


@numba.njit(cache=True, nogil=True)
def _number(words, nibble):  # type: ignore[no-untyped-def]
    """Decode the number at a nibble; returns it and the next nibble's index, or -1 at the words' end."""
    value, shift = 0, 0
    while True:
        if nibble >= 8 * len(words) or shift > 30:
            return -1, nibble
        four = (words[nibble // 8] >> (28 - 4 * (nibble % 8))) & 15
        nibble += 1
        value |= (four & 7) << shift
        shift += 3
        if not four & 8:
            return value, nibble


@numba.njit(cache=True, nogil=True)
def _decoded(words, pixels):  # type: ignore[no-untyped-def]
    """Decode into ``pixels``; returns False if the words end too early or contain too many."""
    nibble, at, previous = 0, 0, 0
    while at < len(pixels):
        zeros, nibble = _number(words, nibble)
        if zeros < 0 or at + zeros > len(pixels):
            return False
        at += zeros
        values, nibble = _number(words, nibble)
        if values < 0 or at + values > len(pixels) or (zeros == 0 and values == 0):
            return False
        for _ in range(values):
            folded, nibble = _number(words, nibble)
            if folded < 0:
                return False
            previous += (folded >> 1) ^ -(folded & 1)
            pixels[at] = previous & 65535
            at += 1
    return True
