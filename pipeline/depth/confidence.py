"""Confidence of inferred depth, and its continuation from the rims of the sensor's holes.

SPEC 3.5, the steps between alignment and fusion.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.depth.alignment import INLIER_SHARE_OF_DEPTH, LOCAL_CLIP, AlignmentResult, masked_blur, positive
from pipeline.depth.completion import CompletedDepth
from pipeline.depth.extension import extrapolated
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray

COMPLETED_FROM = 0.0125
"""Distance from a rim, as a share of the diagonal, at which completed and aligned depth weigh the same: 10 px
at 640 x 480, best of 0, 5, 10, 20 and 40 px on validation rooms (``fit_confidence`` prints the errors)."""
AT_ONCE = 1e-9
"""The same for completed depth that has the image's resolution."""
COMPLETED_ODDS = (-1.92, -1.24, 0.20, -0.08, -0.68)
"""Log odds of completed depth in the sensor's own holes: constant, and per feature of
``features_of_completion``. ``python -m lab.training fit_confidence`` fits them on validation rooms."""
HIDDEN_ODDS = (-4.22, -1.78, 0.24, -0.67, -0.92)
"""Log odds where measured depth was hidden for a test: without dark, shiny or far surfaces, these holes are
easier to complete. Fitted in the same way, on hidden depth."""
TYPICAL_LOG_SCALE = -2.7
LEAST_DIFFERENCE = 0.005
RELIEF_APART = 0.02
"""Distance of pixels whose depth differences are compared with the sensor's, as a share of the diagonal."""
RELIEF_STEP = 0.15
"""Larger steps of the sensor's logarithmic depth are edges and are left out."""
RELIEF_AFTER_LOCAL = 0.3
"""Share of the network's relief that is right after ``local`` alignment, measured on hidden sensor depth;
agreement with the sensor is no evidence there, because alignment has fitted the depth to the sensor."""
FLYING_WINDOW = 0.005
"""Half width, as a share of the diagonal, of the window that includes both surfaces of a step."""
FLYING_STEP = 0.12
FLYING_SLOPE = 0.03
FLYING_BETWEEN = 0.2
FLYING_MEASURED = 0.02
"""In logarithmic depth: least step in the window; least step within 3 x 3 pixels; distance from either side,
as a share of the step; and distance from measured depth within which a pixel continues that surface. On
hidden depth 7 of 10 removed pixels are more than 5 % wrong, of the others 1 in 12."""
ALIGNED_ODDS = (-10.20, -1.06, -1.83)
"""Log odds of aligned depth being within 5 % of the truth: constant, and per feature of
``features_of_alignment``. ``python -m lab.training fit_confidence`` fits them on validation rooms."""


@dataclass(frozen=True, slots=True)
class JudgedDepth:
    """Inferred depth after the tests of confidence, reach and flying pixels, with their results."""

    depth: DepthMap
    """(H, W) metres, without flying pixels, pixels out of reach and those below the least confidence."""
    confidence: FloatArray
    """(H, W) float32, estimated probability of being within 5 % of the truth; NaN without depth."""
    flying: BoolArray
    """(H, W) True for pixels between two surfaces."""
    out_of_reach: BoolArray
    """(H, W) True for inferred pixels farther from sensor depth than the reach."""


def judge(
    alignment: AlignmentResult,
    sensor: DepthMap,
    rgb: ByteArray,
    reach: float,
    least_confidence: float,
    completed: CompletedDepth | None = None,
    hidden: BoolArray | None = None,
) -> JudgedDepth:
    """Join aligned depth to the rims of the sensor's holes and remove unreliable pixels.

    Args:
        alignment: (H, W) inferred depth in metres.
        sensor: (H, W) metric depth with holes.
        rgb: (H, W, 3) uint8, the colours of both.
        reach: largest distance of a pixel from sensor depth, as a share of the image's diagonal.
        least_confidence: least confidence of the pixels that are kept, 0 to 1.
        completed: (H, W) completed depth; it replaces aligned depth in the sensor's holes with a weight that
            grows with the distance from their rims, or entirely if it is fine; what it leaves unknown stays
            unknown.
        hidden: (H, W) True where measured depth was hidden for a test; such holes are easier. None: nowhere.

    Raises:
        InputError: the images differ in size, the reach is negative, or a confidence is outside 0 to 1.
    """
    shape = alignment.depth.z_m.shape
    if sensor.z_m.shape != shape or rgb.shape != (*shape, 3):
        raise InputError(
            f"Inferred depth {shape}, sensor depth {sensor.z_m.shape} and colours {rgb.shape} are not on one "
            "pixel grid: register the images first."
        )
    if not reach >= 0.0:
        raise InputError(f"A reach of {reach} of the diagonal fills nothing; try 0.25.")
    if not 0.0 <= least_confidence <= 1.0:
        raise InputError(f"A least confidence of {least_confidence} is no share; try 0.5.")
    measured = positive(sensor.z_m)
    distance = distance_to_measured(measured)
    depth, believed = meet_rims(alignment, sensor, rgb), confidence_of(alignment, sensor, distance)
    if completed is not None:
        odds = odds_of_completion(depth, completed, distance, hidden)
        believed = np.where(measured, believed, 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0))))
        depth = joined(depth, completed, measured, distance, AT_ONCE if completed.fine else COMPLETED_FROM)
    usable = positive(depth.z_m)
    flying = usable & flying_pixels(depth, sensor)
    out_of_reach = usable & (distance > reach)
    confidence = np.where(usable, believed, np.nan).astype(np.float32)
    with np.errstate(invalid="ignore"):
        keep = usable & ~flying & ~out_of_reach & (confidence >= least_confidence)
    kept_m = np.where(keep, depth.z_m, np.nan).astype(np.float32)
    return JudgedDepth(DepthMap(kept_m, depth.kind), confidence, flying, out_of_reach)


