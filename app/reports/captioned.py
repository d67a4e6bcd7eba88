"""Pictures with title and legend, and GIFs of them."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from app.drawing.colors import BACKGROUND, HOLE, ramp
from app.drawing.legend import Legend
from pipeline.types import ByteArray

INK, SOFT, PAPER = (20, 24, 28), (74, 84, 94), (255, 255, 255)
EDGE_PX = 14
_COLORS = 256
_BAR_PX = 260


def captioned(rgb: ByteArray, title: str, note: str, legend: Legend) -> Image.Image:
    """Draw a picture between its title and its legend.

    Args:
        rgb: (H, W, 3).
        title: title in large letters.
        note: note in smaller letters after it, if there is room.
        legend: legend of the colours; an empty one takes no room.
    """
    height, width = rgb.shape[:2]
    size_px = min(max(width // 40, 13), 26)
    head_px = round(1.9 * size_px)
    foot_px = round(1.7 * size_px) if legend != Legend() else 0
    picture = Image.new("RGB", (width, head_px + height + foot_px), PAPER)
    pen = ImageDraw.Draw(picture)
    picture.paste(Image.fromarray(rgb), (0, head_px))
    pen.text((EDGE_PX, head_px // 2), title, INK, font(size_px), anchor="lm")
    left = EDGE_PX + pen.textlength(title, font(size_px)) + size_px
    small = font(round(0.75 * size_px))
    if left + pen.textlength(note, small) < width - EDGE_PX:
        pen.text((left, head_px // 2), note, SOFT, small, anchor="lm")
    if foot_px:
        _draw_legend(pen, legend, head_px + height + foot_px // 2, width, round(0.75 * size_px))
    return picture


def _draw_legend(pen: ImageDraw.ImageDraw, legend: Legend, middle: int, width: int, size_px: int) -> None:
    """Draw the legend in one row at this height, in smaller letters if it is long."""
    left, half = EDGE_PX, size_px // 2
    if legend.bar is not None:
        first, last = legend.bar.labels[0], legend.bar.labels[-1]
        pen.text((left, middle), first, INK, font(size_px), anchor="lm")
        left += round(pen.textlength(first, font(size_px))) + half
        for at, color in enumerate(ramp(np.arange(float(_BAR_PX)), _BAR_PX - 1.0, legend.bar.stops).tolist()):
            pen.line((left + at, middle - half, left + at, middle + half), tuple(color))
        pen.text((left + _BAR_PX + half, middle), last, INK, font(size_px), anchor="lm")
        return
    words = legend.text + "".join(text for text, _ in legend.swatches)
    room = width - 2 * EDGE_PX - 3 * size_px * len(legend.swatches)
    size_px = min(size_px, max(9, int(size_px * room / max(pen.textlength(words, font(size_px)), 1.0))))
    for text, color in legend.swatches:
        pen.rectangle((left, middle - half, left + 2 * half, middle + half), color)
        left += 3 * half
        pen.text((left, middle), text, INK, font(size_px), anchor="lm")
        left += round(pen.textlength(text, font(size_px))) + 2 * half
    pen.text((left, middle), legend.text, INK, font(size_px), anchor="lm")


def on_background(seen: ByteArray) -> ByteArray:
    """Return the (H, W, 3) picture of a mesh with the app's background where no ray met it."""
    return np.where((seen == HOLE).all(axis=2, keepdims=True), np.array(BACKGROUND, np.uint8), seen)


def png(picture: Image.Image) -> bytes:
    """Return the picture as a PNG file."""
    file = io.BytesIO()
    picture.save(file, "PNG")
    return file.getvalue()


def gif(frames: Sequence[Image.Image], stays_ms: Sequence[int]) -> bytes:
    """Return a GIF that repeats without end, in the colours of its last frame.

    Args:
        frames: pictures of one size.
        stays_ms: how long each is shown.
    """
    palette = frames[-1].quantize(_COLORS)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    file = io.BytesIO()
    stays = list(stays_ms)
    frames[0].save(file, "GIF", save_all=True, append_images=frames[1:], duration=stays, loop=0)
    return file.getvalue()


def font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return the font that comes with Pillow."""
    return ImageFont.load_default(size_px)
