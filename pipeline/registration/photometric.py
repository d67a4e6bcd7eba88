"""Poses along motions that surfaces leave open, by the brightness of two photographs (SPEC 10.1).

Before a bare wall or floor, depth images fit at many poses. Along these motions alone the brightness of the
target's pixels is compared with the source's (Steinbrücker, Sturm and Cremers, "Real-time visual odometry
from dense RGB-D images", ICCV workshops 2011), by Gauss-Newton steps from blurred to sharp images.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.kernels.geometry import apply, inverse, pixel_rays, project, rigid, rotation_exp
from pipeline.types import BoolArray, CameraIntrinsics, FloatArray, RgbdFrame

HELD = 1e3
"""Least inverse variance of a motion that surfaces hold, 1/m^2 or 1/rad^2: errors of 3 cm or 1.8 degrees."""
BLURS_PX = (6.0, 3.0, 1.5)
"""Standard deviations of the blurs, from the first steps to the last ones."""
MOST_STEPS, STILL_PX = 12, 0.02
"""Largest number of steps at one blur, and the median motion of the pixels below which they stop."""
MOST_PIXELS, LEAST_PIXELS = 3000, 150
"""Pixels that are compared: those with the steepest brightness; with fewer there is no answer."""
LEAST_SLOPE = 2.0
"""Least change of brightness, grey levels a pixel."""
SAME_SURFACE = 0.03
"""Largest difference, as a share, of the depths that a pixel has in both images."""
AROUND_PX = 3
"""Distance within which depth must not jump: behind an edge the background slides."""
ALIKE = 0.7
"""Least correlation of brightness at the pose that is found."""
FARTHEST_PX = 30.0
"""Largest median motion of the pixels from the start: beyond five of the widest blurs a fit is chance."""
HUBER = 1.345
"""Difference of brightness, in standard deviations, beyond which a pixel weighs less."""
CORRELATED = 50.0
"""Number of pixels that count as one in the information: neighbours share their errors."""
LARGEST_CONDITION = 1e12
"""Condition of the normal matrix above which brightness decides nothing."""
_TINY = 1e-4
"""Motion, rad or m, over which the projection is differentiated."""


@dataclass(frozen=True, slots=True)
class Photograph:
    """A photograph at several blurs, with the depth of its pixels."""

    levels: tuple[FloatArray, ...]
    """(H, W) float32 brightness, grey levels, for each of ``BLURS_PX``."""
    z_m: FloatArray
    """(H, W) depth of the pixels; NaN where unknown."""
    camera: CameraIntrinsics
    T_color_depth: FloatArray
    """(4, 4) pose of the depth camera, in which motions are given, in the colour camera's frame."""


def photograph(frame: RgbdFrame, T_color_depth: FloatArray) -> Photograph:
    """Return a frame's photograph; the frame's depth must be on the pixels of its colour image."""
    grey = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    levels = tuple(cv2.GaussianBlur(grey, (0, 0), blur_px) for blur_px in BLURS_PX)
    return Photograph(levels, frame.depth.z_m, frame.intrinsics, T_color_depth)


def open_motions(information: FloatArray) -> FloatArray:
    """Return the (6, M) motions, orthonormal, that (6, 6) information of a registration does not hold."""
    values, vectors = np.linalg.eigh(information)
    motions: FloatArray = vectors[:, values < HELD]
    return motions


