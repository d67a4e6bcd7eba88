"""Views of points from above and from the sides, from far enough that all points are in the picture."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

import numpy as np

from app.drawing.cameras import distances_m
from pipeline.types import FloatArray

Side: TypeAlias = Literal["above", "front", "back", "left", "right"]
"""Where the view stands; the front is the side on which the camera nodes stand."""
SIDES: tuple[Side, ...] = get_args(Side)
STEEPEST_RAD = np.radians(89.5)
"""Slope of a view from above: viser's views turn around the vertical and cannot look along it."""
MARGIN = 0.9
"""Share of the picture's width and height that the points may fill."""
OUTER_PERCENT = 0.5
"""Share of the points on each side that may lie outside: single wrong points must not shrink all others."""
LEAST_M = 0.05
UP = np.array([0.0, 0.0, 1.0])


def forward_of(side: Side, gaze: FloatArray) -> FloatArray:
    """Return (3,) the unit direction in which a view looks.

    Args:
        side: where the view stands.
        gaze: (3,) mean direction in which the camera nodes look.
    """
    level = np.array([gaze[0], gaze[1], 0.0])
    length = float(np.linalg.norm(level))
    level = level / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    right = np.cross(level, UP)
    sides = {"front": level, "back": -level, "left": right, "right": -right}
    if side != "above":
        return sides[side]
    return np.asarray(np.cos(STEEPEST_RAD) * level - np.sin(STEEPEST_RAD) * UP)


def fitting(
    points_m: FloatArray, forward: FloatArray, fov_rad: float, aspect: float
) -> tuple[FloatArray, FloatArray]:
    """Return (3,) a point to look at and (3,) a place to stand from which the points fill the picture.

    Args:
        points_m: (N, 3) points in the world frame, metres.
        forward: (3,) unit direction of the view, not vertical.
        fov_rad: vertical field of view.
        aspect: the picture's width over its height.
    """
    right = np.cross(forward, UP)
    right /= float(np.linalg.norm(right))
    axes = np.stack([right, np.cross(right, forward), forward])
    along_m = points_m @ axes.T
    low_m, high_m = np.percentile(along_m, [OUTER_PERCENT, 100.0 - OUTER_PERCENT], axis=0)
    middle_m = 0.5 * (low_m + high_m)
    half_height = MARGIN * np.tan(0.5 * fov_rad)
    kept = np.all((along_m >= low_m) & (along_m <= high_m), axis=1)
    apart_m = (along_m[kept] if kept.any() else along_m) - middle_m
    away_m = max(float(distances_m(apart_m, half_height * aspect, half_height).max()), LEAST_M)
    center_m = middle_m @ axes
    return center_m, center_m - away_m * forward


def ball_m(center_m: FloatArray, stand_m: FloatArray, fov_rad: float, aspect: float) -> FloatArray:
    """Return (26, 3) points of a sphere around a view's look-at point that just fits into its picture."""
    steps = np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1).T
    steps = steps[np.any(steps != 0.0, axis=1)]
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    half = np.arctan(MARGIN * np.tan(0.5 * fov_rad) * min(1.0, aspect))
    radius_m = float(np.linalg.norm(stand_m - center_m)) * np.sin(half)
    return np.asarray(center_m + radius_m * steps)
