"""Stages of the chain: each is a function of its own settings and of the results of earlier stages.

``pipeline.spec`` has the dependencies of each stage, ``STAGES`` its function, and ``run`` follows both. A
cache stores results by ``spec.key``: the app passes its store, the command line none. A caller that needs
a single result (a screen, a moment of a delivery) requests that stage.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Hashable, Iterable, Sequence
from concurrent.futures import wait
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, Protocol, TypeVar

import numpy as np

from packetmesh.progress import Progress, drain, part
from pipeline.acquisition import Acquired, acquire, without_rayless
from pipeline.config import (
    MOST_AVERAGED,
    AcquisitionConfig,
    DepthConfig,
    FusionMode,
    NodePoints,
    RegistrationConfig,
    SurfaceConfig,
)
from pipeline.depth import DepthNetwork
from pipeline.io.textures import Texture
from pipeline.kernels.rays import Camera
from pipeline.kernels.threads import threads
from pipeline.merging import FusedCloud, MergedClouds, merge, merge_fused, merge_map
from pipeline.nodes import (
    InferredDepth,
    NodeClouds,
    infer_depth,
    nothing_inferred,
    prepare_node,
    with_coarse_depth,
)
from pipeline.placement.outcome import Placement, whole_placement
from pipeline.placement.pairwise import place_nodes
from pipeline.placement.walked import place_walked
from pipeline.recording.opening import iterate_recording
from pipeline.recording.rig import holds_recordings, iterate_recorded_rig
from pipeline.recording.truth import with_true_path
from pipeline.sources import Recorded, RigFolder, Source
from pipeline.spec import CHAIN, NEEDS, SIDE_BY_SIDE, Spec, StageName, key
from pipeline.surface.ball_pivoting import roll_or_nothing
from pipeline.surface.baselines import alpha_surface, poisson_surface
from pipeline.surface.quality import measured
from pipeline.surface.radii import radii
from pipeline.surface.rims import even_rims
from pipeline.surface.texture import photographed
from pipeline.surface.truth import Yardstick, compare_with_truth, yardstick_of
from pipeline.types import DepthMap, PointCloud, Rig, Surface, SurfaceResult

Result = TypeVar("Result")
_NODES_AT_A_TIME = 3
"""Nodes computed in parallel: with two, the last node of three would run alone; more need more memory."""
TRACKED = (0.0, 0.01, 0.05, 0.9, 1.0), (0.0, 0.01, 0.45, 0.9, 1.0)
"""Shares of progress of a rig, and those of a recording at the same places: tracking, loops and map of a walk
take nearly half of the time."""
Steps = Generator[Progress, None, Result]


@dataclass(frozen=True, slots=True)
class Done:
    """The result of a stage, and the time it took to compute, without the stages before it."""

    value: Any
    elapsed_s: float
    """Two parallel stages each take longer than alone; together they take less than one after the other."""


class Cache(Protocol):
    """Stores results of stages."""

    def remember(self, key: tuple[Hashable, ...], compute: Callable[[], Steps[Done]]) -> Steps[Done]:
        """Return the result for ``key``, computing it if it is not stored; ``key[0]`` names the stage."""
        ...


class RunCache:
    """Stores the results of one run in memory."""

    def __init__(self) -> None:
        self._results: dict[tuple[Hashable, ...], Done] = {}

    def remember(self, key: tuple[Hashable, ...], compute: Callable[[], Steps[Done]]) -> Steps[Done]:
        """Return the result for ``key`` as ``Cache.remember`` does."""
        if key not in self._results:
            self._results[key] = yield from compute()
        return self._results[key]


def compute(spec: Spec, stage: StageName, cache: Cache) -> Steps[Done]:
    """Compute the result of one stage, and before it all results that it needs.

    Raises:
        PacketMeshError: a stage cannot work with its input; the message says why.
    """

    def work() -> Steps[Done]:
        needs = NEEDS[stage]
        earlier = yield from run(spec, cache, needs.after)
        started = time.perf_counter()
        steps = STAGES[stage](*needs.settings(spec), *(done.value for done in earlier.values()))
        value = yield from (_tracked(steps) if isinstance(spec.source, Recorded) else steps)
        return Done(value, time.perf_counter() - started)

    return (yield from cache.remember(key(spec, stage), work))


def run(
    spec: Spec, cache: Cache | None = None, stages: Iterable[StageName] = CHAIN
) -> Steps[dict[StageName, Done]]:
    """Compute all results of the chain, or those of some stages; independent stages may run in parallel.

    Raises:
        PacketMeshError: as ``compute``.
    """
    cache = cache or RunCache()
    results: dict[StageName, Done] = {}
    names = list(stages)
    for stage, following in zip(names, [*names[1:], None], strict=False):  # stages may be empty
        if stage in results:
            continue
        if following and (stage, following) in SIDE_BY_SIDE and _ready(following, results):
            parallel = threads("stage", 1).submit(drain, compute(spec, following, cache))
            try:
                results[stage] = yield from compute(spec, stage, cache)
            finally:
                wait([parallel])
            results[following] = parallel.result()
        else:
            results[stage] = yield from compute(spec, stage, cache)
    return results


def _ready(stage: StageName, results: dict[StageName, Done]) -> bool:
    """Return whether all inputs of a stage are computed, so that two threads do not compute the same."""
    return results.keys() >= set(NEEDS[stage].after)


def _tracked(steps: Steps[Result]) -> Steps[Result]:
    """Rescale the progress of a stage of a recording's chain, by ``TRACKED``."""
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        yield Progress(step.stage, float(np.interp(step.fraction, *TRACKED)))