def held_by_color(
    source: Photograph, target: Photograph, T_target_source: FloatArray, motions: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Move a pose along open motions to where the brightness of two photographs agrees.

    Args:
        source: the photograph that moves.
        target: the one that stays.
        T_target_source: (4, 4) start pose of the depth cameras, within a few pixels of the right one.
        motions: (6, M) small motions of the source in its own frame, M >= 1: turn in rad, then shift in m.

    Returns:
        The (4, 4) pose, and (6, 6) the information that it adds; None if the photographs do not decide or
            differ in size.
    """
    if source.z_m.shape != target.z_m.shape:
        return None
    pixels = _steep(target)
    if np.count_nonzero(pixels) < LEAST_PIXELS:
        return None
    points_m = _points_m(target, pixels)
    T, found = T_target_source, None
    for level in range(len(BLURS_PX)):
        for _ in range(MOST_STEPS):
            found = _step(source, target.levels[level][pixels], level, points_m, T, motions)
            if found is None:
                return None
            T = T @ _motion(motions @ found.along)
            if found.moved_px <= STILL_PX:
                break
    if found is None or not found.correlation >= ALIKE:
        return None
    before_px, after_px = (_seen(source, apply(inverse(pose), points_m))[0] for pose in (T_target_source, T))
    if not np.nanmedian(np.linalg.norm(after_px - before_px, axis=1)) <= FARTHEST_PX:
        return None
    return T, motions @ found.information @ motions.T


@dataclass(frozen=True, slots=True)
class _Step:
    """A step of least squares."""

    along: FloatArray
    """(M,) lengths along the open motions, rad and m."""
    moved_px: float
    """Median motion of the pixels."""
    correlation: float
    """Correlation of brightness in both photographs, before the step."""
    information: FloatArray
    """(M, M) inverse covariance of the step."""


def _steep(target: Photograph) -> BoolArray:
    """Return (H, W) the pixels with depth whose brightness changes most."""
    slope = np.hypot(*_slopes(target.levels[-1]))
    slope[~_smooth(target.z_m)] = 0.0
    least = LEAST_SLOPE
    if np.count_nonzero(slope >= least) > MOST_PIXELS:
        least = float(np.partition(slope.ravel(), -MOST_PIXELS)[-MOST_PIXELS])
    steep: BoolArray = slope >= least
    return steep


def _smooth(z_m: FloatArray) -> BoolArray:
    """Return (H, W) the pixels around which depth is known and 1/z, linear on planes, does not jump."""
    inverse_z = 1.0 / np.where(z_m > 0.0, z_m, np.nan)
    smooth = np.zeros(z_m.shape, bool)
    a, here = AROUND_PX, inverse_z[AROUND_PX:-AROUND_PX, AROUND_PX:-AROUND_PX]
    across = inverse_z[a:-a, : -2 * a] + inverse_z[a:-a, 2 * a :]
    along = inverse_z[: -2 * a, a:-a] + inverse_z[2 * a :, a:-a]
    limit = 2.0 * SAME_SURFACE * here
    smooth[a:-a, a:-a] = (np.abs(across - 2.0 * here) <= limit) & (np.abs(along - 2.0 * here) <= limit)
    return smooth


def _slopes(grey: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (H, W) changes of brightness per pixel, to the right and down."""
    return cv2.Scharr(grey, cv2.CV_32F, 1, 0) / 32.0, cv2.Scharr(grey, cv2.CV_32F, 0, 1) / 32.0


def _points_m(one: Photograph, pixels: BoolArray) -> FloatArray:
    """Return (N, 3) points of some pixels in the depth camera's frame."""
    points_m = pixel_rays(one.camera)[pixels] * one.z_m[pixels][:, None]
    return apply(inverse(one.T_color_depth), points_m)


def _step(
    source: Photograph,
    wanted: FloatArray,
    level: int,
    points_m: FloatArray,
    T_target_source: FloatArray,
    motions: FloatArray,
) -> _Step | None:
    """Return one robust least-squares step; gain and offset of the brightness are solved with it.

    Args:
        source: the photograph that moves.
        wanted: (N,) brightness of the target's pixels.
        level: number of the blur.
        points_m: (N, 3) their points in the target's depth camera.
        T_target_source: (4, 4) pose of this step.
        motions: (6, M) motions that are open.
    """
    own_m = apply(inverse(T_target_source), points_m)
    at_px, z_m = _seen(source, own_m)
    shown = _shown(source, at_px, z_m)
    at_px, own_m, before = at_px[shown], own_m[shown], wanted[shown]
    if len(before) < LEAST_PIXELS:
        return None
    grey = source.levels[level]
    now, across, down = (_sampled(image, at_px) for image in (grey, *_slopes(grey)))
    moves = [_seen(source, apply(inverse(_motion(_TINY * one)), own_m))[0] - at_px for one in motions.T]
    slopes = [(across * move[:, 0] + down * move[:, 1]) / _TINY for move in moves]
    J = np.nan_to_num(np.stack([*slopes, -before, -np.ones(len(now))], axis=1))  # beyond the lens: NaN
    weight = _huber(now - before * float(np.std(now)) / max(float(np.std(before)), 1e-6))
    normal = J.T @ (weight[:, None] * J)
    if np.linalg.cond(normal) > LARGEST_CONDITION:
        return None
    solved = -np.linalg.solve(normal, J.T @ (weight * now))
    variance = max(float(np.average(np.square(now + J @ solved), weights=weight)), 1e-6)
    M = len(moves)
    information = np.linalg.inv(np.linalg.inv(normal)[:M, :M]) / (variance * CORRELATED)
    moved_px = np.linalg.norm(np.tensordot(solved[:M] / _TINY, np.array(moves), 1), axis=1)
    correlation = float(np.corrcoef(now, before)[0, 1])
    return _Step(solved[:M], float(np.nanmedian(moved_px)), correlation, information)


def _huber(residual: FloatArray) -> FloatArray:
    """Return the (N,) weights of Huber's function, with the residuals' median taken off."""
    off = np.abs(residual - np.median(residual))
    spread = 1.4826 * max(float(np.median(off)), 1e-3)
    weights: FloatArray = np.minimum(1.0, HUBER * spread / np.maximum(off, 1e-9))
    return weights


def _seen(one: Photograph, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (N, 2) pixels and (N,) depths of points in the depth camera's frame."""
    in_color_m = apply(one.T_color_depth, points_m)
    return project(one.camera, in_color_m), in_color_m[:, 2]


def _shown(one: Photograph, at_px: FloatArray, z_m: FloatArray) -> BoolArray:
    """Return (N,) whether (N, 2) pixels at (N,) depths are two pixels within a photograph and not hidden."""
    height_px, width_px = one.z_m.shape
    u, v = np.nan_to_num(at_px, nan=-1.0).T
    shown = (u >= 2.0) & (u <= width_px - 3.0) & (v >= 2.0) & (v <= height_px - 3.0) & (z_m > 0.0)
    there_m = _sampled(one.z_m.astype(np.float32), np.where(shown[:, None], at_px, 2.0), cv2.INTER_NEAREST)
    shown &= np.abs(there_m - z_m) <= SAME_SURFACE * z_m
    return shown


def _sampled(image: FloatArray, at_px: FloatArray, how: int = cv2.INTER_LINEAR) -> FloatArray:
    """Return the (N,) values of an image at (N, 2) pixels."""
    u, v = at_px.astype(np.float32).T
    found: FloatArray = cv2.remap(image, u[None], v[None], how)[0]
    return found


def _motion(small: FloatArray) -> FloatArray:
    """Return the (4, 4) motion of (6,) turn and shift."""
    return rigid(rotation_exp(small[:3]), small[3:])
