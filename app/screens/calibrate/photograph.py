"""A photograph of the board with what was found drawn over it, and the same straightened."""

from __future__ import annotations

import cv2
import numpy as np

from app.compute.records import Picture
from app.drawing.colors import DELIVERED, LOSS, SOURCE
from app.screens.calibrate.view import CameraView, Photograph
from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.types import ByteArray, FloatArray

SHIFT = 4
"""Bits behind the comma of what is drawn."""
LONGEST_PX = 22.0
"""Length at which the largest error of a view is drawn."""
FIRST = (250, 220, 0)
"""The first point, which tells which way is up."""


def found_picture(photograph: Photograph, fitted: FittedView | None) -> Picture:
    """The photograph with rings around the board's points; or around the blobs that were no board."""
    rgb = decoded(photograph)
    name = f"View {photograph.name}"
    if not photograph.found:
        _rings(rgb, photograph.blobs_px, photograph.zoom, LOSS, 6.0)
        seen = f" Red: {len(photograph.blobs_px)} blobs." if len(photograph.blobs_px) else ""
        return Picture(rgb, f"{name}, no board found. {photograph.reason.rstrip('.')}.{seen}")
    size_px = _ring_px(photograph.points_px, photograph.zoom)
    _rings(rgb, photograph.points_px, photograph.zoom, DELIVERED, size_px)
    _rings(rgb, photograph.points_px[:1], photograph.zoom, FIRST, size_px + 1.0)
    caption = f"{name}, {len(photograph.points_px)} points found (green, the first yellow)"
    if fitted is None:
        return Picture(rgb, caption)
    most_px = float(np.linalg.norm(fitted.residuals_px, axis=1).max())
    times = round_down(LONGEST_PX / max(most_px * photograph.zoom, 1e-6))
    ends_px = photograph.points_px - times * fitted.residuals_px  # towards what the lens predicts
    lines = np.stack([photograph.points_px, ends_px], axis=1) * photograph.zoom
    fixed = [np.rint(line * (1 << SHIFT)).astype(np.int32) for line in lines]
    cv2.polylines(rgb, fixed, False, SOURCE, 1, cv2.LINE_AA, shift=SHIFT)
    return Picture(rgb, f"{caption}; orange: to where the lens puts them, × {times:,.0f}")


def decoded(photograph: Photograph) -> ByteArray:
    """(H, W, 3) RGB."""
    bgr = cv2.imdecode(np.frombuffer(photograph.jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert bgr is not None
    return np.ascontiguousarray(bgr[..., ::-1])


def straightened_picture(found: Picture, camera: Calibration, zoom: float) -> Picture:
    """A photograph, with what is drawn over it, as a lens without distortion would have taken it."""
    matrix = scaled_matrix(camera.matrix, zoom)
    if camera.lens == "fisheye":
        rgb = cv2.fisheye.undistortImage(found.rgb, matrix, camera.distortion, Knew=matrix)
    else:
        rgb = cv2.undistort(found.rgb, matrix, camera.distortion)
    return Picture(rgb, "Straightened: edges that are straight in the world are straight here")


def scaled_matrix(matrix: FloatArray, zoom: float) -> FloatArray:
    """(3, 3) K of a thinned picture, whose pixel centres are at integers, too."""
    scale = np.array([[zoom, 0.0, 0.5 * (zoom - 1.0)], [0.0, zoom, 0.5 * (zoom - 1.0)], [0.0, 0.0, 1.0]])
    return scale @ matrix


def round_down(times: float) -> float:
    """1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(times, 1.0)))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= max(times, 1.0)))


def picture_of(camera: CameraView, name: str) -> Photograph:
    """The photograph of a view, or the first."""
    return next((one for one in camera.photographs if one.name == name), camera.photographs[0])


def _rings(
    rgb: ByteArray, points_px: FloatArray, zoom: float, color: tuple[int, int, int], size_px: float
) -> None:
    for x, y in np.rint(points_px * zoom * (1 << SHIFT)).astype(int).tolist():
        cv2.circle(rgb, (x, y), round(size_px * (1 << SHIFT)), color, 1, cv2.LINE_AA, shift=SHIFT)


def _ring_px(points_px: FloatArray, zoom: float) -> float:
    """Radius of rings that do not touch each other."""
    if len(points_px) < 2:
        return 6.0
    apart_px = np.linalg.norm(points_px[1:] - points_px[:-1], axis=1)
    return float(np.clip(0.35 * zoom * np.median(apart_px), 2.0, 8.0))
