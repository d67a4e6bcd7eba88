"""The chain: every stage is a function of its own part of the settings and of the results before it.

``STAGES`` is the whole chain as a table, and ``run`` goes down it. A cache keeps each result by
``key``, which holds exactly what the result depends on; the command line passes none, the app its
store. Whoever needs one result only (a screen, a moment of a delivery) asks for that stage.
"""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable, Generator, Hashable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol, TypeVar, get_args

from packetmesh.progress import Progress
from packetmesh.settings import differences
from pipeline.config import (
    PRESETS,
    AcquisitionConfig,
    DepthConfig,
    FusionMode,
    NodePoints,
    PipelineConfig,
    RegistrationConfig,
    SurfaceConfig,
)
from pipeline.depth import DepthNetwork, Overrides
from pipeline.merging import MergedClouds, merge_clouds
from pipeline.nodes import InferredDepth, NodeClouds, Placement, infer_depth, place_nodes, prepare_node
from pipeline.sources import Source
from pipeline.surface import Camera, compare_with_truth, measured, radii, roll_or_nothing
from pipeline.types import PointCloud, Rig, SurfaceResult

StageName = Literal["rig", "inferred", "nodes", "placement", "clouds", "after", "before", "truth"]
Result = TypeVar("Result")
Steps = Generator[Progress, None, Result]


@dataclass(frozen=True, slots=True)
class Spec:
    """Everything that decides what the chain computes."""

    source: Source
    preset: str = "packetmesh"
    """The preset that ``config`` started from; it decides nothing but the command line."""
    config: PipelineConfig = field(default_factory=PipelineConfig)

    def with_preset(self, preset: str) -> Spec:
        """The same source with a preset's config."""
        return replace(self, preset=preset, config=PRESETS[preset])

    def command(self, out: str = "runs/from-app") -> str:
        """The command line that computes the same."""
        words = ["packetmesh", "reconstruct", *self.source.arguments(), "--preset", self.preset]
        changed = differences(self.config, PRESETS[self.preset])
        if changed:
            words += ["--set", *changed]
        return shlex.join([*words, "--out", out])


@dataclass(frozen=True, slots=True)
class Done:
    """The result of a stage, and the time it took when it was computed, without the stages before it."""

    value: Any
    elapsed_s: float


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


@dataclass(frozen=True, slots=True)
class Stage:
    """One row of the chain."""

    compute: Callable[..., Steps[Any]]
    """Called with its settings, then with the results of the stages before it."""
    settings: Callable[[Spec], tuple[Any, ...]]
    """The part of the spec that it depends on."""
    after: tuple[StageName, ...] = ()
    """The stages whose results it takes, in their order."""


def key(spec: Spec, stage: StageName) -> tuple[Hashable, ...]:
    """What a stage's result depends on; equal keys mean equal results."""
    row = STAGES[stage]
    return (stage, *row.settings(spec), *(key(spec, earlier) for earlier in row.after))


def compute(spec: Spec, stage: StageName, cache: Cache) -> Steps[Done]:
    """The result of one stage, with whatever has to be computed before it.

    Raises:
        PacketMeshError: a stage cannot work with what it was given; the message says why.
    """

    def work() -> Steps[Done]:
        row = STAGES[stage]
        earlier = yield from run(spec, cache, row.after)
        started = time.perf_counter()
        value = yield from row.compute(*row.settings(spec), *(done.value for done in earlier.values()))
        return Done(value, time.perf_counter() - started)

    return (yield from cache.remember(key(spec, stage), work))


def run(
    spec: Spec, cache: Cache | None = None, stages: Iterable[StageName] = get_args(StageName)
) -> Steps[dict[StageName, Done]]:
    """All results of the chain, or those of some stages.

    Raises:
        PacketMeshError: as ``compute``.
    """
    cache = cache or RunCache()
    results: dict[StageName, Done] = {}
    for stage in stages:
        results[stage] = yield from compute(spec, stage, cache)
    return results


# The stages.


def open_rig(source: Source) -> Steps[Rig]:
    """The images and, where it is known, the truth."""
    yield Progress(f"loading {source.title}", 0.0)
    return source.load()


def infer_depths(
    model: str | None, preset: str | None, overrides: Overrides, crop: bool, rig: Rig
) -> Steps[tuple[InferredDepth, ...]]:
    """The depth network's answer to every node's colour image."""
    yield Progress("loading the depth network", 0.05)
    network = DepthNetwork(model, preset, overrides)
    inferred = []
    for index, frame in enumerate(rig.frames):
        yield Progress(f"inferring the depth of {frame.name}", 0.1 + 0.1 * index / len(rig.frames))
        inferred.append(infer_depth(network, frame, crop))
    return tuple(inferred)