def distance_to_measured(measured: BoolArray) -> FloatArray:
    """Return (H, W) distances to the nearest measured pixel, as shares of the diagonal; inf if none."""
    if not measured.any():
        return np.full(measured.shape, np.inf, np.float32)
    distance_px = cv2.distanceTransform((~measured).astype(np.uint8), cv2.DIST_L2, 5)
    return distance_px / np.float32(np.hypot(*measured.shape))


def confidence_of(alignment: AlignmentResult, sensor: DepthMap, distance: FloatArray) -> FloatArray:
    """Return (H, W) confidence of aligned depth.

    At pixels with sensor depth it is the share of surrounding pixels that agree with the sensor within 5 %;
    elsewhere it falls with the distance from them and with the residual there after a smooth correction.
    """
    z_m, p_m = alignment.depth.z_m, sensor.z_m
    known = positive(z_m) & positive(p_m)
    agrees = known & (np.abs(np.expm1(-_log_residual(alignment, sensor))) < INLIER_SHARE_OF_DEPTH)
    odds = _odds(ALIGNED_ODDS, features_of_alignment(alignment, sensor, distance))
    inferred = 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))
    return np.where(known, np.clip(masked_blur(agrees.astype(np.float32), known), 0.0, 1.0), inferred)


def features_of_alignment(alignment: AlignmentResult, sensor: DepthMap, distance: FloatArray) -> FloatArray:
    """Return (2, H, W) features that predict whether aligned depth is right.

    They are the logs of the distance, as a share of the diagonal, and of the nearby residual after a smooth
    correction.
    """
    residual, known = _log_residual(alignment, sensor), positive(alignment.depth.z_m) & positive(sensor.z_m)
    rough = np.abs(residual - masked_blur(residual, known)) * known
    nearby = masked_blur(rough.astype(np.float32), known)
    return np.stack([np.log(np.maximum(distance, 1e-3)), np.log(np.maximum(nearby, 0.0) + LEAST_DIFFERENCE)])


def _log_residual(alignment: AlignmentResult, sensor: DepthMap) -> FloatArray:
    """Return (H, W) float32 clipped log residuals; 0 where either depth is unknown."""
    z_m, p_m = alignment.depth.z_m, sensor.z_m
    known = positive(z_m) & positive(p_m)
    residual = np.log(np.where(known, p_m, 1.0) / np.where(known, z_m, 1.0))
    return np.clip(residual, -LOCAL_CLIP, LOCAL_CLIP).astype(np.float32)


def _odds(coefficients: tuple[float, ...], features: FloatArray) -> FloatArray:
    constant, *weights = coefficients
    return constant + np.tensordot(np.array(weights), features, 1)


def joined(
    aligned: DepthMap,
    completed: CompletedDepth,
    measured: BoolArray,
    distance: FloatArray,
    completed_from: float = COMPLETED_FROM,
) -> DepthMap:
    """Combine aligned depth at and near measured pixels with completed depth inside the holes.

    Narrow gaps get aligned depth, which has full resolution; the weight of completed depth is
    d^2 / (d^2 + d0^2) at the distance d from measured depth, d0 being ``completed_from``, and logarithms of
    both are averaged.
    """
    usable = positive(aligned.z_m)
    share = distance**2 / (distance**2 + completed_from**2)
    share = np.where(usable, share, 1.0)
    log_aligned = np.log(np.where(usable, aligned.z_m, 1.0))
    both_m = np.exp((1.0 - share) * log_aligned + share * np.log(completed.depth.z_m))
    return DepthMap(np.where(measured, aligned.z_m, both_m).astype(np.float32))


def odds_of_completion(
    aligned: DepthMap, completed: CompletedDepth, distance: FloatArray, hidden: BoolArray | None = None
) -> FloatArray:
    """Return (H, W) log odds of completed depth; ``hidden`` (H, W) marks hidden measured depth."""
    features = features_of_completion(aligned, completed, distance)
    own = _odds(COMPLETED_ODDS, features)
    return own if hidden is None else np.where(hidden, _odds(HIDDEN_ODDS, features), own)


