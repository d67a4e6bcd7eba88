"""The stages of one spec, each remembered, each from the one before it."""

from __future__ import annotations

import functools
import hashlib
import time
from collections import OrderedDict
from collections.abc import Generator, Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from app.records import SpacingView
from app.state import Spec
from app.store import Store
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import Progress
from pipeline.config import DepthConfig
from pipeline.depth import DepthNetwork, Overrides
from pipeline.io.demos import load_demo
from pipeline.io.rigs import load_frame, load_rig
from pipeline.reconstruct import (
    NodeClouds,
    NodeRegistration,
    merged_clouds,
    prepare_node,
    register_nodes,
)
from pipeline.surface import Camera, compare_with_truth, measured, radii, roll_ball, spacing
from pipeline.types import ByteArray, DepthMap, FloatArray, PointCloud, Rig, Surface, SurfaceResult

HISTOGRAM_BINS = 60
REMEMBERED_INFERENCES = 12


class RememberingNetwork(DepthNetwork):
    """A depth network that does not look twice at the same image."""

    def __init__(self, model: str | None, preset: str | None, overrides: Overrides) -> None:
        super().__init__(model, preset, overrides)
        self._seen: OrderedDict[Hashable, DepthMap] = OrderedDict()
        self.elapsed_s: float | None = None
        """Time of the last inference; None if its result was remembered."""

    def infer(self, rgb: ByteArray, crop: bool = False) -> DepthMap:
        """As ``DepthNetwork.infer``."""
        key = (hashlib.sha256(np.ascontiguousarray(rgb).data).digest(), crop)
        if key in self._seen:
            self.elapsed_s = None
            return self._seen[key]
        started = time.perf_counter()
        depth = super().infer(rgb, crop=crop)
        self.elapsed_s = time.perf_counter() - started
        self._seen[key] = depth
        if len(self._seen) > REMEMBERED_INFERENCES:
            self._seen.popitem(last=False)
        return depth


def network_for(config: DepthConfig) -> RememberingNetwork:
    """The network that the settings name, loaded once in a process."""
    return _loaded(config.model, config.preset, Overrides.of(config))


@functools.lru_cache(maxsize=2)
def _loaded(model: str | None, preset: str | None, overrides: Overrides) -> RememberingNetwork:
    return RememberingNetwork(model, preset, overrides)


@dataclass(frozen=True, slots=True)
class PreparedNodes:
    """The depth stage of all nodes."""

    nodes: tuple[NodeClouds, ...]
    inference_s: tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class PlacedNodes:
    """The nodes beside each other."""

    registrations: tuple[NodeRegistration, ...]
    T_world_camera: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True)
class BallClouds:
    """The clouds that the ball rolls over, world frame, with normals."""

    sensor: PointCloud
    fused: PointCloud
    spacing: SpacingView


def rig_of(store: Store, spec: Spec) -> Generator[Progress, None, Rig]:
    """The images and, for demo scenes, the truth."""

    def load() -> Generator[Progress, None, Rig]:
        yield Progress(f"loading {spec.source.title}", 0.1)
        source = spec.source
        if source.scene is not None:
            return load_demo(source.scene)
        if source.rig is not None:
            return load_rig(source.rig)
        if source.color is None or source.depth is None or source.intrinsics is None:
            raise InputError("A pair needs a colour image, a depth image and intrinsics; add all three.")
        frame = load_frame(source.color, source.depth, source.intrinsics, source.depth_scale)
        return Rig("uploaded pair", (frame,))

    return (yield from store.remember(spec.key("scene"), load))


def prepared(store: Store, spec: Spec) -> Generator[Progress, None, PreparedNodes]:
    """The clouds of every node."""

    def prepare() -> Generator[Progress, None, PreparedNodes]:
        rig = yield from rig_of(store, spec)
        yield Progress("loading the depth network", 0.05)
        network = network_for(spec.config.depth)
        nodes, times = [], []
        for index, frame in enumerate(rig.frames):
            yield Progress(f"depth of {frame.name}", 0.1 + 0.8 * index / len(rig.frames))
            nodes.append(prepare_node(frame, spec.config, network))
            times.append(network.elapsed_s)
        return PreparedNodes(tuple(nodes), tuple(times))

    return (yield from store.remember(spec.key("depth"), prepare))


