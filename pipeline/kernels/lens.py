"""Lens models on the plane z = 1: from straight positions to distorted ones, and back.

Straight positions are (x / z, y / z) of a point; distorted ones are (u - cx) / fx and (v - cy) / fy of its
pixel. A model holds up to the radius at which it folds: farther out, two positions share a pixel.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import ArrayLike

from pipeline.types import BoolArray, CameraIntrinsics, FloatArray

COEFFICIENTS = (5, 8, 12, 14)
"""Numbers of coefficients of OpenCV's model: Brown-Conrady, rational, thin prism, tilted sensor."""
FISHEYE_COEFFICIENTS = 4
_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
"""OpenCV's fixed-point iteration stops at 1e-10 pixels, or after 100 steps."""
_MISSED_PX = 1e-7
"""A position that projects farther than this from its pixel is computed again by Newton's method."""
_STEPS = 20
"""Steps of Newton's method."""
_TABLE = 2000
"""Entries of the table of radii from which Newton's method starts."""
_FARTHEST = math.radians(89.9)
"""Largest angle to the optical axis in that table, rad."""
_NO_COEFFICIENT = 1e-100
"""A polynomial's coefficient below this counts as none; the roots would overflow."""


def reach(camera: CameraIntrinsics) -> float:
    """Return the radius on the plane z = 1 up to which the lens model holds; infinite if it never folds.

    The radial part decides: its slope must be positive. A fisheye's angle is also below 90 degrees.
    """
    if camera.fisheye:
        slope = np.array([1.0, *camera.distortion]) * np.arange(1, 10, 2)
        squared = _first_root(slope[::-1])
        return math.tan(math.sqrt(squared)) if squared < (0.5 * math.pi) ** 2 else math.inf
    above, below = _radial(camera.distortion)
    slope = np.polysub(
        np.polymul(np.polyadd(above, np.polymul([2.0, 0.0], np.polyder(above))), below),
        np.polymul(np.polymul([2.0, 0.0], above), np.polyder(below)),
    )
    return math.sqrt(min(_first_root(slope), _first_root(below)))


def distorted(camera: CameraIntrinsics, straight: FloatArray) -> FloatArray:
    """Return the (N, 2) distorted positions of (N, 2) straight positions within the lens's ``reach``."""
    if camera.fisheye:
        radius = np.linalg.norm(straight, axis=1)
        angle = np.arctan(radius)
        bent, _ = _fisheye(camera.distortion, angle)
        return straight * np.divide(bent, radius, out=np.ones_like(radius), where=radius > 0.0)[:, None]
    bent, _ = _opencv(camera.distortion, straight, with_slopes=False)
    return _through(_tilt(camera.distortion), bent)


def straightened(camera: CameraIntrinsics, pixels: FloatArray) -> FloatArray:
    """Return the (N, 2) straight positions of (N, 2) pixels; NaN beyond the lens's ``reach``."""
    bent = (pixels - camera.matrix[:2, 2]) / camera.matrix[[0, 1], [0, 1]]
    if camera.fisheye:
        return _fisheye_straightened(camera, bent)
    straight = cv2.undistortPoints(pixels[:, None], camera.matrix, camera.distortion, criteria=_UNTIL)[:, 0]
    farthest = reach(camera)
    wrong = ~_right(camera, straight, bent, farthest)
    if wrong.any():
        straight[wrong] = _by_newton(camera, bent[wrong], farthest)
        straight[wrong] = np.where(
            _right(camera, straight[wrong], bent[wrong], farthest)[:, None], straight[wrong], np.nan
        )
    return straight


def _right(camera: CameraIntrinsics, straight: FloatArray, bent: FloatArray, farthest: float) -> BoolArray:
    """Return (N,) True for straight positions within reach that project to the distorted positions."""
    with np.errstate(all="ignore"):
        missed = (distorted(camera, straight) - bent) * camera.matrix[[0, 1], [0, 1]]
        within: BoolArray = np.hypot(*straight.T) < farthest
    return within & (np.hypot(*missed.T) < _MISSED_PX)


def _by_newton(camera: CameraIntrinsics, bent: FloatArray, farthest: float) -> FloatArray:
    """Find straight positions by Newton's method, from those of the radial part alone."""
    upright = _through(np.linalg.inv(_tilt(camera.distortion)), bent)
    radii = np.tan(np.linspace(0.0, min(math.atan(farthest), _FARTHEST), _TABLE))
    above, below = _radial(camera.distortion)
    table = radii * np.polyval(above, radii**2) / np.polyval(below, radii**2)
    length = np.hypot(*upright.T)
    start = np.interp(length, table[:-1], radii[:-1])
    straight = upright * np.divide(start, length, out=np.ones_like(length), where=length > 0.0)[:, None]
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            here, (xx, xy, yx, yy) = _opencv(camera.distortion, straight)
            dx, dy = (upright - here).T
            straight = (
                straight
                + np.stack([yy * dx - xy * dy, xx * dy - yx * dx], 1) / ((xx * yy - xy * yx)[:, None])
            )
    return straight


