"""The scale bar and the axes of *Look* in a picture of the view, as the page draws them over its own."""

from __future__ import annotations

import re
from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.types import ByteArray

_NUMBER = r"\d{1,9}(?:\.\d{1,9})?"
_AXIS = rf"[xyz],-?{_NUMBER},-?{_NUMBER}"
BAR = rf"({_NUMBER}) ({_NUMBER} (?:mm|cm|m)) ({_NUMBER}) ({_AXIS};{_AXIS};{_AXIS})"
"""The page's text of its scale bar: width of the bar, CSS pixels; length; distance at which it holds, metres;
the axes, the farthest first: name, and direction to the right and up.
"""
COLORS = {"x": (192, 31, 31), "y": (24, 122, 24), "z": (31, 63, 192)}
INK, PAPER_SHARE = (34, 40, 46), 0.78
"""Colour of bar and text, and opacity of the white below them."""
MARGIN, AXES, AXIS, NAME = 10.0, 76.0, 26.0, 33.0
"""Distance from the corner, size of the drawing of the axes, length of an axis and distance of its name, CSS
pixels, as in ``looking/scale.css``.
"""
MOST_BAR = 400.0
"""Longest bar, CSS pixels; the page's is 160."""


@dataclass(frozen=True, slots=True)
class ScaleBar:
    """A scale bar with the directions of the world's axes."""

    width: float
    """CSS pixels."""
    length: str
    """Length with its unit."""
    away_m: str
    """Distance from the camera at which it holds."""
    axes: tuple[tuple[str, float, float], ...]
    """Name, and direction to the right and up, at most 1 long; the farthest first."""


def bar_of(text: str) -> ScaleBar | None:
    """Return the bar of the page's text; None without one, or if the text is none."""
    found = re.fullmatch(BAR, text)
    if found is None or not 0.0 < float(found[1]) <= MOST_BAR:
        return None
    named = (axis.split(",") for axis in found[4].split(";"))
    axes = tuple((name, float(right), float(up)) for name, right, up in named)
    if any(max(abs(right), abs(up)) > 1.0 for _, right, up in axes):
        return None
    return ScaleBar(float(found[1]), found[2], found[3], axes)


def draw_bar(rgb: ByteArray, bar: ScaleBar, times: int) -> None:
    """Draw a bar into the lower left corner of a picture.

    Args:
        rgb: (H, W, 3) picture, which is changed.
        bar: the bar.
        times: pixels of the picture in a CSS pixel.
    """
    left, bottom = MARGIN, rgb.shape[0] / times - MARGIN
    note = f"{bar.away_m} m away, where the view turns"
    beside = left + AXES + 8.0
    width = AXES + 18.0 + max(bar.width, _width(note, 12.0, times), _width(bar.length, 14.0, times))
    top, right = bottom - AXES - 8.0, left + width
    (x, y), (x_end, y_end) = (_pixels(*corner, times) for corner in ((left, top), (right, bottom)))
    paper = rgb[max(y, 0) : y_end, x:x_end]
    paper[:] = np.round(255.0 * PAPER_SHARE + (1.0 - PAPER_SHARE) * paper)
    middle = np.array([left + 2.0 + 0.5 * AXES, bottom - 6.0 - 0.5 * AXES])
    for name, across, up in bar.axes:
        direction = np.array([across, -up])
        tip = middle + AXIS * direction
        begin, end = _pixels(middle[0], middle[1], times), _pixels(tip[0], tip[1], times)
        cv2.line(rgb, begin, end, COLORS[name], round(2.2 * times), cv2.LINE_AA)
        at = middle + NAME * direction
        _write(rgb, name, (at[0] - 0.5 * _width(name, 13.0, times), at[1] + 4.0), 13.0, COLORS[name], times)
    level = bottom - 44.0
    ends = [
        (beside, level - 5.0),
        (beside, level),
        (beside + bar.width, level),
        (beside + bar.width, level - 5.0),
    ]
    corners = np.array([_pixels(*end, times) for end in ends], np.int32)
    cv2.polylines(rgb, [corners], False, INK, 2 * times, cv2.LINE_AA)
    _write(rgb, bar.length, (beside, bottom - 26.0), 14.0, INK, times)
    _write(rgb, note, (beside, bottom - 9.0), 12.0, INK, times)


_FONT, _FONT_PX = cv2.FONT_HERSHEY_SIMPLEX, 30.0
"""OpenCV's font, and the size of its text at scale 1."""


def _width(text: str, size: float, times: int) -> float:
    """Return the width of a text of that size, both in CSS pixels."""
    (width_px, _), _ = cv2.getTextSize(text, _FONT, times * size / _FONT_PX, times)
    return float(width_px) / times


def _write(
    rgb: ByteArray, text: str, at: tuple[float, float], size: float, color: tuple[int, int, int], times: int
) -> None:
    """Write a text with its lower left corner ``at`` a place, CSS pixels."""
    cv2.putText(rgb, text, _pixels(*at, times), _FONT, times * size / _FONT_PX, color, times, cv2.LINE_AA)


def _pixels(x: float, y: float, times: int) -> tuple[int, int]:
    return round(x * times), round(y * times)
