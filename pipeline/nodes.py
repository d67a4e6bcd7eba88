"""Clouds of each node: measured, inferred and fused."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock
from typing import Any, TypeVar
from weakref import finalize

import numpy as np

from pipeline.acquisition import Acquired, FilterResult, acquire, back_project
from pipeline.config import AcquisitionConfig, DepthConfig, FusionMode, RegistrationConfig
from pipeline.depth import AlignmentResult, DepthNetwork, JudgedDepth, align_depth, completed_by, judge
from pipeline.kernels.masks import near
from pipeline.kernels.straight_view import bends_strongly, bent_depth, straight_image, straight_view
from pipeline.registration import fuse, register
from pipeline.types import DepthMap, PointCloud, PointSource, RegistrationResult, RgbdFrame

Cloud = TypeVar("Cloud", FilterResult, PointCloud)
KEPT_NODES = 6
"""Number of nodes, those used last, whose whole clouds are kept."""
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


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class NodeClouds:
    """Clouds and depth from one node's images, in its own camera frame.

    Whole clouds are computed at first use and kept only for the nodes used last (``KEPT_NODES``), because
    they take 30 MB per node.
    """

    frame: RgbdFrame
    """The node's images."""
    acquired: Acquired
    """Its measured depth, with the outliers marked."""
    network: InferredDepth
    alignment: AlignmentResult
    judged: JudgedDepth
    """Aligned depth accepted in the sensor's holes, with its confidence."""
    inferred: PointCloud
    """Points of the accepted depth; in ``union`` mode of all inferred depth, as in the thesis."""
    inferred_registration: RegistrationResult | None
    """Registration that moved ``inferred`` onto the measured points; None if it was not moved."""
    mode: FusionMode
    """How ``fused`` joins the measured and the inferred points."""

    @property
    def name(self) -> str:
        """The node's name."""
        return self.frame.name

    @property
    def filtered(self) -> FilterResult:
        """The measured points, split into those that are kept and outliers."""
        return _kept.get(self, "filtered", lambda: self.acquired.cloud(self.frame))

    @property
    def sensor(self) -> PointCloud:
        """The measured points without outliers."""
        return self.filtered.kept

    @property
    def fused(self) -> PointCloud:
        """The measured and the inferred points."""
        return _kept.get(self, "fused", self._fuse)

    def _fuse(self) -> PointCloud:
        if not len(self.inferred):
            return self.sensor
        return fuse(self.sensor, self.inferred, self.mode, self.frame.depth.valid)


class _KeptClouds:
    """Whole clouds of the nodes used last, as long as the nodes exist."""

    def __init__(self) -> None:
        self._of: OrderedDict[int, dict[str, Any]] = OrderedDict()
        self._lock = Lock()

    def get(self, node: NodeClouds, name: str, compute: Callable[[], Cloud]) -> Cloud:
        """Return a node's cloud; two threads may both compute it, and one of the results is kept."""
        with self._lock:
            if id(node) not in self._of:
                self._of[id(node)] = {}
                finalize(node, self._of.pop, id(node), None)
            mine = self._of[id(node)]
            self._of.move_to_end(id(node))
            while len(self._of) > KEPT_NODES:
                self._of.popitem(last=False)
        if name not in mine:
            mine[name] = compute()
        cloud: Cloud = mine[name]
        return cloud


_kept = _KeptClouds()


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
    guide = _guide(frame)
    alignment = _aligned(inferred, guide, depth)
    completed = completed_by(depth, guide, frame.rgb) if _completes(guide, inferred, depth) else None
    judged = judge(alignment, frame.depth, frame.rgb, depth.reach, depth.least_confidence, completed)
    believed = _guesses(frame, judged.depth if mode == "fill" else alignment.depth)
    node = partial(NodeClouds, frame, acquired, inferred, alignment, judged)
    if not believed.valid.any():
        return node(acquired.cloud(frame).kept.select(np.empty(0, np.intp)), None, mode)
    cloud = back_project(frame, believed, PointSource.INFERRED)
    result = None
    if registration is not None:
        result = register(cloud, acquired.cloud(frame).kept, registration)
        cloud = cloud.transformed(result.T_target_source)
    return node(cloud, result, mode)


def with_coarse_depth(
    frame: RgbdFrame, node: NodeClouds, acquisition: AcquisitionConfig
) -> tuple[RgbdFrame, NodeClouds]:
    """Return a frame and its node for registration: coarse depth that arrived counts as measured.

    A few tiles do not determine a pose; their base layer does (SPEC 13.3).
    """
    if frame.coarse is None:
        return frame, node
    whole = replace(frame, depth=_guide(frame), coarse=None)
    return whole, replace(node, frame=whole, acquired=acquire(whole, acquisition))


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
