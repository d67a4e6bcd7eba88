"""Errors of inferred depth, by alignment, scene and distance (SPEC 3.4)."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import cv2
import numpy as np

from lab.claims.depth.scenes import Site
from lab.training.evaluate import Example
from pipeline.config import AlignmentMode
from pipeline.depth import DepthErrors, DepthNetwork, align_depth, depth_errors
from pipeline.depth.metrics import NEAREST_M
from pipeline.types import ByteArray, DepthMap, FloatArray

ALIGNMENTS: dict[str, AlignmentMode] = {
    "raw": "none",
    "median-scaled": "median",
    "affine-aligned": "affine_depth",
}
"""Alignments to the reference depth, as in the literature; raw takes the network's numbers as metres."""
JUDGED = "median-scaled"
SENSOR = "sensor"
CHAIN = "aligned as in the chain"
"""Local alignment to the sensor's depth; only compared with the sensor's own error."""
EDGES_M = (NEAREST_M, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 40.0, 80.0)
"""Edges of the bins of true depth."""
STRIP_HEIGHT_PX = 200
WORST_SHOWN = 0.5
"""Relative error at the end of the colour scale."""


@dataclass(frozen=True, slots=True)
class FrameErrors:
    """Errors of one image."""

    aligned: dict[str, DepthErrors]
    """By the names of ``ALIGNMENTS``."""
    binned: dict[str, FloatArray]
    """By alignment: the sums that ``by_distance`` returns."""
    beside_sensor: dict[str, float]
    """AbsRel over the sensor's pixels: of its own depth (``SENSOR``), by alignment, and for ``CHAIN``; empty
    if the sensor is the reference."""


@dataclass(frozen=True, slots=True)
class SceneErrors:
    """All images of a site, in order."""

    site: Site
    frames: tuple[FrameErrors, ...]
    strip: ByteArray
    """(H, 4 W, 3) picture of the first image: colour, true depth, inferred depth (median-scaled) and relative
    error; black where unknown."""

    def series(self, alignment: str, measure: str) -> FloatArray:
        """Return (frames,) one measure of ``DepthErrors``."""
        return np.array([getattr(frame.aligned[alignment], measure) for frame in self.frames])

    def mean(self, alignment: str, measure: str) -> float:
        """Return the mean over images, with equal weights."""
        return float(self.series(alignment, measure).mean())

    def pooled_abs_rel(self, alignment: str) -> float:
        """Return AbsRel over the pixels of all images, with equal weights."""
        total, pixels = (sum(frame.binned[alignment][row].sum() for frame in self.frames) for row in (0, 1))
        return float(total / pixels)

    def beside_sensor(self, name: str) -> float:
        """Return AbsRel at the sensor's pixels, averaged over images; the site must have a truth."""
        return float(np.mean([frame.beside_sensor[name] for frame in self.frames]))


def site_trial(site: Site) -> dict[str, Any]:
    """Return the errors of the shipped network on a site, as plain values."""
    scene = scene_errors(site, DepthNetwork())
    png = cv2.imencode(".png", scene.strip)[1].tobytes()
    return {"frames": [asdict(frame) for frame in scene.frames], "strip": base64.b64encode(png).decode()}


def from_trial(site: Site, result: dict[str, Any]) -> SceneErrors:
    """Return the result of ``site_trial`` as ``SceneErrors``."""
    frames = [
        FrameErrors(
            {name: DepthErrors(**errors) for name, errors in frame["aligned"].items()},
            {name: np.array(binned) for name, binned in frame["binned"].items()},
            frame["beside_sensor"],
        )
        for frame in result["frames"]
    ]
    png = np.frombuffer(base64.b64decode(result["strip"]), np.uint8)
    return SceneErrors(site, tuple(frames), np.asarray(cv2.imdecode(png, cv2.IMREAD_COLOR), np.uint8))


def scene_errors(site: Site, network: DepthNetwork) -> SceneErrors:
    """Infer every image of a site and compare.

    Raises:
        InputError: a file of the site cannot be used, or nothing in an image can be compared.
        ReconstructionError: an image has fewer than 100 pixels with known depth.
    """
    frames: list[FrameErrors] = []
    strip = np.zeros((0, 0, 3), np.uint8)
    for example in site.examples():
        inferred = network.infer(example.rgb)
        judging_m = within(example.truth_m, site.cap_m)
        aligned_m = {
            name: align_depth(inferred, DepthMap(judging_m), mode).depth.z_m
            for name, mode in ALIGNMENTS.items()
        }
        frames.append(frame_errors(example, inferred, judging_m, aligned_m, site))
        if len(frames) == 1:
            strip = picture_strip(example.rgb, judging_m, aligned_m[JUDGED])
    return SceneErrors(site, tuple(frames), strip)