def prepare_nodes(
    acquisition: AcquisitionConfig,
    depth: DepthConfig,
    mode: FusionMode,
    registration: RegistrationConfig | None,
    rig: Rig,
    inferred: tuple[InferredDepth, ...],
) -> Steps[tuple[NodeClouds, ...]]:
    """The clouds of every node."""
    nodes = []
    for index, (frame, answer) in enumerate(zip(rig.frames, inferred, strict=True)):
        yield Progress(f"clouds of {frame.name}", 0.2 + 0.25 * index / len(rig.frames))
        nodes.append(prepare_node(frame, answer, acquisition, depth, mode, registration))
    return tuple(nodes)


def register_nodes(
    config: RegistrationConfig, align_with: NodePoints, rig: Rig, nodes: tuple[NodeClouds, ...]
) -> Steps[Placement]:
    """Where the nodes stand."""
    yield Progress("registering the nodes", 0.45)
    return place_nodes(rig.frames, nodes, config, align_with)


def merge(
    mode: FusionMode,
    max_points: int,
    smoothing_passes: int,
    rig: Rig,
    nodes: tuple[NodeClouds, ...],
    placement: Placement,
) -> Steps[MergedClouds]:
    """The clouds that the ball rolls over."""
    yield Progress("merging the clouds", 0.6)
    return merge_clouds(rig.frames, nodes, placement.T_world_camera, mode, max_points, smoothing_passes)


def roll_after(
    config: SurfaceConfig, rig: Rig, placement: Placement, clouds: MergedClouds
) -> Steps[SurfaceResult]:
    """The surface of the fused cloud; without a triangle where the ball falls through everywhere."""
    yield Progress("rolling the ball over the fused cloud", 0.7)
    return _rolled(config, rig, placement, clouds, clouds.fused)


def roll_before(
    config: SurfaceConfig, rig: Rig, placement: Placement, clouds: MergedClouds
) -> Steps[SurfaceResult]:
    """The surface of the sensor cloud, by the same balls."""
    yield Progress("rolling the ball over the sensor cloud", 0.8)
    return _rolled(config, rig, placement, clouds, clouds.sensor)


def _rolled(
    config: SurfaceConfig, rig: Rig, placement: Placement, clouds: MergedClouds, cloud: PointCloud
) -> SurfaceResult:
    surface = roll_or_nothing(cloud, radii(config, clouds.r_F_m, clouds.sigma_D_m))
    return measured(surface, cameras_of(rig, placement), len(cloud), [frame.depth for frame in rig.frames])


Truth = tuple[dict[str, float] | None, dict[str, float] | None]
"""The surfaces before and after fusion compared with the truth; None where it or the surface is missing."""


def compare(rig: Rig, placement: Placement, after: SurfaceResult, before: SurfaceResult) -> Steps[Truth]:
    """Both surfaces against the truth."""
    if rig.truth is None:
        return None, None
    yield Progress("comparing with the truth", 0.9)
    return compared(rig, placement, before), compared(rig, placement, after)


def compared(rig: Rig, placement: Placement, surface: SurfaceResult) -> dict[str, float] | None:
    """A surface against the truth of its rig; None without truth or without a triangle."""
    if rig.truth is None or not len(surface.triangles):
        return None
    cameras = cameras_of(rig, placement)
    return compare_with_truth(surface.vertices_m, surface.triangles, rig.truth, cameras)


def cameras_of(rig: Rig, placement: Placement) -> list[Camera]:
    """The registered cameras, whose rays measure a surface."""
    return [
        Camera(frame.intrinsics, pose)
        for frame, pose in zip(rig.frames, placement.T_world_camera, strict=True)
    ]


STAGES: dict[StageName, Stage] = {
    "rig": Stage(open_rig, lambda spec: (spec.source,)),
    "inferred": Stage(
        infer_depths,
        lambda spec: (
            spec.config.depth.model,
            spec.config.depth.preset,
            Overrides.of(spec.config.depth),
            spec.config.depth.crop,
        ),
        ("rig",),
    ),
    "nodes": Stage(
        prepare_nodes,
        lambda spec: (
            spec.config.acquisition,
            spec.config.depth,
            spec.config.fusion.mode,
            spec.config.inferred_registration if spec.config.fusion.register_inferred else None,
        ),
        ("rig", "inferred"),
    ),
    "placement": Stage(
        register_nodes,
        lambda spec: (spec.config.node_registration, spec.config.fusion.align_nodes_with),
        ("rig", "nodes"),
    ),
    "clouds": Stage(
        merge,
        lambda spec: (
            spec.config.fusion.mode,
            spec.config.surface.max_points,
            spec.config.surface.smoothing_passes,
        ),
        ("rig", "nodes", "placement"),
    ),
    "after": Stage(roll_after, lambda spec: (spec.config.surface,), ("rig", "placement", "clouds")),
    "before": Stage(roll_before, lambda spec: (spec.config.surface,), ("rig", "placement", "clouds")),
    "truth": Stage(compare, lambda spec: (), ("rig", "placement", "after", "before")),
}
"""The chain, in the order in which a run computes it."""
