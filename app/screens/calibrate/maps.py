"""Maps over a camera's image, as pictures of the size of its photographs."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from app.compute.records import ColorBar, Picture
from app.drawing.colors import DELIVERED, DISTANCE_STOPS, LOSS, NEUTRAL, SOURCE, ramp
from app.drawing.pictures import EQUAL, FARTHER, NEARER, UNKNOWN
from app.screens.calibrate.view import WarpView
from pipeline.calibration.diagnosis import Coverage
from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.calibration.next_view import NextView
from pipeline.types import ByteArray, FloatArray

PAPER = 245
NO_POINTS = (228, 228, 228)
WARP_WIDTH_PX, LEAST_WARP_M = 400, 5e-4
"""Width of the picture of a bent board, and least deviation at which its colour scale ends, metres."""
SHIFT = 4
"""Number of fraction bits of OpenCV's drawing coordinates."""


def map_picture(error_m: FloatArray, most_m: float, size_px: tuple[int, int], what: str) -> Picture:
    """Draw errors in mm over the image, dark for zero; grey where the lens has no ray.

    Args:
        error_m: (R, C) errors of the cells; NaN where the lens has no ray.
        most_m: error at which the colour scale ends.
        size_px: width and height of the picture.
        what: start of the caption.
    """
    known = np.isfinite(error_m)
    filled = np.where(known, error_m, most_m).astype(np.float32)
    fine = cv2.resize(filled, size_px, interpolation=cv2.INTER_CUBIC)
    rgb = ramp(np.clip(fine, 0.0, most_m), most_m, DISTANCE_STOPS)
    rgb[cv2.resize(known.astype(np.uint8), size_px, interpolation=cv2.INTER_NEAREST) == 0] = UNKNOWN
    middle = error_m[error_m.shape[0] // 2, error_m.shape[1] // 2]
    worst = float(np.nanmax(error_m))
    labels = tuple(f"{1000.0 * value:.2g} mm" for value in np.linspace(0.0, most_m, 3))
    caption = f"{what} {1000.0 * middle:.2g} mm in the middle, {1000.0 * worst:.2g} mm at worst"
    return Picture(rgb, caption, ColorBar(DISTANCE_STOPS, labels))


def coverage_picture(
    coverage: Coverage, views: Sequence[FittedView], zoom: float, size_px: tuple[int, int]
) -> Picture:
    """Draw the number of points per cell of the image, light grey for none, and the points of the views."""
    most = max(int(coverage.counts.max()), 1)
    cells = ramp(coverage.counts.astype(float), float(most), DISTANCE_STOPS)
    cells[coverage.counts == 0] = NO_POINTS
    rgb = cv2.resize(cells, size_px, interpolation=cv2.INTER_NEAREST)
    for view in views:
        _dots(rgb, view.points_px * zoom, SOURCE, 1)
    return Picture(
        rgb,
        f"Points of all views, in {coverage.share:.0%} of the cells; grey: none, so the lens is "
        "extrapolated there",
        ColorBar(DISTANCE_STOPS, ("1", f"{most:,} points per cell")),
    )


def next_picture(following: NextView, lens: Calibration, zoom: float, size_px: tuple[int, int]) -> Picture:
    """Draw where to hold the board next, over the points seen so far."""
    rgb = np.full((size_px[1], size_px[0], 3), PAPER, np.uint8)
    for view in lens.views:
        _dots(rgb, view.points_px * zoom, NEUTRAL, 1)
    outline = np.rint(following.outline_px * zoom * (1 << SHIFT)).astype(np.int32)
    cv2.polylines(rgb, [outline], True, DELIVERED, 3, cv2.LINE_AA, shift=SHIFT)
    _dots(rgb, following.points_px * zoom, DELIVERED, 4)
    _dots(rgb, following.points_px[:1] * zoom, LOSS, 7)
    return Picture(
        rgb,
        "Best next view of the board (green, its first circle red; grey: points so far): "
        f"{following.distance_m:.2f} m away, tilted by {following.tilt_deg:.0f}°. Predicted error: "
        f"{1000.0 * following.error_before_m:.2g} mm → {1000.0 * following.error_after_m:.2g} mm",
    )


def off_picture(off_m: FloatArray, most_m: float, zoom: float, what: str) -> Picture:
    """Draw (H, W) depth errors, metres: blue too near, white correct, orange too far, grey unknown."""
    rgb = ramp(
        np.clip(np.nan_to_num(off_m), -most_m, most_m) + most_m, 2.0 * most_m, (NEARER, EQUAL, FARTHER)
    )
    known = np.isfinite(off_m)
    rgb[~known] = UNKNOWN
    size_px = (round(off_m.shape[1] * zoom), round(off_m.shape[0] * zoom))
    rgb = rgb if zoom == 1.0 else cv2.resize(rgb, size_px, interpolation=cv2.INTER_AREA)
    middle = f"median {1000.0 * float(np.median(off_m[known])):+.1f} mm" if known.any() else "no depth there"
    most = f"{1000.0 * most_m:.0f} mm"
    bar = ColorBar((NEARER, EQUAL, FARTHER), (f"−{most}", "0", f"+{most}"))
    return Picture(rgb, f"{what}: {middle}; blue too near, orange too far", bar)


def warp_picture(warp: WarpView) -> Picture:
    """Draw the shape of the board as the camera sees it: blue nearer to the camera, orange farther away."""
    most_m = max(float(np.abs(warp.off_plane_m).max()), LEAST_WARP_M)
    rows, columns = warp.off_plane_m.shape
    size_px = (WARP_WIDTH_PX, round(WARP_WIDTH_PX * rows / columns))
    fine_m = cv2.resize(warp.off_plane_m.astype(np.float32), size_px, interpolation=cv2.INTER_CUBIC)
    rgb = ramp(np.clip(fine_m, -most_m, most_m) + most_m, 2.0 * most_m, (NEARER, EQUAL, FARTHER))
    most = f"{1000.0 * most_m:.2g} mm"
    return Picture(
        rgb,
        f"Board bent by {1000.0 * warp.bend_m:.2g} mm from its deepest to its highest point; blue is "
        f"nearer to the camera, orange farther away. {'Used' if warp.used else 'Not used'}: RMS error of "
        f"held-out views {warp.rms_px:.4f} px with this shape, {warp.flat_rms_px:.4f} px with a flat board",
        ColorBar((NEARER, EQUAL, FARTHER), (f"−{most}", "0", f"+{most}")),
    )


def _dots(rgb: ByteArray, points_px: FloatArray, color: tuple[int, int, int], radius_px: int) -> None:
    for x, y in np.rint(points_px * (1 << SHIFT)).astype(int).tolist():
        cv2.circle(rgb, (x, y), radius_px << SHIFT, color, -1, cv2.LINE_AA, shift=SHIFT)
