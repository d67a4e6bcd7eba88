"""The job of the Depth screen: every node's depth, sensed, inferred, compared and judged."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.compute.records import (
    SCREEN_POINTS,
    DepthNode,
    DepthView,
    JudgedView,
    Picture,
    ResidualView,
    Sample,
    grid_step,
    on_grid,
    sample,
)
from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.pictures import (
    confidence_colors,
    confidence_picture,
    depth_picture,
    depth_range_m,
    difference_picture,
)
from app.screens.depth.view import SeenSample
from packetmesh.progress import Progress
from pipeline.config import DepthConfig
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.confidence import JudgedDepth
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.nodes import NodeClouds
from pipeline.types import BoolArray, DepthMap, PointCloud, PointSource, RgbdFrame, Rig

PICTURE_WIDTH_PX = 640
"""Width in the panel; wider images are subsampled."""
RESIDUAL_BINS = 60
LEAST_RANGE_M = 0.01


def depth_job(store: Store, spec: Spec) -> Generator[Progress, None, DepthView]:
    """Return every node's depth, sensed, inferred and fused."""
    rig, nodes = yield from store.stages(spec, "rig", "nodes")
    step = grid_step(sum(int(frame.depth.valid.sum()) for frame in rig.frames))
    views = []
    for index, clouds in enumerate(nodes):
        yield Progress(f"pictures of {clouds.name}", 0.9 + 0.1 * index / len(nodes))
        views.append(_depth_node(rig, index, clouds, spec.config.depth, step))
    return DepthView(tuple(views))


def _depth_node(rig: Rig, index: int, clouds: NodeClouds, config: DepthConfig, step: int) -> DepthNode:
    fused, most = clouds.fused, SCREEN_POINTS // len(rig.frames)
    frame, alignment, judged = rig.frames[index], clouds.alignment, clouds.judged
    filled = fused.select(_inferred_rows(fused))
    return DepthNode(
        name=clouds.name,
        T_world_camera=frame.T_world_camera,
        pictures=_pictures(frame, clouds, judged),
        sensor=_seen(clouds.sensor, frame, step),
        inferred=_thinned(clouds.inferred, frame, step),
        outliers=_thinned(replace(clouds.filtered.outliers, colors=None), frame, step),
        fused=sample(fused.points_m, fused.colors, most),
        filled=_thinned(filled, frame, step),
        inferred_confidence=_confidence(clouds.inferred, judged, step),
        filled_confidence=_confidence(filled, judged, step),
        alignment_mode=alignment.mode,
        disparity=alignment.disparity,
        coefficients=dict(alignment.coefficients),
        residuals=residual_view(alignment.depth, frame.depth),
        inlier_share=alignment.inliers,
        judged=judged_view(judged, alignment.depth.valid & ~frame.depth.valid),
        truth_error_m=_filled_error_m(rig, index, judged),
        network=(SHIPPED_MODEL if config.model is None else Path(config.model)).name,
        completion=_completion(config).name if config.completes and frame.depth.valid.any() else "",
        provider=clouds.network.provider,
        inference_s=clouds.network.elapsed_s,
    )


def _completion(config: DepthConfig) -> Path:
    return SHIPPED_COMPLETION if config.completion is None else Path(config.completion)


