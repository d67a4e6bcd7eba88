"""The whole way through the stages, from a rig's images to a surface before and after fusion."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import ReconstructionError
from packetmesh.progress import Progress
from pipeline import geometry
from pipeline.acquisition import FilterResult, back_project, filter_outliers
from pipeline.config import FusionMode, PipelineConfig
from pipeline.depth import AlignmentResult, DepthNetwork, JudgedDepth, Overrides, align_depth, judge
from pipeline.registration import fuse, hidden_from, register
from pipeline.registration.global_start import register_from_anywhere
from pipeline.registration.pose_graph import graph_points, pose_edge, solve_pose_graph
from pipeline.surface import (
    Camera,
    compare_with_truth,
    estimate_normals,
    radii,
    reconstruct_surface,
    smooth,
    spacing,
    voxel_average,
    voxel_for_count,
)
from pipeline.types import (
    DepthMap,
    FloatArray,
    PointCloud,
    PointSource,
    RegistrationResult,
    RgbdFrame,
    Rig,
    SurfaceResult,
)

SHARED_VIEW = 0.25
"""Share of a node's points in another's image from which on the two are worth registering."""


@dataclass(frozen=True, slots=True)
class NodeClouds:
    """What one node's images say, in its own camera frame."""

    name: str
    sensor: PointCloud
    filtered: FilterResult
    inferred_depth: DepthMap
    """What the network said, before it was made metric."""
    provider: str
    """The execution provider that ran the network."""
    alignment: AlignmentResult
    judged: JudgedDepth
    """What of the aligned depth is to be believed in the sensor's holes."""
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
class Surfaces:
    """The clouds as the ball meets them and what it makes of them, in the world frame."""

    sensor: PointCloud
    fused: PointCloud
    r_F_m: float
    """Mean nearest-neighbour distance of the fused cloud."""
    sigma_D_m: float
    """Its standard deviation."""
    before: SurfaceResult
    after: SurfaceResult


@dataclass(frozen=True, slots=True)
class Reconstruction:
    """Everything the chain found out about a rig."""

    rig: Rig
    config: PipelineConfig
    nodes: tuple[NodeClouds, ...]
    registrations: tuple[NodeRegistration, ...]
    T_world_camera: tuple[FloatArray, ...]
    """Corrected poses."""
    surfaces: Surfaces
    truth_before: dict[str, float] | None
    """Comparison of the surface before fusion with the ground truth, where there is one."""
    truth_after: dict[str, float] | None
    timings_s: dict[str, float]


def reconstruct(rig: Rig, config: PipelineConfig) -> Reconstruction:
    """Run every stage on ``rig``.

    Raises:
        PacketMeshError: a stage cannot work with what it was given; the message says why.
    """
    steps = iterate_reconstruction(rig, config)
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            return stop.value


def iterate_reconstruction(rig: Rig, config: PipelineConfig) -> Generator[Progress, None, Reconstruction]:
    """Like ``reconstruct``, with a report between stages; closing the generator cancels the rest."""
    timings_s: dict[str, float] = {}
    started = time.perf_counter()

    def done(stage: str) -> None:
        nonlocal started
        now = time.perf_counter()
        timings_s[stage] = timings_s.get(stage, 0.0) + now - started
        started = now

    yield Progress("loading the depth network", 0.0)
    network = DepthNetwork(config.depth.model, config.depth.preset, Overrides.of(config.depth))
    done("load network")
    nodes = []
    for index, frame in enumerate(rig.frames):
        yield Progress(f"depth and fusion of {frame.name}", 0.05 + 0.4 * index / len(rig.frames))
        nodes.append(prepare_node(frame, config, network))
        done("depth and fusion")
    yield Progress("registering the nodes", 0.45)
    registrations, poses = register_nodes(rig.frames, nodes, config)
    done("node registration")
    yield Progress("rolling the ball", 0.6)
    cameras = [Camera(frame.intrinsics, pose) for frame, pose in zip(rig.frames, poses, strict=True)]
    surfaces = surfaces_before_and_after(nodes, rig.frames, poses, config)
    done("surfaces")
    truth_before = truth_after = None
    if rig.truth is not None:
        yield Progress("comparing with the truth", 0.9)
        truth_before = compare_with_truth(
            surfaces.before.vertices_m, surfaces.before.triangles, rig.truth, cameras
        )
        truth_after = compare_with_truth(
            surfaces.after.vertices_m, surfaces.after.triangles, rig.truth, cameras
        )
        done("comparison with truth")
    return Reconstruction(
        rig, config, tuple(nodes), registrations, poses, surfaces, truth_before, truth_after, timings_s
    )