def within(truth_m: FloatArray, cap_m: float) -> FloatArray:
    """Return (H, W) the reference depths between ``NEAREST_M`` and ``cap_m``, NaN elsewhere."""
    with np.errstate(invalid="ignore"):
        return np.where((truth_m > NEAREST_M) & (truth_m < cap_m), truth_m, np.nan)


def frame_errors(
    example: Example, inferred: DepthMap, judging_m: FloatArray, aligned_m: dict[str, FloatArray], site: Site
) -> FrameErrors:
    """Return all measures of one image.

    Args:
        example: the image with its sensor depth.
        inferred: (H, W) output of the network.
        judging_m: (H, W) reference depths, NaN elsewhere.
        aligned_m: by alignment, the (H, W) inferred depth.
        site: site of the image.
    """
    at_sensor = {}
    if site.truth:
        seen_m = np.where(example.sensor.valid, judging_m, np.nan)
        chain_m = align_depth(inferred, example.sensor, "local").depth.z_m
        at_sensor = {
            name: depth_errors(z_m, seen_m, site.cap_m).abs_rel
            for name, z_m in ({SENSOR: example.sensor.z_m} | aligned_m | {CHAIN: chain_m}).items()
        }
    return FrameErrors(
        {name: depth_errors(z_m, judging_m, site.cap_m) for name, z_m in aligned_m.items()},
        {name: by_distance(z_m, judging_m) for name, z_m in aligned_m.items()},
        at_sensor,
    )


def by_distance(z_m: FloatArray, judging_m: FloatArray) -> FloatArray:
    """Return (2, bins) sums of |p - g| / g and pixel counts, for true depths between two ``EDGES_M``."""
    compared = np.isfinite(z_m) & np.isfinite(judging_m)
    g_m = judging_m[compared].astype(np.float64)
    relative = np.abs(z_m[compared] - g_m) / g_m
    pixels, _ = np.histogram(g_m, EDGES_M)
    total, _ = np.histogram(g_m, EDGES_M, weights=relative)
    return np.stack([total, pixels])


def distance_curve(frames: Iterable[FrameErrors], alignment: str) -> tuple[FloatArray, list[FloatArray]]:
    """Return the middles (metres) of the bins that have pixels, and for each the AbsRel of its images."""
    middles_m = 0.5 * (np.array(EDGES_M[1:]) + np.array(EDGES_M[:-1]))
    total, pixels = np.stack([frame.binned[alignment] for frame in frames], axis=1)
    filled = np.flatnonzero(pixels.any(axis=0))
    seen = pixels > 0
    values = [total[seen[:, k], k] / pixels[seen[:, k], k] for k in filled]
    return middles_m[filled], values


def picture_strip(rgb: ByteArray, truth_m: FloatArray, inferred_m: FloatArray) -> ByteArray:
    """Draw colour, true depth, inferred depth on the same scale, and relative error, side by side.

    Args:
        rgb: (H, W, 3).
        truth_m: (H, W), NaN where unknown; its extremes set the scale of both depths.
        inferred_m: (H, W), NaN where unknown.
    """
    near_m, far_m = np.nanpercentile(truth_m, (1.0, 99.0))
    error = np.abs(inferred_m - truth_m) / truth_m
    tiles = [
        rgb,
        colored(truth_m, near_m, far_m, cv2.COLORMAP_TURBO),
        colored(inferred_m, near_m, far_m, cv2.COLORMAP_TURBO),
        colored(error, 0.0, WORST_SHOWN, cv2.COLORMAP_INFERNO),
    ]
    width_px = max(1, round(STRIP_HEIGHT_PX * rgb.shape[1] / rgb.shape[0]))
    size_px = (width_px, STRIP_HEIGHT_PX)
    return np.hstack([cv2.resize(tile, size_px, interpolation=cv2.INTER_AREA) for tile in tiles])


def colored(values: FloatArray, low: float, high: float, colors: int) -> ByteArray:
    """Return (H, W, 3) RGB of (H, W) values by a colour map from ``low`` to ``high``; black if not finite."""
    share = np.clip((np.nan_to_num(values) - low) / max(high - low, 1e-9), 0.0, 1.0)
    bgr = cv2.applyColorMap(np.round(255.0 * share).astype(np.uint8), colors)
    return np.where(np.isfinite(values)[..., None], bgr[..., ::-1], np.uint8(0))
