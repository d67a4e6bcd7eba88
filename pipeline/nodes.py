"""Clouds of each node: measured, inferred and fused."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from pipeline.acquisition import Acquired, FilterResult, back_project
from pipeline.config import DepthConfig, FusionMode, RegistrationConfig
from pipeline.depth import AlignmentResult, DepthNetwork, JudgedDepth, align_depth, complete, judge
from pipeline.kernels.masks import near
from pipeline.kernels.straight_view import bends_strongly, bent_depth, straight_image, straight_view
from pipeline.registration import fuse, register
from pipeline.types import DepthMap, PointCloud, PointSource, RegistrationResult, RgbdFrame

COLOR_REACH_PX = 8
"""Largest distance from a pixel that has arrived at which a filled-in colour is used."""


@dataclass(frozen=True, slots=True)
class InferredDepth:
    """Output of the depth network for one colour image, before it is made metric."""

    depth: DepthMap
    disparity: bool
    """Whether the network gives 1/depth up to scale and shift."""
    provider: str
    """The execution provider that ran the network."""
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class NodeClouds:
    """Clouds and depth from one node's images, in its own camera frame."""

    name: str
    sensor: PointCloud
    filtered: FilterResult
    network: InferredDepth
    alignment: AlignmentResult
    judged: JudgedDepth
    """Aligned depth accepted in the sensor's holes, with its confidence."""
    inferred: PointCloud
    """Points of the accepted depth; in ``union`` mode of all inferred depth, as in the thesis."""
    inferred_registration: RegistrationResult | None
    fused: PointCloud


def infer_depth(network: DepthNetwork, frame: RgbdFrame, crop: bool = False) -> InferredDepth:
    """Run the depth network on a frame's colour image; that of a rational or fisheye lens is straightened."""
    started = time.perf_counter()
    camera = frame.intrinsics
    if bends_strongly(camera):
        view = straight_view(camera)
        depth = network.infer(straight_image(frame.rgb, camera, view), crop=crop)
        depth = bent_depth(depth, camera, view)
    else:
        depth = network.infer(frame.rgb, crop=crop)
    elapsed_s = time.perf_counter() - started
    return InferredDepth(depth, network.convention.kind == "inverse", network.provider, elapsed_s)


def nothing_inferred(frame: RgbdFrame) -> InferredDepth:
    """Return an ``InferredDepth`` without depth, for a frame of which no colour has arrived."""
    unknown = np.full(frame.depth.z_m.shape, np.nan, np.float32)
    return InferredDepth(DepthMap(unknown, kind="relative"), disparity=False, provider="none", elapsed_s=0.0)


def prepare_node(
    frame: RgbdFrame,
    inferred: InferredDepth,
    acquired: Acquired,
    depth: DepthConfig,
    mode: FusionMode,
    registration: RegistrationConfig | None = None,
) -> NodeClouds:
    """Compute one node's sensor cloud, inferred cloud and their fusion, in the node's camera frame.

    Args:
        frame: the node's images.
        inferred: output of the depth network for its colour image.
        acquired: its measured depth, with the outliers marked.
        depth: settings of alignment and of the confidence that is required.
        mode: ``fill`` uses inferred points only at pixels that the sensor has not measured.
        registration: moves the inferred cloud rigidly onto the sensor cloud, as the thesis does; None
            does not move it.
    """
    filtered = acquired.cloud(frame)
    sensor = filtered.kept
    guide = _guide(frame)
    alignment = _aligned(inferred, guide, depth)
    completed = complete(guide, frame.rgb) if _completes(guide, inferred, depth) else None
    judged = judge(alignment, frame.depth, frame.rgb, depth.reach, depth.least_confidence, completed)
    believed = _guesses(frame, judged.depth if mode == "fill" else alignment.depth)
    if not believed.valid.any():
        return _measured_only(frame, sensor, filtered, inferred, alignment, judged)
    cloud = back_project(frame, believed, PointSource.INFERRED)
    result = None
    if registration is not None:
        result = register(cloud, sensor, registration)
        cloud = cloud.transformed(result.T_target_source)
    return NodeClouds(
        name=frame.name,
        sensor=sensor,
        filtered=filtered,
        network=inferred,
        alignment=alignment,
        judged=judged,
        inferred=cloud,
        inferred_registration=result,
        fused=fuse(sensor, cloud, mode, frame.depth.valid),
    )


def _measured_only(
    frame: RgbdFrame,
    sensor: PointCloud,
    filtered: FilterResult,
    inferred: InferredDepth,
    alignment: AlignmentResult,
    judged: JudgedDepth,
) -> NodeClouds:
    """Return the clouds of a node without inferred points."""
    labelled = replace(sensor, source=np.full(len(sensor), PointSource.SENSOR, np.uint8))
    nothing = labelled.select(np.zeros(len(sensor), bool))
    return NodeClouds(frame.name, sensor, filtered, inferred, alignment, judged, nothing, None, labelled)


def _guide(frame: RgbdFrame) -> DepthMap:
    """Return the depth for aligning inferred depth: measured, elsewhere the coarse depth that arrived."""
    if frame.coarse is None:
        return frame.depth
    return DepthMap(np.where(frame.depth.valid, frame.depth.z_m, frame.coarse.z_m))


def _completes(guide: DepthMap, inferred: InferredDepth, config: DepthConfig) -> bool:
    """Return whether holes are to be completed and there are colours and depth to complete from."""
    return config.completes and inferred.provider != "none" and bool(guide.valid.any())


def _aligned(inferred: InferredDepth, guide: DepthMap, config: DepthConfig) -> AlignmentResult:
    """Align the inferred depth to metric depth; without any, return an unaligned result."""
    if inferred.provider == "none":
        return AlignmentResult(DepthMap(inferred.depth.z_m), config.alignment, {}, float("nan"), 0.0)
    return align_depth(inferred.depth, guide, config.alignment, inferred.disparity)


def _guesses(frame: RgbdFrame, inferred: DepthMap) -> DepthMap:
    """Return depth for unmeasured pixels: the coarse depth that arrived, else the inferred depth.

    Depth inferred from a filled-in colour is used only near pixels whose colour has arrived.
    """
    z_m = inferred.z_m
    if frame.rgb_known is not None:
        z_m = np.where(near(frame.rgb_known, COLOR_REACH_PX), z_m, np.float32(np.nan))
    if frame.coarse is not None:
        z_m = np.where(frame.coarse.valid, frame.coarse.z_m, z_m)
    return inferred if z_m is inferred.z_m else DepthMap(z_m, inferred.kind)