# The stages.


def open_rig(source: Source, frames: int = MOST_AVERAGED) -> Steps[Rig]:
    """Load the images and, if it is known, the truth; a recording is averaged, or tracked and mapped.

    ``frames`` is the number of a recording's frames that are averaged if its camera stands.
    """
    yield Progress(f"loading {source.title}", 0.0)
    if isinstance(source, Recorded):
        recording = yield from part(source.iterate_open(), "recording", 0.0, 0.01, detail=True)
        for note in recording.notes:
            yield Progress(note, 0.01)
        steps = iterate_recording(recording, frames)
        rig = yield from part(steps, "recording", 0.01, 0.05, detail=True)
        if source.true_path is not None:
            rig = with_true_path(rig, source.true_path)
    elif isinstance(source, RigFolder) and holds_recordings(source.path):
        steps = iterate_recorded_rig(source.path, frames, source.depth_scale)
        rig = yield from part(steps, "recordings", 0.0, 0.05, detail=True)
    else:
        rig = source.load()
    return replace(rig, frames=tuple(without_rayless(frame) for frame in rig.frames))


def infer_depths(depth: DepthConfig, rig: Rig) -> Steps[tuple[InferredDepth, ...]]:
    """Run the depth network on every node's colour image."""
    yield Progress("loading the depth network", 0.05)
    network = DepthNetwork.of(depth)
    inferred = []
    for index, frame in enumerate(rig.frames):
        yield Progress(f"inferring the depth of {frame.name}", 0.1 + 0.1 * index / len(rig.frames))
        seen = frame.rgb_known is None or frame.rgb_known.any()
        inferred.append(infer_depth(network, frame, depth.crop) if seen else nothing_inferred(frame))
    return tuple(inferred)


def acquired_depths(acquisition: AcquisitionConfig, rig: Rig) -> Steps[tuple[Acquired, ...]]:
    """Filter every node's measured depth for outliers; colour is not used."""
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
    """Compute the clouds of every node."""
    parts = zip(rig.frames, inferred, acquired, strict=True)
    work = [partial(prepare_node, *part, depth, mode, registration) for part in parts]
    return (yield from _side_by_side(work, rig, "clouds of", 0.3, 0.45))


def _side_by_side(
    work: Sequence[Callable[[], Result]], rig: Rig, what: str, begin: float, end: float
) -> Steps[tuple[Result, ...]]:
    """Run one job per node, a few in parallel (jobs mostly release Python's lock); returns their results."""
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
    config: RegistrationConfig,
    align_with: NodePoints,
    acquisition: AcquisitionConfig,
    rig: Rig,
    nodes: tuple[NodeClouds, ...],
) -> Steps[Placement]:
    """Register the nodes to one another, with the coarse depth of tiles that have not arrived; those of a
    recording are at their final poses.
    """
    yield Progress("registering the nodes", 0.45)
    if rig.walk is not None:
        return place_walked(rig.frames, nodes)
    whole = [with_coarse_depth(*both, acquisition) for both in zip(rig.frames, nodes, strict=True)]
    return place_nodes([frame for frame, _ in whole], [node for _, node in whole], config, align_with)


