"""The chain: every stage is a function of its own part of the settings and of the results before it.

``pipeline.spec`` says what each depends on, ``STAGES`` what each does, and ``run`` goes down both. A
cache keeps results by ``spec.key``; the command line passes none, the app its store. Whoever needs one
result only (a screen, a moment of a delivery) asks for that stage.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Hashable, Iterable, Sequence
from concurrent.futures import wait
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, Protocol, TypeVar

import numpy as np

from packetmesh.progress import Progress, drain
from pipeline.acquisition import Acquired, acquire
from pipeline.config import (
    AcquisitionConfig,
    DepthConfig,
    FusionMode,
    NodePoints,
    RegistrationConfig,
    SurfaceConfig,
)
from pipeline.depth import DepthNetwork
from pipeline.kernels.rays import Camera
from pipeline.kernels.threads import threads
from pipeline.merging import FusedCloud, MergedClouds, merge, merge_fused
from pipeline.nodes import (
    InferredDepth,
    NodeClouds,
    infer_depth,
    nothing_inferred,
    prepare_node,
)
from pipeline.placement.outcome import Placement, whole_placement
from pipeline.placement.pairwise import place_nodes
from pipeline.sources import Source
from pipeline.spec import CHAIN, NEEDS, SIDE_BY_SIDE, Spec, StageName, key
from pipeline.surface.ball_pivoting import roll_or_nothing
from pipeline.surface.baselines import alpha_surface, poisson_surface
from pipeline.surface.quality import measured
from pipeline.surface.radii import radii
from pipeline.surface.texture import photographed
from pipeline.surface.truth import Yardstick, compare_with_truth, yardstick_of
from pipeline.types import DepthMap, PointCloud, Rig, Surface, SurfaceResult, Texture

Result = TypeVar("Result")
_NODES_AT_A_TIME = 3
"""Of three on two cores, the last would else work alone; more would need more memory."""
Steps = Generator[Progress, None, Result]


@dataclass(frozen=True, slots=True)
class Done:
    """The result of a stage, and the time it took when it was computed, without the stages before it."""

    value: Any
    elapsed_s: float
    """Two stages side by side take longer than each alone, and less than one after the other."""


class Cache(Protocol):
    """Keeps results of stages."""

    def remember(self, key: tuple[Hashable, ...], compute: Callable[[], Steps[Done]]) -> Steps[Done]:
        """The result for ``key``, computed only if it is not there; ``key[0]`` names the stage."""
        ...


class RunCache:
    """Keeps what one run computes, in memory."""

    def __init__(self) -> None:
        self._results: dict[tuple[Hashable, ...], Done] = {}

    def remember(self, key: tuple[Hashable, ...], compute: Callable[[], Steps[Done]]) -> Steps[Done]:
        """As ``Cache.remember``."""
        if key not in self._results:
            self._results[key] = yield from compute()
        return self._results[key]


def compute(spec: Spec, stage: StageName, cache: Cache) -> Steps[Done]:
    """The result of one stage, with whatever has to be computed before it.

    Raises:
        PacketMeshError: a stage cannot work with what it was given; the message says why.
    """

    def work() -> Steps[Done]:
        needs = NEEDS[stage]
        earlier = yield from run(spec, cache, needs.after)
        started = time.perf_counter()
        value = yield from STAGES[stage](*needs.settings(spec), *(done.value for done in earlier.values()))
        return Done(value, time.perf_counter() - started)

    return (yield from cache.remember(key(spec, stage), work))


def run(
    spec: Spec, cache: Cache | None = None, stages: Iterable[StageName] = CHAIN
) -> Steps[dict[StageName, Done]]:
    """All results of the chain, or those of some stages; two that do not wait for each other side by side.

    Raises:
        PacketMeshError: as ``compute``.
    """
    cache = cache or RunCache()
    results: dict[StageName, Done] = {}
    names = list(stages)
    for stage, following in zip(names, [*names[1:], None], strict=False):  # of no stages, none follows
        if stage in results:
            continue
        if following and (stage, following) in SIDE_BY_SIDE and _ready(following, results):
            beside = threads("stage", 1).submit(drain, compute(spec, following, cache))
            try:
                results[stage] = yield from compute(spec, stage, cache)
            finally:
                wait([beside])
            results[following] = beside.result()
        else:
            results[stage] = yield from compute(spec, stage, cache)
    return results


def _ready(stage: StageName, results: dict[StageName, Done]) -> bool:
    """Whether all that a stage needs is there, so that no other thread computes it at the same time."""
    return results.keys() >= set(NEEDS[stage].after)


# The stages.


def open_rig(source: Source) -> Steps[Rig]:
    """The images and, where it is known, the truth."""
    yield Progress(f"loading {source.title}", 0.0)
    return source.load()


def infer_depths(depth: DepthConfig, rig: Rig) -> Steps[tuple[InferredDepth, ...]]:
    """The depth network's answer to every node's colour image."""
    yield Progress("loading the depth network", 0.05)
    network = DepthNetwork.of(depth)
    inferred = []
    for index, frame in enumerate(rig.frames):
        yield Progress(f"inferring the depth of {frame.name}", 0.1 + 0.1 * index / len(rig.frames))
        seen = frame.rgb_known is None or frame.rgb_known.any()
        inferred.append(infer_depth(network, frame, depth.crop) if seen else nothing_inferred(frame))
    return tuple(inferred)


def acquired_depths(acquisition: AcquisitionConfig, rig: Rig) -> Steps[tuple[Acquired, ...]]:
    """Every node's measured depth and its outliers; colour has no say in it."""
    work = [partial(acquire, frame, acquisition) for frame in rig.frames]
    return (yield from _side_by_side(work, rig, "outliers of", 0.2, 0.3))