def prepare_node(frame: RgbdFrame, config: PipelineConfig, network: DepthNetwork) -> NodeClouds:
    """One node's sensor cloud, inferred cloud and their fusion, in the node's camera frame."""
    filtered = filter_outliers(back_project(frame), config.acquisition, frame.intrinsics.fx_px)
    sensor = filtered.kept
    inferred_depth = network.infer(frame.rgb, crop=config.depth.crop)
    disparity = network.convention.kind == "inverse"
    alignment = align_depth(inferred_depth, frame.depth, config.depth.alignment, disparity)
    judged = judge(alignment, frame.depth, frame.rgb, config.depth.reach, config.depth.least_confidence)
    believed = judged.depth if config.fusion.mode == "fill" else alignment.depth
    inferred = back_project(frame, believed, PointSource.INFERRED)
    registration = None
    if config.fusion.register_inferred:
        registration = register(inferred, sensor, config.inferred_registration)
        inferred = inferred.transformed(registration.T_target_source)
    return NodeClouds(
        name=frame.name,
        sensor=sensor,
        filtered=filtered,
        inferred_depth=inferred_depth,
        provider=network.provider,
        alignment=alignment,
        judged=judged,
        inferred=inferred,
        inferred_registration=registration,
        fused=fuse(sensor, inferred, config.fusion.mode),
    )


def register_nodes(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], config: PipelineConfig
) -> tuple[tuple[NodeRegistration, ...], tuple[FloatArray, ...]]:
    """Place the nodes beside each other by all pairs that share enough of their view.

    The first node keeps the pose it believes in. Registrations that contradict the loops they are part
    of are left out, and the rest make the poses by least squares. A node that no good registration
    reaches is placed beside the earlier node that it shares most of its view with; where their
    registration degenerates, as it believes.

    Returns:
        The registrations, those that place each node beside an earlier one first; T_world_camera of all
        nodes.
    """
    partners, others = _node_pairs(frames, nodes, config)
    pairs = [*partners, *others]
    results = [_register_pair(frames, nodes, config, *pair) for pair in pairs]
    points_m = [graph_points(getattr(node, config.fusion.align_nodes_with)) for node in nodes]
    good = [place for place, result in enumerate(results) if _succeeded(result)]
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
    return registrations, tuple(poses)


def _node_pairs(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], config: PipelineConfig
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """(later, earlier) node: every node's best partner, and the other pairs that share enough.

    Where poses are unknown, so is what is shared, and all pairs are tried.
    """
    unknown = config.node_registration.start == "global"
    partners, others = [], []
    for index in range(1, len(nodes)):
        shares = [_shared_view(frames[index], nodes[index].sensor, frames[k]) for k in range(index)]
        partner = index - 1 if unknown else int(np.argmax(shares))
        partners.append((index, partner))
        others += [(index, k) for k in range(index) if k != partner and (unknown or shares[k] >= SHARED_VIEW)]
    return partners, others


def _register_pair(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], config: PipelineConfig, index: int, partner: int
) -> RegistrationResult:
    """One node's cloud onto another's, from the believed poses or from anywhere."""
    T_init = geometry.inverse(frames[partner].T_world_camera) @ frames[index].T_world_camera
    source, target = (getattr(nodes[k], config.fusion.align_nodes_with) for k in (index, partner))
    try:
        return register_from_anywhere(source, target, config.node_registration, T_init)
    except ReconstructionError as error:
        return RegistrationResult(T_init, (), False, str(error))


