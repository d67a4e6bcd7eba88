"""The lanes of a timeline as a picture for slides and papers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from app.drawing.timeline import Lane
from app.reports.captioned import EDGE_PX, INK, PAPER, SOFT, font

WIDTH_PX = 1600
_TITLE_PX, _AXIS_PX, _FOOT_PX, _GAP_PX, _RIGHT_PX = 54, 34, 40, 12, 40
_TICKS = 10
_SCALE = 2
"""Factor by which the lanes are higher than in the app."""


def timeline_picture(title: str, lanes: Sequence[Lane], start_ns: int, end_ns: int) -> Image.Image:
    """Draw all lanes from start to end with names, words and seconds, ``WIDTH_PX`` wide."""
    heights = [_SCALE * lane.height_px for lane in lanes]
    size = WIDTH_PX, _TITLE_PX + sum(heights) + _GAP_PX * len(lanes) + _AXIS_PX + _FOOT_PX
    picture = Image.new("RGB", size, PAPER)
    pen = ImageDraw.Draw(picture)
    pen.text((EDGE_PX, _TITLE_PX // 2), title, INK, font(28), anchor="lm")
    names = [label.text for lane in lanes for label in lane.labels(end_ns)]
    left = 2 * EDGE_PX + round(max(pen.textlength(name, font(20)) for name in names))
    wide = WIDTH_PX - left - _RIGHT_PX
    top = _TITLE_PX
    for lane, high in zip(lanes, heights, strict=True):
        rgb = np.zeros((lane.height_px, wide, 3), np.uint8)
        lane.draw(rgb, start_ns, end_ns)
        picture.paste(Image.fromarray(rgb).resize((wide, high), Image.Resampling.BICUBIC), (left, top))
        for label in lane.labels(end_ns):
            place = left - EDGE_PX, top + round(_SCALE * label.y_px)
            pen.text(place, label.text, label.color, font(20), anchor="rm")
        for word in lane.words(start_ns, end_ns, wide):
            middle = 0.5 * (word.start_ns + word.end_ns - 2 * start_ns) / (end_ns - start_ns)
            pen.text((left + middle * wide, top + _SCALE * word.y_px), word.text, INK, font(18), anchor="mm")
        top += high + _GAP_PX
    _axis(pen, left, wide, top - _GAP_PX, (start_ns, end_ns))
    at = left
    for text, color in dict(entry for lane in lanes for entry in lane.legend).items():
        middle = size[1] - _FOOT_PX // 2
        pen.rectangle((at, middle - 8, at + 16, middle + 8), color)
        pen.text((at + 24, middle), text, SOFT, font(19), anchor="lm")
        at += 48 + round(pen.textlength(text, font(19)))
    return picture


def _axis(pen: ImageDraw.ImageDraw, left: int, wide: int, top: int, span_ns: tuple[int, int]) -> None:
    """Draw ticks at round times."""
    start_s, end_s = (ns / 1e9 for ns in span_ns)
    least_s = max(end_s - start_s, 1e-9) / _TICKS
    ten = 10.0 ** np.floor(np.log10(least_s))
    step_s = next(each * ten for each in (1.0, 2.0, 5.0, 10.0) if each * ten >= 0.999 * least_s)
    for t_s in np.arange(np.ceil(start_s / step_s), end_s / step_s + 1e-6) * step_s:
        x = left + round((t_s - start_s) / (end_s - start_s) * wide)
        pen.line((x, top, x, top + 8), SOFT, 2)
        pen.text((x, top + 21), f"{t_s:.6g} s", INK, font(19), anchor="mm")