def _pictures(frame: RgbdFrame, clouds: NodeClouds, judged: JudgedDepth) -> dict[str, Picture]:
    range_m, aligned = depth_range_m(frame.depth), clouds.alignment.depth
    pictures = {
        "photo": Picture(frame.rgb, f"Colour image of {frame.name}"),
        "sensor": depth_picture(frame.depth, range_m, "Sensor depth"),
        "inferred": depth_picture(aligned, range_m, "Inferred depth, aligned"),
        "difference": difference_picture(aligned, frame.depth),
        "confidence": confidence_picture(judged.confidence, judged.flying, judged.out_of_reach),
    }
    every = -(-frame.rgb.shape[1] // PICTURE_WIDTH_PX)
    return {
        name: replace(picture, rgb=np.ascontiguousarray(picture.rgb[::every, ::every]))
        for name, picture in pictures.items()
    }


def _thinned(cloud: PointCloud, frame: RgbdFrame, step: int) -> Sample:
    """Return the points of every ``step``-th column and row, so that densities can be compared by eye."""
    drawn = _on_grid(cloud, step)
    spacing = step / frame.intrinsics.fx_px
    return Sample(drawn.points_m.astype(np.float32), drawn.colors, len(cloud), spacing=spacing)


def _seen(cloud: PointCloud, frame: RgbdFrame, step: int) -> SeenSample:
    """Return a cloud thinned as by ``_thinned``, with the pixels of its points."""
    thinned, pixels = _thinned(cloud, frame, step), _on_grid(cloud, step).pixels
    assert pixels is not None
    height_px, width_px = frame.depth.z_m.shape
    points_m, colors = thinned.points_m, thinned.colors
    return SeenSample(points_m, colors, len(cloud), pixels, width_px, height_px, spacing=thinned.spacing)


def _confidence(cloud: PointCloud, judged: JudgedDepth, step: int) -> np.ndarray:
    """Return (N, 3) RGB of the points that ``_thinned`` draws."""
    drawn = _on_grid(cloud, step)
    assert drawn.pixels is not None
    u, v = drawn.pixels.T
    return confidence_colors(judged.confidence[v, u])


def _on_grid(cloud: PointCloud, step: int) -> PointCloud:
    assert cloud.pixels is not None
    return cloud.select(on_grid(cloud.pixels, step))


def _inferred_rows(cloud: PointCloud) -> BoolArray:
    if cloud.source is None:
        return np.zeros(len(cloud), dtype=bool)
    return cloud.source == PointSource.INFERRED


def residual_view(aligned: DepthMap, sensor: DepthMap) -> ResidualView:
    """Return the histogram of aligned minus sensor depth. Its range covers 98 % of the pixels; the outer bins
    also count the others.
    """
    residual_m = (aligned.z_m - sensor.z_m).astype(float)
    residual_m = residual_m[np.isfinite(residual_m)]
    if not len(residual_m):
        edges_m = np.linspace(-LEAST_RANGE_M, LEAST_RANGE_M, RESIDUAL_BINS + 1)
        return ResidualView(edges_m, np.zeros(RESIDUAL_BINS, int), float("nan"), float("nan"))
    most_m = max(LEAST_RANGE_M, float(np.percentile(np.abs(residual_m), 98.0)))
    edges_m = np.linspace(-most_m, most_m, RESIDUAL_BINS + 1)
    counts, _ = np.histogram(np.clip(residual_m, -most_m, most_m), edges_m)
    rms_m = float(np.sqrt(np.mean(residual_m**2)))
    return ResidualView(edges_m, counts, float(np.median(residual_m)), rms_m)


def judged_view(judged: JudgedDepth, blind: BoolArray) -> JudgedView:
    """Return the shares of the pixels ``blind``, (H, W), whose inferred depth is accepted, flying and out of
    reach; NaN if there are none.
    """
    if not blind.any():
        return JudgedView(float("nan"), float("nan"), float("nan"))
    kept, flying, far = (
        mask[blind].mean() for mask in (judged.depth.valid, judged.flying, judged.out_of_reach)
    )
    return JudgedView(float(kept), float(flying), float(far))


def _filled_error_m(rig: Rig, index: int, judged: JudgedDepth) -> float | None:
    """Return the median absolute error of accepted inferred depth where the sensor has none, metres; None
    without truth or such pixels.
    """
    if rig.truth is None:
        return None
    error_m = np.abs(judged.depth.z_m - rig.truth.depth[index].z_m)
    error_m = error_m[~rig.frames[index].depth.valid & np.isfinite(error_m)]
    return float(np.median(error_m)) if len(error_m) else None
