"""Model of a structured-light depth sensor like the first Kinect: noise, quantisation and holes."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numba
import numpy as np
from scipy.special import ndtr

from lab.worlds.render import View
from pipeline.kernels.geometry import pixel_rays
from pipeline.types import BoolArray, CameraIntrinsics, DepthMap, FloatArray


@dataclass(frozen=True, slots=True)
class SensorConfig:
    """Parameters of a first-generation Kinect; pixels are those of its 640-wide image.

    Sources: Nguyen, Izadi, Lovell 2012 (axial noise, steep angles); Khoshelham, Elberink 2012 (baseline,
    disparity steps, range); Barron, Malik 2013 and Handa et al. 2014 (jitter at edges). The thresholds
    of the losses were set by eye from two real frames, so that 10 to 25 % of the pixels are holes.
    """

    baseline_m: float = 0.075
    """Distance of the projector to the right of the camera; shadows fall to the left of objects."""
    disparity_step_px: float = 0.125
    near_m: float = 0.4
    """Least depth that is measured."""
    far_m: float = 4.5
    """Greatest depth that is measured."""
    fade_m: float = 0.6
    """Returns become rare over this distance before ``far_m``."""
    noise_m: tuple[float, float] = (0.0012, 0.0019)
    """a (metres) and b (1/metre) of the standard deviation a + b (z - 0.4)^2 along the optical axis."""
    grazing_deg: tuple[float, float] = (70.0, 86.0)
    """Angles between ray and normal: below the first, steepness loses no return, above the second all."""
    dark: tuple[float, float] = (0.0012, 0.006)
    """Infrared return, albedo x (1 - gloss)^2 x cosine / z^2: below the first value every pixel is lost, and
    above the second none is lost by darkness."""
    mirror_deg: float = 9.0
    """Scale of the angle between ray and normal: a surface that faces the camera blinds it by its reflection
    with probability gloss x exp(-(angle / mirror_deg)^2)."""
    edge_px: tuple[float, float] = (0.0, 1.7)
    """Least and greatest width of the band without depth on each side of a depth edge."""
    edge_jump_px: float = 1.0
    """Neighbouring pixels are at an edge if their disparities differ by more."""
    flying_share: float = 0.06
    """Share of the pixels within 3 px of an edge that report a random depth between front and back."""
    blob_share: float = 0.002
    """Share of pixels lost in blobs without a visible cause."""
    blob_px: tuple[float, float] = (2.0, 9.0)
    """Standard deviations of the Gaussians, fine and coarse, that form the blobs of lost pixels."""
    border_px: tuple[float, float, float, float] = (8.0, 6.0, 16.0, 6.0)
    """Left, top, right and bottom margins outside the depth camera's view."""


def sense_depth(
    view: View, intrinsics: CameraIntrinsics, rng: np.random.Generator, config: SensorConfig | None = None
) -> DepthMap:
    """Return the sensor's (H, W) depth of a rendered view: metric, with noise, quantisation and holes (NaN).

    ``config`` of None is ``SensorConfig()``.
    """
    config = config or SensorConfig()
    per_px = 640.0 / intrinsics.width_px
    focal_px = intrinsics.fx_px * per_px
    true_m = np.where(np.isfinite(view.z_m), view.z_m, 1e3).astype(np.float64)
    disparity_px = focal_px * config.baseline_m / true_m
    edge_distance_px = _distance_to_edges(disparity_px, config.edge_jump_px) * per_px

    seen_m = _jittered(true_m, edge_distance_px, rng, config)
    noisy_m = seen_m + rng.standard_normal(seen_m.shape) * axial_sigma_m(seen_m, config)
    z_m = _quantised(noisy_m, focal_px * config.baseline_m, config.disparity_step_px)

    lost = projector_shadow(true_m, intrinsics.fx_px * config.baseline_m, config.edge_jump_px / per_px)
    blobs = _field(true_m.shape, np.array(config.blob_px) / per_px, rng)
    lost |= blobs < _loss_probability(view, intrinsics, true_m, config)
    ragged = config.edge_px[0] + np.ptp(config.edge_px) * _field(true_m.shape, np.array([1.5]) / per_px, rng)
    lost |= edge_distance_px < ragged
    lost |= _outside(true_m.shape, np.array(config.border_px) / per_px)
    lost |= (z_m < config.near_m) | (z_m > config.far_m) | ~np.isfinite(view.z_m)
    return DepthMap(np.where(lost, np.nan, z_m).astype(np.float32))


def axial_sigma_m(z_m: FloatArray, config: SensorConfig | None = None) -> FloatArray:
    """Return the standard deviation of the depth noise at depth ``z_m``, metres (Nguyen et al. 2012)."""
    a, b = (config or SensorConfig()).noise_m
    return a + b * (z_m - 0.4) ** 2


def projector_shadow(z_m: FloatArray, focal_baseline: float, jump_px: float) -> BoolArray:
    """Return (H, W) True where a nearer point in the same row blocks the projector's light.

    Args:
        z_m: (H, W) true depth.
        focal_baseline: focal length (pixels) times baseline (metres); the projector is at +x.
        jump_px: neighbours whose disparities differ by less are one surface.
    """
    shadow = np.zeros(z_m.shape, np.bool_)
    _cast_shadow(np.ascontiguousarray(focal_baseline / z_m), jump_px, shadow)
    return shadow