def prepare_nodes(
    depth: DepthConfig,
    mode: FusionMode,
    registration: RegistrationConfig | None,
    rig: Rig,
    inferred: tuple[InferredDepth, ...],
    acquired: tuple[Acquired, ...],
) -> Steps[tuple[NodeClouds, ...]]:
    """The clouds of every node."""
    parts = zip(rig.frames, inferred, acquired, strict=True)
    work = [partial(prepare_node, *part, depth, mode, registration) for part in parts]
    return (yield from _side_by_side(work, rig, "clouds of", 0.3, 0.45))


def _side_by_side(
    work: Sequence[Callable[[], Result]], rig: Rig, what: str, begin: float, end: float
) -> Steps[tuple[Result, ...]]:
    """What each node's work gives, a few at a time: most of it leaves Python's lock to the others."""
    results = []
    begun = [threads("nodes", _NODES_AT_A_TIME).submit(part) for part in work]
    try:
        for index, (frame, part) in enumerate(zip(rig.frames, begun, strict=True)):
            yield Progress(f"{what} {frame.name}", begin + (end - begin) * index / len(begun))
            results.append(part.result())
    finally:
        for part in begun:
            part.cancel()
    return tuple(results)


def register_nodes(
    config: RegistrationConfig, align_with: NodePoints, rig: Rig, nodes: tuple[NodeClouds, ...]
) -> Steps[Placement]:
    """Where the nodes stand."""
    yield Progress("registering the nodes", 0.45)
    return place_nodes(rig.frames, nodes, config, align_with)


def fused_cloud(
    mode: FusionMode,
    max_points: int,
    smoothing_passes: int,
    rig: Rig,
    nodes: tuple[NodeClouds, ...],
    placement: Placement,
) -> Steps[FusedCloud]:
    """The cloud that the ball rolls over."""
    yield Progress("merging the clouds", 0.6)
    return merge_fused(
        placement.placed(rig.frames),
        placement.placed(nodes),
        placement.placed(placement.T_world_camera),
        mode,
        max_points,
        smoothing_passes,
    )


def both_clouds(
    smoothing_passes: int, nodes: tuple[NodeClouds, ...], placement: Placement, fused: FusedCloud
) -> Steps[MergedClouds]:
    """The same beside the sensors' own points, thinned alike."""
    yield Progress("merging the sensors' clouds", 0.75)
    if fused.measured is None:
        own = [node.sensor for node in placement.placed(nodes)]
        poses = placement.placed(placement.T_world_camera)
        sensor = merge(own, poses, fused.voxel_m, smoothing_passes)
    else:
        sensor = fused.fused.select(np.arange(fused.measured))
    return MergedClouds(sensor, fused.fused, fused.r_F_m, fused.sigma_D_m)