def _succeeded(result: RegistrationResult) -> bool:
    return bool(result.steps) and not result.stop_reason.startswith("degenerate")


def _shared_view(frame: RgbdFrame, cloud: PointCloud, other: RgbdFrame) -> float:
    """Share of a node's points that fall into another node's image, by the believed poses."""
    T_other_camera = geometry.inverse(other.T_world_camera) @ frame.T_world_camera
    points_m = geometry.apply(T_other_camera, cloud.points_m[::50])
    points_m = points_m[points_m[:, 2] > 0.1]
    uv = geometry.project(other.intrinsics, points_m)
    size_px = (other.intrinsics.width_px, other.intrinsics.height_px)
    return float(np.all((uv >= 0) & (uv < size_px), axis=1).sum()) / max(1, len(cloud) // 50)


def joined(
    nodes: Sequence[NodeClouds],
    frames: Sequence[RgbdFrame],
    poses: Sequence[FloatArray],
    mode: FusionMode,
) -> list[PointCloud]:
    """Each node's fused cloud, in its own frame, as the others leave it.

    In ``fill`` mode an inferred point stands only where no node's sensor can judge it: what one node
    had to guess, another may have measured.
    """
    if mode == "union":
        return [node.fused for node in nodes]
    clouds = []
    for index, node in enumerate(nodes):
        keep = np.ones(len(node.fused), dtype=bool)
        guessed = np.flatnonzero(node.fused.source == PointSource.INFERRED)
        for other, frame in enumerate(frames):
            if other != index:
                T_other_node = geometry.inverse(poses[other]) @ poses[index]
                cloud = node.fused.select(guessed)
                keep[guessed] &= hidden_from(cloud, T_other_node, frame.intrinsics, frame.depth)
        clouds.append(node.fused.select(keep))
    return clouds


def surfaces_before_and_after(
    nodes: Sequence[NodeClouds],
    frames: Sequence[RgbdFrame],
    poses: Sequence[FloatArray],
    config: PipelineConfig,
) -> Surfaces:
    """Roll the same balls over the sensor cloud and over the fused cloud of all nodes."""
    sensor, fused = merged_clouds(nodes, frames, poses, config)
    cameras = [Camera(frame.intrinsics, pose) for frame, pose in zip(frames, poses, strict=True)]
    r_F_m, sigma_D_m = spacing(fused.points_m)
    radii_m = radii(config.surface, r_F_m, sigma_D_m)
    before = reconstruct_surface(sensor, radii_m, cameras)
    after = reconstruct_surface(fused, radii_m, cameras)
    return Surfaces(sensor, fused, r_F_m, sigma_D_m, before, after)


def merged_clouds(
    nodes: Sequence[NodeClouds],
    frames: Sequence[RgbdFrame],
    poses: Sequence[FloatArray],
    config: PipelineConfig,
) -> tuple[PointCloud, PointCloud]:
    """The sensor cloud and the fused cloud of all nodes in the world frame, thinned alike, with normals."""
    joint = joined(nodes, frames, poses, config.fusion.mode)
    everything = PointCloud.concatenate(_placed(joint, poses))
    voxel_m = voxel_for_count(everything.points_m, config.surface.max_points)

    def merged(clouds: Sequence[PointCloud]) -> PointCloud:
        thin = [
            replace(estimate_normals(voxel_average(cloud, voxel_m), np.zeros(3)), pixels=None)
            for cloud in clouds
        ]
        placed = _placed(thin, poses)
        whole = placed[0] if len(placed) == 1 else voxel_average(PointCloud.concatenate(placed), voxel_m)
        return smooth(whole, config.surface.smoothing_passes)

    return merged([node.sensor for node in nodes]), merged(joint)


def _placed(clouds: Sequence[PointCloud], poses: Sequence[FloatArray]) -> list[PointCloud]:
    """Clouds in their own frames, moved to the world frame."""
    return [cloud.transformed(pose) for cloud, pose in zip(clouds, poses, strict=True)]