def _fisheye_straightened(camera: CameraIntrinsics, bent: FloatArray) -> FloatArray:
    """Return (N, 2) straight positions of distorted positions, by Newton's method for the angle."""
    widest = min(math.atan(reach(camera)), 0.5 * math.pi)
    angles = np.linspace(0.0, widest, _TABLE)
    table, _ = _fisheye(camera.distortion, angles)
    length = np.hypot(*bent.T)
    angle: FloatArray = np.asarray(np.interp(length, table, angles))
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            here, slope = _fisheye(camera.distortion, angle)
            step = (here - length) / slope
            angle = np.clip(angle - step, 0.0, widest)
            if not np.any(np.abs(step) > 1e-15):
                break
        radius = np.where(length < table[-1], np.tan(angle), np.nan)
    return bent * np.divide(radius, length, out=np.ones_like(length), where=length > 0.0)[:, None]


def _fisheye(distortion: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (N,) distorted radii of angles to the optical axis, rad, and their derivatives."""
    odd = np.array([1.0, *distortion])
    squared = angle**2
    return angle * np.polyval(odd[::-1], squared), np.polyval((odd * np.arange(1, 10, 2))[::-1], squared)


def _opencv(
    distortion: FloatArray, straight: FloatArray, with_slopes: bool = True
) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """Return (N, 2) positions distorted by OpenCV's model without tilt, and four (N,) derivatives.

    The derivatives are those of x by x, x by y, y by x and y by y.
    """
    _, _, p1, p2, *_, s1, s2, s3, s4, _, _ = _all(distortion)
    above, below = _radial(distortion)
    x, y = straight.T
    rr = x * x + y * y
    over, under = np.polyval(above, rr), np.polyval(below, rr)
    factor = over / under
    bent = np.stack(
        [
            x * factor + 2.0 * p1 * x * y + p2 * (rr + 2.0 * x * x) + rr * (s1 + s2 * rr),
            y * factor + p1 * (rr + 2.0 * y * y) + 2.0 * p2 * x * y + rr * (s3 + s4 * rr),
        ],
        axis=1,
    )
    if not with_slopes:
        return bent, ()
    grows = 2.0 * (np.polyval(np.polyder(above), rr) - factor * np.polyval(np.polyder(below), rr)) / under
    prism_x, prism_y = 2.0 * s1 + 4.0 * s2 * rr, 2.0 * s3 + 4.0 * s4 * rr
    return bent, (
        factor + x * x * grows + 2.0 * p1 * y + 6.0 * p2 * x + prism_x * x,
        x * y * grows + 2.0 * p1 * x + 2.0 * p2 * y + prism_x * y,
        x * y * grows + 2.0 * p1 * x + 2.0 * p2 * y + prism_y * x,
        factor + y * y * grows + 6.0 * p1 * y + 2.0 * p2 * x + prism_y * y,
    )


def _all(distortion: FloatArray) -> FloatArray:
    """Return all (14,) coefficients of OpenCV's model; missing ones are 0."""
    return np.pad(distortion, (0, COEFFICIENTS[-1] - len(distortion)))


def _radial(distortion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return numerator and denominator of OpenCV's radial factor, (4,) coefficients of r^6 down to 1."""
    k1, k2, _, _, k3, k4, k5, k6, *_ = _all(distortion)
    return np.array([k3, k2, k1, 1.0]), np.array([k6, k5, k4, 1.0])


def _tilt(distortion: FloatArray) -> FloatArray:
    """Return the (3, 3) homography from an upright sensor to a tilted one, as in OpenCV's documentation."""
    angles = _all(distortion)[12:]
    if not angles.any():
        return np.eye(3)
    (cx, cy), (sx, sy) = np.cos(angles), np.sin(angles)
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, sx], [0.0, -sx, cx]])
    turn_y = np.array([[cy, 0.0, -sy], [0.0, 1.0, 0.0], [sy, 0.0, cy]])
    turn = turn_y @ turn_x
    return np.array([[turn[2, 2], 0.0, -turn[0, 2]], [0.0, turn[2, 2], -turn[1, 2]], [0.0, 0.0, 1.0]]) @ turn


def _through(homography: FloatArray, positions: FloatArray) -> FloatArray:
    """Return (N, 2) positions after a (3, 3) homography."""
    if np.array_equal(homography, np.eye(3)):
        return positions
    moved = np.column_stack([positions, np.ones(len(positions))]) @ homography.T
    return moved[:, :2] / moved[:, 2:]


def _first_root(polynomial: ArrayLike) -> float:
    """Return the smallest positive real root of a polynomial, highest power first; infinite without one."""
    coefficients = np.asarray(polynomial, float)
    roots = np.roots(np.where(np.abs(coefficients) < _NO_COEFFICIENT, 0.0, coefficients))
    real = roots.real[(np.abs(roots.imag) < 1e-12 * np.abs(roots)) & (roots.real > 0.0)]
    return float(real.min(initial=math.inf))