def placed(store: Store, spec: Spec) -> Generator[Progress, None, PlacedNodes]:
    """Where the nodes are."""

    def place() -> Generator[Progress, None, PlacedNodes]:
        rig = yield from rig_of(store, spec)
        clouds = yield from prepared(store, spec)
        yield Progress("registering the nodes", 0.3)
        return PlacedNodes(*register_nodes(rig.frames, clouds.nodes, spec.config))

    return (yield from store.remember(spec.key("fuse"), place))


def ball_clouds(store: Store, spec: Spec) -> Generator[Progress, None, BallClouds]:
    """The thinned clouds before and after fusion, and how far apart their points are."""

    def merge() -> Generator[Progress, None, BallClouds]:
        rig = yield from rig_of(store, spec)
        clouds = yield from prepared(store, spec)
        places = yield from placed(store, spec)
        yield Progress("merging the clouds", 0.2)
        sensor, fused = merged_clouds(clouds.nodes, rig.frames, places.T_world_camera, spec.config)
        return BallClouds(sensor, fused, _spacing_view(sensor, fused))

    return (yield from store.remember(("clouds", *cloud_key(spec)), merge))


def cloud_key(spec: Spec) -> tuple[Hashable, ...]:
    """What the clouds that the ball rolls over depend on."""
    surface = spec.config.surface
    return (*spec.key("fuse"), surface.max_points, surface.smoothing_passes)


@dataclass(frozen=True, slots=True)
class RolledBalls:
    """The surfaces of a spec; while they are made, what is there so far."""

    radii_m: tuple[float, ...]
    after: SurfaceResult
    before: SurfaceResult | None
    elapsed_s: float
    """Of the surface after fusion."""


def rolled(store: Store, spec: Spec) -> Generator[Progress | RolledBalls, None, RolledBalls]:
    """Both surfaces, with the same radii; first their shape, then what the cameras' rays say about it."""
    rig = yield from rig_of(store, spec)
    places = yield from placed(store, spec)
    clouds = yield from ball_clouds(store, spec)
    cameras = cameras_of(rig, places)
    radii_m = radii(spec.config.surface, clouds.spacing.r_F_m, clouds.spacing.sigma_D_m)

    def roll() -> Generator[Progress | RolledBalls, None, RolledBalls]:
        yield Progress("rolling the ball over the fused cloud", 0.2)
        started = time.perf_counter()
        after = rolled_over(clouds.fused, radii_m)
        elapsed_s = time.perf_counter() - started
        yield RolledBalls(radii_m, measured(after, (), len(clouds.fused)), None, elapsed_s)
        yield Progress("rolling the ball over the sensor cloud", 0.5)
        before = rolled_over(clouds.sensor, radii_m)
        yield Progress("counting the rays that miss", 0.7)
        return RolledBalls(
            radii_m,
            measured(after, cameras, len(clouds.fused)),
            measured(before, cameras, len(clouds.sensor)),
            elapsed_s,
        )

    return (yield from store.remember(spec.key("surface"), roll))


def rolled_over(cloud: PointCloud, radii_m: tuple[float, ...]) -> Surface:
    """The surface of a cloud; without a triangle if the ball falls through everywhere."""
    try:
        return roll_ball(cloud, radii_m)
    except ReconstructionError:
        return Surface(np.empty((0, 3)), np.empty((0, 3), np.int32), None, radii_m)


def cameras_of(rig: Rig, places: PlacedNodes) -> list[Camera]:
    """The registered cameras, whose rays measure the surface."""
    return [
        Camera(frame.intrinsics, pose) for frame, pose in zip(rig.frames, places.T_world_camera, strict=True)
    ]


def compared(rig: Rig, surface: SurfaceResult, cameras: Sequence[Camera]) -> dict[str, float] | None:
    """How far a surface is from the truth, where there is one."""
    if rig.truth is None or not len(surface.triangles):
        return None
    return compare_with_truth(surface.vertices_m, surface.triangles, rig.truth, cameras)


def _spacing_view(sensor: PointCloud, fused: PointCloud) -> SpacingView:
    r_F_m, sigma_D_m = spacing(fused.points_m)
    distances_m = cKDTree(fused.points_m).query(fused.points_m, k=2)[0][:, 1]
    counts, edges_m = np.histogram(distances_m, bins=HISTOGRAM_BINS, range=(0.0, r_F_m + 5 * sigma_D_m))
    return SpacingView(r_F_m, sigma_D_m, edges_m, counts, len(sensor), len(fused))
