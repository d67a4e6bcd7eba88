"""What each node sees and infers, and where the nodes stand beside each other."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline import geometry
from pipeline.acquisition import Acquired, FilterResult, back_project
from pipeline.config import DepthConfig, FusionMode, NodePoints, RegistrationConfig
from pipeline.depth import AlignmentResult, DepthNetwork, JudgedDepth, align_depth, judge
from pipeline.pixels import near
from pipeline.registration import fuse, register
from pipeline.registration.pose_graph import graph_points, pose_edge, solve_pose_graph
from pipeline.types import DepthMap, FloatArray, PointCloud, PointSource, RegistrationResult, RgbdFrame

COLOR_REACH_PX = 8
"""How far from a pixel that has arrived a filled-in colour still shows what is there."""
SHARED_VIEW = 0.25
"""Share of a node's points in another's image from which on the two are worth registering."""


@dataclass(frozen=True, slots=True)
class InferredDepth:
    """The depth network's answer to one colour image, before it is made metric."""

    depth: DepthMap
    disparity: bool
    """Whether the network gives 1/depth up to scale and shift."""
    provider: str
    """The execution provider that ran the network."""
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class NodeClouds:
    """What one node's images give, in its own camera frame."""

    name: str
    sensor: PointCloud
    filtered: FilterResult
    network: InferredDepth
    alignment: AlignmentResult
    judged: JudgedDepth
    """The aligned depth that is believed in the sensor's holes, and with what confidence."""
    inferred: PointCloud
    """The believed depth, or in ``union`` mode all of it, as in the thesis."""
    inferred_registration: RegistrationResult | None
    fused: PointCloud


@dataclass(frozen=True, slots=True)
class NodeRegistration:
    """How one node found its place beside another."""

    source: str
    target: str
    result: RegistrationResult
    loop_error_m: float = float("nan")
    """How far it is from what the other registrations say about these two nodes; NaN where they say
    nothing."""
    used: bool = True
    """False if it degenerated, or contradicts the loops and was left out."""


@dataclass(frozen=True, slots=True)
class Placement:
    """The nodes beside each other."""

    registrations: tuple[NodeRegistration, ...]
    """Those that place each node beside an earlier one first."""
    T_world_camera: tuple[FloatArray, ...]
    """Corrected poses."""


def infer_depth(network: DepthNetwork, frame: RgbdFrame, crop: bool = False) -> InferredDepth:
    """Run the depth network on a frame's colour image."""
    started = time.perf_counter()
    depth = network.infer(frame.rgb, crop=crop)
    elapsed_s = time.perf_counter() - started
    return InferredDepth(depth, network.convention.kind == "inverse", network.provider, elapsed_s)


def nothing_inferred(frame: RgbdFrame) -> InferredDepth:
    """Instead of the network's answer where no colour has arrived to infer from."""
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
    """One node's sensor cloud, inferred cloud and their fusion, in the node's camera frame.

    Args:
        frame: the node's images.
        inferred: what the depth network gives for its colour image.
        acquired: its measured depth, and which of its points are outliers.
        depth: how inferred depth is made metric, and how much of it is believed.
        mode: ``fill`` lets inferred points in only at pixels that the sensor has not measured.
        registration: moves the inferred cloud rigidly onto the sensor cloud, as the thesis does; None
            leaves its points where their pixels are.
    """
    filtered = acquired.cloud(frame)
    sensor = filtered.kept
    alignment = _aligned(frame, inferred, depth)
    judged = judge(alignment, frame.depth, frame.rgb, depth.reach, depth.least_confidence)
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
    """A node to whose sensor cloud there is nothing to add."""
    labelled = replace(sensor, source=np.full(len(sensor), PointSource.SENSOR, np.uint8))
    nothing = labelled.select(np.zeros(len(sensor), bool))
    return NodeClouds(frame.name, sensor, filtered, inferred, alignment, judged, nothing, None, labelled)


def _aligned(frame: RgbdFrame, inferred: InferredDepth, config: DepthConfig) -> AlignmentResult:
    """Inferred depth made metric; none where nothing could be inferred.

    Coarse depth guides the alignment as measured depth does.
    """
    if inferred.provider == "none":
        return AlignmentResult(DepthMap(inferred.depth.z_m), config.alignment, {}, float("nan"), 0.0)
    guide = frame.depth
    if frame.coarse is not None:
        guide = DepthMap(np.where(guide.valid, guide.z_m, frame.coarse.z_m))
    return align_depth(inferred.depth, guide, config.alignment, inferred.disparity)