@numba.njit(cache=True, nogil=True)
def _cast_shadow(disparity, jump_px, shadow):  # type: ignore[no-untyped-def]
    """Fill ``shadow`` by a z-buffer of each row in the projector's view, where column u is at u - disparity.

    The buffer has two bins per pixel.
    """
    height, width = disparity.shape
    for y in range(height):
        margin = int(np.max(disparity[y])) + 2
        nearest = np.zeros(2 * (width + margin) + 4)
        for x in range(width):
            here, there = disparity[y, x], disparity[y, min(x + 1, width - 1)]
            if abs(here - there) > jump_px:
                there = here
            a, b = 2.0 * (x - here + margin), 2.0 * (min(x + 1, width - 1) - there + margin)
            for k in range(int(np.floor(min(a, b))), int(np.floor(max(a, b))) + 1):
                nearest[k] = max(nearest[k], here)
        for x in range(width):
            k = int(np.floor(2.0 * (x - disparity[y, x] + margin)))
            shadow[y, x] = nearest[k] > disparity[y, x] + jump_px


def _distance_to_edges(disparity_px: FloatArray, jump_px: float) -> FloatArray:
    """Return (H, W) distance to the nearest depth edge, pixels; at most about the image's size."""
    smooth = np.ones(disparity_px.shape, np.uint8)
    across = np.abs(np.diff(disparity_px, axis=1)) > jump_px
    down = np.abs(np.diff(disparity_px, axis=0)) > jump_px
    smooth[:, 1:][across] = smooth[:, :-1][across] = 0
    smooth[1:][down] = smooth[:-1][down] = 0
    return np.minimum(cv2.distanceTransform(smooth, cv2.DIST_L2, 3), max(smooth.shape)) + 0.5


def _jittered(
    true_m: FloatArray, edge_distance_px: FloatArray, rng: np.random.Generator, config: SensorConfig
) -> FloatArray:
    """Return depth with edges displaced by about a pixel, and flying pixels between front and back."""
    height, width = true_m.shape
    y, x = np.mgrid[:height, :width]
    dy, dx = np.rint(rng.normal(0.0, 0.7, (2, height, width))).astype(int)
    moved = true_m[np.clip(y + dy, 0, height - 1), np.clip(x + dx, 0, width - 1)]
    near_edge = edge_distance_px < 3.0
    front, back = cv2.erode(true_m, np.ones((3, 3))), cv2.dilate(true_m, np.ones((3, 3)))
    share = rng.random(true_m.shape)
    flying = near_edge & (rng.random(true_m.shape) < config.flying_share) & (back < 2.0 * front)
    return np.where(flying, front + share * (back - front), np.where(near_edge, moved, true_m))


def _quantised(z_m: FloatArray, focal_baseline: float, step_px: float) -> FloatArray:
    """Return the depth after rounding its disparity to a whole number of steps, at least one."""
    steps = np.maximum(np.rint(focal_baseline / np.maximum(z_m, 0.05) / step_px), 1.0)
    return focal_baseline / (steps * step_px)


def _loss_probability(
    view: View, intrinsics: CameraIntrinsics, true_m: FloatArray, config: SensorConfig
) -> FloatArray:
    """Return (H, W) probability that a pixel is lost: steep, dark, shiny or far surfaces, or by chance."""
    rays = pixel_rays(intrinsics) @ view.T_world_camera[:3, :3].T
    cosine = np.abs(np.einsum("hwk,hwk->hw", rays, view.normals)) / np.linalg.norm(rays, axis=-1)
    angle_deg = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    infrared_return = view.infrared * (1.0 - view.gloss) ** 2 * cosine / true_m**2
    steep = _ramp(angle_deg, *config.grazing_deg)
    dark = 1.0 - _ramp(infrared_return, *config.dark)
    blind = view.gloss * np.exp(-((angle_deg / config.mirror_deg) ** 2))
    far = _ramp(true_m, config.far_m - config.fade_m, config.far_m + 0.3) ** 2
    return 1.0 - (1.0 - steep) * (1.0 - dark) * (1.0 - blind) * (1.0 - far) * (1.0 - config.blob_share)


def _field(shape: tuple[int, int], sizes_px: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return (H, W) random numbers, uniform from 0 to 1: noise blurred by Gaussians of (K,) sizes, added."""
    total = np.zeros(shape)
    for size_px in sizes_px:
        blurred = cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), size_px, borderType=cv2.BORDER_REFLECT)
        total += blurred * (2.0 * np.sqrt(np.pi) * size_px)
    return ndtr(total / np.sqrt(len(sizes_px)))


def _outside(shape: tuple[int, int], border_px: FloatArray) -> BoolArray:
    left, top, right, bottom = np.rint(border_px).astype(int)
    outside = np.ones(shape, bool)
    outside[top : shape[0] - bottom, left : shape[1] - right] = False
    return outside


def _ramp(x: FloatArray, low: float, high: float) -> FloatArray:
    """Return a smooth step from 0 at low to 1 at high."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