def roll_over(
    name: Literal["fused", "sensor"],
    fraction: float,
    config: SurfaceConfig,
    rig: Rig,
    placement: Placement,
    clouds: FusedCloud | MergedClouds,
) -> Steps[SurfaceResult]:
    """The surface of one of the clouds; without a triangle where the ball falls through everywhere."""
    yield Progress(f"rolling the ball over the {name} cloud", fraction)
    cloud: PointCloud = getattr(clouds, name)
    surface = roll_or_nothing(cloud, radii(config, clouds.r_F_m, clouds.sigma_D_m))
    return measured(surface, cameras_of(rig, placement), len(cloud), _sensed(rig, placement))


Truth = tuple[dict[str, float] | None, dict[str, float] | None]
"""The surfaces before and after fusion compared with the truth; None where it or the surface is missing."""


def compare(rig: Rig, placement: Placement, after: SurfaceResult, before: SurfaceResult) -> Steps[Truth]:
    """Both surfaces against the truth."""
    if rig.truth is None:
        return None, None
    yield Progress("comparing with the truth", 0.9)
    yardstick = yardstick_of_rig(rig)
    return compared(rig, placement, before, yardstick), compared(rig, placement, after, yardstick)


def poisson(rig: Rig, placement: Placement, clouds: FusedCloud) -> Steps[SurfaceResult]:
    """Screened Poisson reconstruction of the fused cloud, a baseline beside the ball."""
    yield Progress("Poisson reconstruction", 0.7)
    return with_rays(poisson_surface(clouds.fused, clouds.r_F_m), rig, placement)


def alpha(config: SurfaceConfig, rig: Rig, placement: Placement, clouds: FusedCloud) -> Steps[SurfaceResult]:
    """The alpha shape of the fused cloud with the radius of the largest ball, a baseline beside the ball."""
    yield Progress("the alpha shape", 0.7)
    largest_m = radii(config, clouds.r_F_m, clouds.sigma_D_m)[-1]
    return with_rays(alpha_surface(clouds.fused, largest_m), rig, placement)


def with_rays(surface: SurfaceResult, rig: Rig, placement: Placement) -> SurfaceResult:
    """The surface with what the registered cameras' rays measure of it."""
    cameras, quality = cameras_of(rig, placement), surface.quality
    points = len(surface.vertices_m) + quality.unused_points
    return measured(surface, cameras, points, _sensed(rig, placement))


def yardstick_of_rig(rig: Rig) -> Yardstick | None:
    """For those who compare several surfaces of one rig; None without truth."""
    return None if rig.truth is None else yardstick_of(rig.truth)


def compared(
    rig: Rig, placement: Placement, surface: SurfaceResult, yardstick: Yardstick | None = None
) -> dict[str, float] | None:
    """A surface against the truth of its rig; None without truth or without a triangle."""
    if rig.truth is None or not len(surface.triangles):
        return None
    cameras = cameras_of(rig, whole_placement(rig, range(len(rig.frames)), placement))
    return compare_with_truth(surface.vertices_m, surface.triangles, rig.truth, cameras, yardstick)


def cameras_of(rig: Rig, placement: Placement) -> list[Camera]:
    """The registered cameras, whose rays measure a surface; none of a node that found no place."""
    return [
        Camera(frame.intrinsics, pose)
        for frame, pose in placement.placed(list(zip(rig.frames, placement.T_world_camera, strict=True)))
    ]


def dressed(rig: Rig, placement: Placement, surface: Surface) -> Texture:
    """The photographs of the registered cameras on a surface."""
    pictures = [(frame.rgb, frame.rgb_known) for frame in placement.placed(rig.frames)]
    return photographed(surface, cameras_of(rig, placement), pictures)


def _sensed(rig: Rig, placement: Placement) -> list[DepthMap]:
    """What the registered cameras measured."""
    return [frame.depth for frame in placement.placed(rig.frames)]


STAGES: dict[StageName, Callable[..., Steps[Any]]] = {
    "rig": open_rig,
    "inferred": infer_depths,
    "outliers": acquired_depths,
    "nodes": prepare_nodes,
    "placement": register_nodes,
    "fused": fused_cloud,
    "clouds": both_clouds,
    "after": partial(roll_over, "fused", 0.7),
    "before": partial(roll_over, "sensor", 0.8),
    "truth": compare,
    "poisson": poisson,
    "alpha": alpha,
}
"""What each stage does with its settings and the results of the stages before it, as ``NEEDS`` names them."""