def features_of_completion(aligned: DepthMap, completed: CompletedDepth, distance: FloatArray) -> FloatArray:
    """Return (4, H, W) features that predict whether completed depth is right.

    They are the network's log scale minus ``TYPICAL_LOG_SCALE``, its square, the log of the distance as a
    share of the diagonal, and the log of the difference between the logarithms of completed and aligned
    depth, which counts as 0 without aligned depth.
    """
    scale = completed.log_scale - TYPICAL_LOG_SCALE
    ratio = np.where(positive(aligned.z_m), aligned.z_m, completed.depth.z_m) / completed.depth.z_m
    dissent = np.log(np.abs(np.log(ratio)) + LEAST_DIFFERENCE)
    return np.stack([scale, scale**2, np.log(np.maximum(distance, 1e-3)), dissent])


def flying_pixels(depth: DepthMap, sensor: DepthMap) -> BoolArray:
    """Return (H, W) True for pixels on a steep step, away from both its sides and from measured depth."""
    measured = positive(sensor.z_m)
    complete_m = np.where(measured, sensor.z_m, depth.z_m)
    half_px = max(1, round(FLYING_WINDOW * np.hypot(*measured.shape)))
    front, back = log_range(complete_m, 2 * half_px + 1)
    log_z = np.log(np.where(positive(depth.z_m), depth.z_m, np.nan))
    with np.errstate(invalid="ignore", over="ignore"):
        steep = np.subtract(*log_range(complete_m, 3)[::-1]) > FLYING_SLOPE
        margin = FLYING_BETWEEN * (back - front)
        between_them = (back - front > FLYING_STEP) & (log_z > front + margin) & (log_z < back - margin)
    rows, columns = np.nonzero(steep & between_them)
    log_p = np.pad(np.log(np.where(measured, sensor.z_m, np.inf)), half_px, constant_values=np.inf)
    alone = np.ones(len(rows), bool)
    for down in range(2 * half_px + 1):
        for right in range(2 * half_px + 1):
            alone &= np.abs(log_p[rows + down, columns + right] - log_z[rows, columns]) > FLYING_MEASURED
    flying = np.zeros(measured.shape, bool)
    flying[rows[alone], columns[alone]] = True
    return flying


def log_range(z_m: FloatArray, side_px: int) -> tuple[FloatArray, FloatArray]:
    """Return (H, W) logarithms of the least and greatest known depth in a square window; inf and -inf if none
    is known.
    """
    known, window = positive(z_m), np.ones((side_px, side_px), np.uint8)
    log_z = np.log(np.where(known, z_m, 1.0)).astype(np.float32)
    least = cv2.erode(np.where(known, log_z, np.float32(np.inf)), window)
    greatest = cv2.dilate(np.where(known, log_z, np.float32(-np.inf)), window)
    return least, greatest


def meet_rims(alignment: AlignmentResult, sensor: DepthMap, rgb: ByteArray) -> DepthMap:
    """Correct aligned depth in the sensor's holes so that it continues the measured depth around them.

    z' = z^g exp(C), where g is the share of the network's relief that the sensor confirms in this frame
    (``RELIEF_AFTER_LOCAL`` after ``local`` alignment), and C = log p - g log z is extended from the measured
    pixels with its slope, along similar colours (joint bilateral weights, Kopf et al. 2007), from the rims
    inwards. So the relief of a poor network has little effect.

    Args:
        alignment: (H, W) inferred depth in metres.
        sensor: (H, W) metric depth with holes.
        rgb: (H, W, 3) colours of both.

    Returns:
        Depth where the aligned depth is known; at pixels with sensor depth it is the aligned depth unchanged.
    """
    depth = alignment.depth
    usable = positive(depth.z_m)
    known = usable & positive(sensor.z_m)
    if not known.any():
        return depth
    log_z = np.log(np.where(usable, depth.z_m, 1.0)).astype(np.float32)
    log_p = np.log(np.where(known, sensor.z_m, 1.0)).astype(np.float32)
    gain = RELIEF_AFTER_LOCAL if alignment.mode == "local" else confirmed_relief(log_z, log_p, known)
    field = np.where(known, log_p - gain * log_z, 0.0).astype(np.float32)
    met = np.exp(gain * log_z + extrapolated(field, known, rgb))
    return DepthMap(np.where(known | ~usable, depth.z_m, met).astype(np.float32))


def confirmed_relief(log_z: FloatArray, log_p: FloatArray, known: BoolArray) -> float:
    """Return the regression slope, 0 to 1, of the sensor's log depth differences on the inferred ones; steps
    above ``RELIEF_STEP`` are left out.
    """
    apart_px = max(1, round(RELIEF_APART * np.hypot(*known.shape)))
    product, square = 0.0, 1e-12
    for near, far in (
        (np.s_[:, :-apart_px], np.s_[:, apart_px:]),
        (np.s_[:-apart_px], np.s_[apart_px:]),
    ):
        p, z = log_p[far] - log_p[near], log_z[far] - log_z[near]
        counts = known[far] & known[near] & (np.abs(p) < RELIEF_STEP)
        product += float((p * z)[counts].sum())
        square += float((z * z)[counts].sum())
    return float(np.clip(product / square, 0.0, 1.0))
