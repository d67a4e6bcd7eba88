"""Alignment of inferred depth with the sensor's, to make it metric (SPEC 3.5)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.config import AlignmentMode
from pipeline.depth.robust import fit_line
from pipeline.types import BoolArray, DepthMap, FloatArray

MIN_OVERLAP_PX = 100
INLIER_SHARE_OF_DEPTH = 0.05
FARTHEST_TIMES_SENSOR = 3.0
LOCAL_WIDTH_PX = 320
LOCAL_SIGMAS_PX = (4.0, 12.0, 40.0)
LOCAL_CLIP = 0.5
LOCAL_PRIOR = 1e-4
"""Weight of "no correction" relative to the Gaussians': the correction fades far from sensor depth."""


@dataclass(frozen=True, slots=True)
class AlignmentResult:
    """Inferred depth in metres, and its agreement with the sensor where both exist."""

    depth: DepthMap
    """Aligned depth on the pixel grid of both maps; NaN where the mapping gives no positive depth."""
    mode: AlignmentMode
    coefficients: dict[str, float]
    """``scale`` of the median mode; ``a`` and ``b`` of z' = a z + b (m) or 1/z' = a/z + b (1/m)."""
    residual_rms_m: float
    """Root mean square of aligned minus sensor depth over the shared pixels; NaN if there are none."""
    inliers: float
    """Share of the shared pixels whose aligned depth is within 5 % of the sensor's, 0 to 1."""
    disparity: bool = False
    """Whether the network's output is disparity up to scale and shift."""


def align_depth(
    inferred: DepthMap, sensor: DepthMap, mode: AlignmentMode = "local", disparity: bool = False
) -> AlignmentResult:
    """Map inferred depth to the sensor's metres.

    Args:
        inferred: (H, W) dense depth, correct up to approximately a scale.
        sensor: (H, W) metric depth with holes.
        mode: ``none`` keeps the network's metres; ``median`` scales; ``affine_depth`` and ``affine_inverse``
            fit a line robustly; ``local`` adds a smooth correction to the line of ``affine_depth``.
        disparity: whether the network's output is disparity up to scale and shift; then ``local`` corrects
            the line of ``affine_inverse`` instead.

    Raises:
        InputError: the two maps differ in size.
        ReconstructionError: the maps share fewer than 100 pixels (any mode but ``none``).
    """
    z, p = inferred.z_m.astype(np.float64), sensor.z_m.astype(np.float64)
    if z.shape != p.shape:
        raise InputError(
            f"Inferred depth of {z.shape[1]} x {z.shape[0]} pixels cannot be aligned with sensor depth of "
            f"{p.shape[1]} x {p.shape[0]}: register the two images first."
        )
    overlap = positive(z) & positive(p)
    if mode != "none" and overlap.sum() < MIN_OVERLAP_PX:
        raise ReconstructionError(
            f"Sensor depth and inferred depth share only {overlap.sum()} pixels, and aligning them takes "
            f"{MIN_OVERLAP_PX}: use a frame with more sensor depth, or alignment none."
        )
    align = local_inverse if mode == "local" and disparity else ALIGNMENTS[mode]
    aligned, coefficients = align(z, p, overlap, np.random.default_rng(0))
    aligned = np.where(positive(aligned), aligned, np.nan)
    shared = positive(aligned) & overlap
    residual_m = aligned[shared] - p[shared]
    return AlignmentResult(
        DepthMap(aligned.astype(np.float32)),
        mode,
        coefficients,
        float(np.sqrt(np.mean(residual_m**2))) if shared.any() else float("nan"),
        float(np.mean(np.abs(residual_m) < INLIER_SHARE_OF_DEPTH * p[shared])) if shared.any() else 0.0,
        disparity,
    )


Aligned = tuple[FloatArray, dict[str, float]]


def unchanged(z: FloatArray, p: FloatArray, overlap: BoolArray, rng: np.random.Generator) -> Aligned:
    """Return the network's depth unchanged, in its metres."""
    return z, {}