def _guesses(frame: RgbdFrame, inferred: DepthMap) -> DepthMap:
    """Depth where nothing was measured: the coarse depth that arrived, else the inferred one.

    Depth inferred from a filled-in colour counts only near pixels whose colour has arrived.
    """
    z_m = inferred.z_m
    if frame.rgb_known is not None:
        z_m = np.where(near(frame.rgb_known, COLOR_REACH_PX), z_m, np.float32(np.nan))
    if frame.coarse is not None:
        z_m = np.where(frame.coarse.valid, frame.coarse.z_m, z_m)
    return inferred if z_m is inferred.z_m else DepthMap(z_m, inferred.kind)


def place_nodes(
    frames: Sequence[RgbdFrame],
    nodes: Sequence[NodeClouds],
    config: RegistrationConfig,
    align_with: NodePoints = "sensor",
) -> Placement:
    """Place the nodes beside each other by all pairs that share enough of their view.

    The first node keeps the pose it believes in. Registrations that contradict the loops they are part
    of are left out, and the rest make the poses by least squares. A node that no good registration
    reaches is placed beside the earlier node that it shares most of its view with; where their
    registration degenerates, as it believes.

    Args:
        frames: the nodes' images with their believed poses.
        nodes: their clouds.
        config: how a pair is registered.
        align_with: which of a node's clouds is registered.
    """
    clouds = [getattr(node, align_with) for node in nodes]
    partners, others = _node_pairs(frames, nodes, config.start == "global")
    pairs = [*partners, *others]
    results = [_register_pair(frames, clouds, config, *pair) for pair in pairs]
    points_m = [graph_points(cloud) for cloud in clouds]
    good = [
        place
        for place, result in enumerate(results)
        if result.steps and not result.stop_reason.startswith("degenerate")
    ]
    edges = [pose_edge(*pairs[place], points_m, results[place].T_target_source) for place in good]
    graph = solve_pose_graph(points_m, edges)
    found = {place: (graph.loop_error_m[k], graph.used[k]) for k, place in enumerate(good)}
    registrations = tuple(
        NodeRegistration(
            nodes[source].name, nodes[target].name, result, *found.get(place, (float("nan"), False))
        )
        for place, ((source, target), result) in enumerate(zip(pairs, results, strict=True))
    )
    poses = [frames[0].T_world_camera]
    for (index, partner), result in zip(partners, results, strict=False):
        T = graph.T_reference_node[index]
        placed = poses[0] @ T if np.isfinite(T).all() else poses[partner] @ result.T_target_source
        poses.append(placed)
    return Placement(registrations, tuple(poses))


def _node_pairs(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], unknown: bool
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """(later, earlier) node: every node's best partner, and the other pairs that share enough.

    Where poses are ``unknown``, so is what is shared, and all pairs are tried.
    """
    partners, others = [], []
    for index in range(1, len(nodes)):
        shares = [_shared_view(frames[index], nodes[index].sensor, frames[k]) for k in range(index)]
        partner = index - 1 if unknown else int(np.argmax(shares))
        partners.append((index, partner))
        others += [(index, k) for k in range(index) if k != partner and (unknown or shares[k] >= SHARED_VIEW)]
    return partners, others


def _register_pair(
    frames: Sequence[RgbdFrame],
    clouds: Sequence[PointCloud],
    config: RegistrationConfig,
    index: int,
    partner: int,
) -> RegistrationResult:
    """One node's cloud onto another's, from the believed poses or from anywhere."""
    T_init = geometry.inverse(frames[partner].T_world_camera) @ frames[index].T_world_camera
    try:
        return register(clouds[index], clouds[partner], config, T_init)
    except ReconstructionError as error:
        return RegistrationResult(T_init, (), False, str(error))


def _shared_view(frame: RgbdFrame, cloud: PointCloud, other: RgbdFrame) -> float:
    """Share of a node's points that fall into another node's image, by the believed poses."""
    T_other_camera = geometry.inverse(other.T_world_camera) @ frame.T_world_camera
    points_m = geometry.apply(T_other_camera, cloud.points_m[::50])
    points_m = points_m[points_m[:, 2] > 0.1]
    uv = geometry.project(other.intrinsics, points_m)
    size_px = (other.intrinsics.width_px, other.intrinsics.height_px)
    return float(np.all((uv >= 0) & (uv < size_px), axis=1).sum()) / max(1, len(cloud) // 50)
