"""Depth images as colour pictures, safe for colour-blind people, with unknown depth in magenta."""

from __future__ import annotations

import cv2
import numpy as np

from app.compute.records import ColorBar, Picture
from app.drawing.colors import BACKGROUND, CONFIDENCE_STOPS, HOLE, ramp
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray

UNKNOWN = (90, 90, 90)
NEARER, EQUAL, FARTHER = (0, 90, 181), (250, 250, 250), (230, 120, 0)
FARTHEST_OFF_M = 0.3
"""Difference at which the colour scale stops."""
BAR_STOPS = 9


def opaque(rgba: ByteArray) -> ByteArray:
    """Return (H, W, 3) a browser's (H, W, 4) picture of its view on the app's background.

    Rows are mixed one by one: all at once, a large picture would take gigabytes.
    """
    rgb: ByteArray = np.empty((*rgba.shape[:2], 3), np.uint8)
    for row, drawn in zip(rgb, rgba, strict=True):
        share = drawn[:, 3:] / 255.0
        row[:] = np.round(drawn[:, :3] * share + np.array(BACKGROUND) * (1.0 - share))
    return rgb


def depth_range_m(depth: DepthMap) -> tuple[float, float]:
    """Return the 2nd and 98th percentile of the known depths, at least 1 mm apart; 0 and 1 without any."""
    known_m = depth.z_m[depth.valid]
    if not len(known_m):
        return 0.0, 1.0
    nearest_m, farthest_m = np.percentile(known_m, [2, 98])
    return float(nearest_m), float(max(farthest_m, nearest_m + 1e-3))


def depth_picture(depth: DepthMap, range_m: tuple[float, float], what: str = "") -> Picture:
    """Draw depth: near is dark, far is bright, unknown is magenta; the caption begins with ``what``."""
    nearest_m, farthest_m = range_m
    level = np.clip((depth.z_m - nearest_m) / (farthest_m - nearest_m), 0.0, 1.0)
    rgb = cividis((np.nan_to_num(level) * 255).astype(np.uint8))
    rgb[~depth.valid] = HOLE
    stops = cividis(np.linspace(0, 255, BAR_STOPS).astype(np.uint8)[None])[0]
    labels = tuple(f"{value_m:.2f} m" for value_m in np.linspace(nearest_m, farthest_m, 3))
    meaning = f"dark {nearest_m:.1f} m to bright {farthest_m:.1f} m, magenta: no depth"
    return Picture(
        rgb,
        f"{what}: {meaning}" if what else meaning,
        ColorBar(tuple((int(r), int(g), int(b)) for r, g, b in stops), labels),
    )


def difference_picture(inferred: DepthMap, sensor: DepthMap, most_m: float = FARTHEST_OFF_M) -> Picture:
    """Draw inferred minus sensor depth: blue nearer, orange farther, white equal, grey unknown."""
    difference_m = inferred.z_m - sensor.z_m
    rgb = _diverging(np.clip(difference_m / most_m, -1.0, 1.0))
    rgb[~np.isfinite(difference_m)] = UNKNOWN
    centimetres = most_m * 100
    return Picture(
        rgb,
        f"Inferred minus sensor: blue {centimetres:.0f} cm nearer, white equal, orange {centimetres:.0f} "
        "cm farther, grey: one is missing",
        ColorBar((NEARER, EQUAL, FARTHER), (f"−{centimetres:.0f} cm", "0 cm", f"+{centimetres:.0f} cm")),
    )


def confidence_picture(confidence: FloatArray, flying: BoolArray, out_of_reach: BoolArray) -> Picture:
    """Draw confidence: higher is brighter; flying pixels magenta; grey if unknown or too far from
    measurements.

    Args:
        confidence: (H, W) from 0 to 1, NaN where nothing is inferred.
        flying: (H, W) pixels at a depth step that belong to neither side.
        out_of_reach: (H, W) pixels too far from measured ones.
    """
    rgb = confidence_colors(confidence)
    rgb[out_of_reach | ~np.isfinite(confidence)] = UNKNOWN
    rgb[flying] = HOLE
    return Picture(
        rgb,
        "Confidence in the inferred depth: dark low, bright high; magenta: flying pixels at an edge, "
        "grey: out of reach",
        ColorBar(CONFIDENCE_STOPS, ("0 %", "50 %", "100 %")),
    )


def confidence_colors(confidence: FloatArray) -> ByteArray:
    """Return RGB (last axis 3) of confidences from 0 to 1; the darkest colour for NaN."""
    return ramp(np.nan_to_num(confidence), 1.0, CONFIDENCE_STOPS)


def cividis(level: ByteArray) -> ByteArray:
    """Return (H, W, 3) RGB of (H, W) levels from 0 to 255."""
    return cv2.cvtColor(cv2.applyColorMap(level, cv2.COLORMAP_CIVIDIS), cv2.COLOR_BGR2RGB)


def _diverging(level: FloatArray) -> ByteArray:
    """Return (H, W, 3) RGB: blue, white, orange for -1, 0, 1."""
    level = np.nan_to_num(level)[..., None]
    blue, white, orange = (np.array(color, float) for color in (NEARER, EQUAL, FARTHER))
    rgb = np.where(level < 0, white + (white - blue) * level, white + (orange - white) * level)
    return rgb.astype(np.uint8)
