"""Depth as colour, safe for colour-blind eyes, with what cannot be known in magenta."""

from __future__ import annotations

import cv2
import numpy as np

from app.drawing.colors import HOLE
from app.jobs.records import Picture
from pipeline.types import ByteArray, DepthMap, FloatArray


def depth_range_m(depth: DepthMap) -> tuple[float, float]:
    """2nd and 98th percentile of the known depths."""
    known_m = depth.z_m[depth.valid]
    if not len(known_m):
        return 0.0, 1.0
    nearest_m, farthest_m = np.percentile(known_m, [2, 98])
    return float(nearest_m), float(max(farthest_m, nearest_m + 1e-3))


def depth_picture(depth: DepthMap, range_m: tuple[float, float], what: str) -> Picture:
    """Near is dark, far is bright, unknown is magenta."""
    nearest_m, farthest_m = range_m
    level = np.clip((depth.z_m - nearest_m) / (farthest_m - nearest_m), 0.0, 1.0)
    level = (np.nan_to_num(level) * 255).astype(np.uint8)
    rgb = cv2.cvtColor(cv2.applyColorMap(level, cv2.COLORMAP_CIVIDIS), cv2.COLOR_BGR2RGB)
    rgb[~depth.valid] = HOLE
    return Picture(
        rgb, f"{what}: dark {nearest_m:.1f} m to bright {farthest_m:.1f} m, magenta where there is none"
    )


def difference_picture(inferred: DepthMap, sensor: DepthMap, most_m: float = 0.3) -> Picture:
    """Inferred minus sensed depth: blue nearer, orange farther, white equal; grey where one is unknown."""
    difference_m = inferred.z_m - sensor.z_m
    rgb = _diverging(np.clip(difference_m / most_m, -1.0, 1.0))
    rgb[~np.isfinite(difference_m)] = (90, 90, 90)
    centimetres = most_m * 100
    return Picture(
        rgb,
        f"Inferred minus sensor: blue {centimetres:.0f} cm nearer, white equal, orange {centimetres:.0f} cm "
        "farther, grey where one is missing",
    )


def _diverging(level: FloatArray) -> ByteArray:
    """(H, W, 3) blue, white, orange for -1, 0, 1."""
    level = np.nan_to_num(level)[..., None]
    blue, white, orange = (np.array(color, float) for color in ((0, 90, 181), (250, 250, 250), (230, 120, 0)))
    rgb = np.where(level < 0, white + (white - blue) * level, white + (orange - white) * level)
    return rgb.astype(np.uint8)