def fused_cloud(
    mode: FusionMode,
    max_points: int,
    smoothing_passes: int,
    rig: Rig,
    nodes: tuple[NodeClouds, ...],
    placement: Placement,
) -> Steps[FusedCloud]:
    """Merge the nodes' clouds, or a recording's map and its nodes' inferred points, into one cloud."""
    yield Progress("merging the clouds", 0.6)
    if rig.walk is not None:
        return merge_map(rig.walk, rig.frames, nodes, placement.T_world_camera, smoothing_passes)
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
    """Return the fused cloud and, thinned in the same way, the measured points alone."""
    yield Progress("merging the sensors' clouds", 0.75)
    if fused.measured is None:
        own = (node.sensor for node in placement.placed(nodes))
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
    """Make the surface of one of the clouds; it has no triangles if no ball rests on three points."""
    yield Progress(f"rolling the ball over the {name} cloud", fraction)
    cloud: PointCloud = getattr(clouds, name)
    surface = roll_or_nothing(cloud, radii(config, clouds.r_F_m, clouds.sigma_D_m))
    if config.even_rims and surface.rows is not None:
        surface = even_rims(surface, None if cloud.sigma_m is None else cloud.sigma_m[surface.rows]).surface
    return measured(surface, cameras_of(rig, placement), len(cloud), _sensed(rig, placement))


Truth = tuple[dict[str, float] | None, dict[str, float] | None]
"""Comparison of the surfaces before and after fusion with the truth; None without truth or surface."""


def compare(rig: Rig, placement: Placement, after: SurfaceResult, before: SurfaceResult) -> Steps[Truth]:
    """Compare both surfaces with the truth."""
    if rig.truth is None:
        return None, None
    yield Progress("comparing with the truth", 0.9)
    yardstick = yardstick_of_rig(rig)
    return compared(rig, placement, before, yardstick), compared(rig, placement, after, yardstick)


def poisson(rig: Rig, placement: Placement, clouds: FusedCloud) -> Steps[SurfaceResult]:
    """Make the screened Poisson surface of the fused cloud, a baseline."""
    yield Progress("Poisson reconstruction", 0.9)
    return with_rays(poisson_surface(clouds.fused, clouds.r_F_m), rig, placement)


def alpha(config: SurfaceConfig, rig: Rig, placement: Placement, clouds: FusedCloud) -> Steps[SurfaceResult]:
    """Make the alpha shape of the fused cloud with the radius of the largest ball, a baseline."""
    yield Progress("the alpha shape", 0.9)
    largest_m = radii(config, clouds.r_F_m, clouds.sigma_D_m)[-1]
    return with_rays(alpha_surface(clouds.fused, largest_m), rig, placement)


def with_rays(surface: SurfaceResult, rig: Rig, placement: Placement) -> SurfaceResult:
    """Measure a surface by the rays of the registered cameras; returns it with these measures."""
    cameras, quality = cameras_of(rig, placement), surface.quality
    points = len(surface.vertices_m) + quality.unused_points
    return measured(surface, cameras, points, _sensed(rig, placement))


def yardstick_of_rig(rig: Rig) -> Yardstick | None:
    """Prepare the truth for comparisons with several surfaces of one rig; None without truth."""
    return None if rig.truth is None else yardstick_of(rig.truth)


def compared(
    rig: Rig, placement: Placement, surface: SurfaceResult, yardstick: Yardstick | None = None
) -> dict[str, float] | None:
    """Compare a surface with the truth of its rig; None without truth or triangles."""
    if rig.truth is None or not len(surface.triangles):
        return None
    cameras = cameras_of(rig, whole_placement(rig, range(len(rig.frames)), placement))
    return compare_with_truth(surface.vertices_m, surface.triangles, rig.truth, cameras, yardstick)


def cameras_of(rig: Rig, placement: Placement) -> list[Camera]:
    """Return the registered cameras, whose rays measure a surface; nodes that found no pose are left out."""
    return [
        Camera(frame.intrinsics, pose)
        for frame, pose in placement.placed(list(zip(rig.frames, placement.T_world_camera, strict=True)))
    ]


def dressed(rig: Rig, placement: Placement, surface: Surface) -> Texture:
    """Texture a surface with the photographs of the registered cameras."""
    pictures = [(frame.rgb, frame.rgb_known) for frame in placement.placed(rig.frames)]
    return photographed(surface, cameras_of(rig, placement), pictures)


def _sensed(rig: Rig, placement: Placement) -> list[DepthMap]:
    """Return the measured depth images of the registered cameras."""
    return [frame.depth for frame in placement.placed(rig.frames)]


STAGES: dict[StageName, Callable[..., Steps[Any]]] = {
    "rig": open_rig,
    "inferred": infer_depths,
    "outliers": acquired_depths,
    "nodes": prepare_nodes,
    "placement": register_nodes,
    "fused": fused_cloud,
    "clouds": both_clouds,
    "after": partial(roll_over, "fused", 0.75),
    "before": partial(roll_over, "sensor", 0.8),
    "truth": compare,
    "poisson": poisson,
    "alpha": alpha,
}
"""Function of each stage; its arguments are settings and the results of earlier stages, as in ``NEEDS``.

The shares in the progress reports never fall, whether "clouds" is computed before "after" or after it.
"""