def median(z: FloatArray, p: FloatArray, overlap: BoolArray, rng: np.random.Generator) -> Aligned:
    """Scale by medians: z' = z median(p) / median(z)."""
    scale = float(np.median(p[overlap]) / np.median(z[overlap]))
    return scale * z, {"scale": scale}


def affine_depth(z: FloatArray, p: FloatArray, overlap: BoolArray, rng: np.random.Generator) -> Aligned:
    """Fit z' = a z + b; uses the median scale if the pixels determine no positive slope."""
    a, b = fit_line(z[overlap], p[overlap], rng)
    if not a > 0.0:
        a, b = median(z, p, overlap, rng)[1]["scale"], 0.0
    return a * z + b, {"a": a, "b": b}


def affine_inverse(z: FloatArray, p: FloatArray, overlap: BoolArray, rng: np.random.Generator) -> Aligned:
    """Fit 1/z' = a/z + b, the right model for networks whose output is disparity up to scale and shift.

    Like ``affine_depth`` it uses the median scale if the pixels determine no positive slope. Depths beyond
    three times the sensor's farthest become unknown, because their disparity is near zero.
    """
    a, b = fit_line(1.0 / z[overlap], 1.0 / p[overlap], rng)
    if not a > 0.0:
        a, b = 1.0 / median(z, p, overlap, rng)[1]["scale"], 0.0
    inverse = a / np.where(z > 0.0, z, np.nan) + b
    least = 1.0 / (FARTHEST_TIMES_SENSOR * p[overlap].max())
    return 1.0 / np.where(inverse > least, inverse, np.nan), {"a": a, "b": b}


def local(z: FloatArray, p: FloatArray, overlap: BoolArray, rng: np.random.Generator) -> Aligned:
    """Multiply the affine fit by exp(C), C the smoothed logarithmic residual: removes low-frequency bias."""
    line, coefficients = affine_depth(z, p, overlap, rng)
    return corrected(line, p, overlap), coefficients


def local_inverse(z: FloatArray, p: FloatArray, overlap: BoolArray, rng: np.random.Generator) -> Aligned:
    """Multiply the affine fit of disparities by exp(C), as ``local`` does for depths."""
    line, coefficients = affine_inverse(z, p, overlap, rng)
    return corrected(line, p, overlap), coefficients


def corrected(line: FloatArray, p: FloatArray, overlap: BoolArray) -> FloatArray:
    """Multiply an aligned depth by exp(C), with C the smoothed logarithmic residual."""
    usable = overlap & positive(line)
    residual = np.zeros(line.shape, np.float32)
    residual[usable] = np.clip(np.log(p[usable] / line[usable]), -LOCAL_CLIP, LOCAL_CLIP)
    return line * np.exp(masked_blur(residual, usable))


def masked_blur(residual: FloatArray, known: BoolArray) -> FloatArray:
    """Compute sum_s G_s*(m r) / (``LOCAL_PRIOR`` + sum_s G_s*m), with Gaussians of 4, 12 and 40 px at 320 px
    width.

    Args:
        residual: (H, W) float32, zero where unknown.
        known: (H, W) mask m of known pixels.
    """
    rows, columns = residual.shape
    small = LOCAL_WIDTH_PX, max(1, round(rows * LOCAL_WIDTH_PX / columns))
    layers = np.stack([residual, known.astype(np.float32)], axis=-1)
    layers = cv2.resize(layers, small, interpolation=cv2.INTER_AREA)
    total = np.sum(
        [cv2.GaussianBlur(layers, (0, 0), s, borderType=cv2.BORDER_CONSTANT) for s in LOCAL_SIGMAS_PX], axis=0
    )
    correction = total[..., 0] / (total[..., 1] + LOCAL_PRIOR)
    return cv2.resize(correction, (columns, rows), interpolation=cv2.INTER_LINEAR)


def positive(depth_m: FloatArray) -> BoolArray:
    """Return an (H, W) mask of the depths that are finite and in front of the camera."""
    return (depth_m > 0.0) & (depth_m < np.inf)


ALIGNMENTS = {
    "none": unchanged,
    "median": median,
    "affine_depth": affine_depth,
    "affine_inverse": affine_inverse,
    "local": local,
}
