"""Cases of the benchmark: two clouds of a random room, their true pose and a wrong start pose."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
from scipy.spatial import cKDTree

from lab.worlds.boxes import box_room
from lab.worlds.render import render
from lab.worlds.scene import Scene
from lab.worlds.sensor import sense_depth
from pipeline.acquisition import back_project
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.registration import fuse
from pipeline.registration.degradation import Degradation, degrade
from pipeline.types import DepthMap, FloatArray, PointCloud, PointSource, RgbdFrame

Clouds = Literal["inferred", "sensor", "fused"]

NODE_REACH_M = 1.0 / (2.0 * np.sin(np.radians(12.5)))
"""Distance from the middle at which cameras 25 degrees apart are 1 m from each other (SPEC 4.8)."""
EDGE_BLUR_PX = 1.5
"""Standard deviation of the blur of depth edges, which imitates a network's depth; 1 / z is blurred, which
leaves planes planar."""
PARTNER_M = 0.05
"""A point belongs to the overlap if the other cloud has a point within this distance at the true pose."""


@dataclass(frozen=True, slots=True)
class Condition:
    """The two kinds of clouds, their degradation, and the start error."""

    name: str
    label: str
    clouds: Clouds
    """``inferred`` registers a node's complete cloud to its sensor cloud; ``sensor`` and ``fused`` register a
    node to its neighbour, with the sensor clouds alone or with holes filled from the complete clouds."""
    bias: float = 0.0
    """Standard deviation of the complete cloud's smooth relative depth error."""
    holes: float = 1.0
    """Factor by which the area of the sensor's holes grows."""
    outliers: float = 0.0
    """Share of the sensor cloud that is replaced by outliers."""
    start_deg: float = 3.0
    start_m: float = 0.06
    """Rotation (``start_deg``) and translation of the start from the true pose."""
    angle_deg: float = 25.0
    """Angle between the directions of two nodes."""
    overlap: float | None = None
    """Share of the source's points with a partner in the target; None leaves it unchanged: about 0.6 for two
    nodes."""

    @property
    def gate_m(self) -> float:
        """T_d of all methods: 0.3 m, or twice the start's translation if that is more (SPEC 4.4)."""
        return max(0.3, 2.0 * self.start_m)


CONDITIONS: dict[str, Condition] = {
    condition.name: condition
    for condition in (
        Condition("easy", "easy", "inferred"),
        Condition("bias-3", "bias 3 %", "inferred", bias=0.03),
        Condition("bias-6", "bias 6 %", "inferred", bias=0.06),
        Condition("holes-x3", "holes x3, bias 2 %", "inferred", bias=0.02, holes=3.0),
        Condition("outliers-20", "20 % outliers, bias 2 %", "inferred", bias=0.02, outliers=0.2),
        Condition(
            "large-start", "start 15°, 30 cm, bias 2 %", "inferred", bias=0.02, start_deg=15.0, start_m=0.3
        ),
        Condition("nodes-sensor", "two nodes, sensor", "sensor"),
        Condition("nodes-fused", "two nodes, fused", "fused", bias=0.02),
        Condition("overlap-90", "overlap 90 %", "sensor", angle_deg=5.0, overlap=0.9),
        Condition("overlap-70", "overlap 70 %", "sensor", angle_deg=18.0, overlap=0.7),
        Condition("overlap-50", "overlap 50 %", "sensor", angle_deg=35.0, overlap=0.5),
        Condition("overlap-30", "overlap 30 %", "sensor", angle_deg=45.0, overlap=0.3),
    )
}


@dataclass(frozen=True, slots=True)
class Case:
    """One registration problem with its truth."""

    source: PointCloud
    """The cloud that moves, in its node's frame."""
    target: PointCloud
    T_true: FloatArray
    """(4, 4) T_target_source."""
    T_init: FloatArray
    """(4, 4) start of every method."""
    overlap: float
    """Share of the source's points with a partner within 5 cm at the true pose."""

    def thinned(self, max_points: int) -> Case:
        """Return the case with random subsets of both clouds, so that every method gets the same points."""
        return replace(
            self,
            source=random_subset(self.source, max_points, 1),
            target=random_subset(self.target, max_points, 2),
        )


def make_case(condition: Condition, room: int) -> Case:
    """Return a condition's case in ``box_room(room)``, with all points; equal arguments give equal cases."""
    rng = np.random.default_rng([room, 47])
    if condition.clouds == "inferred":
        sensor, inferred, _ = _node(box_room(room), 0, condition, room, rng)
        source, target, T_true = inferred, sensor, np.eye(4)
    else:
        chord_m = 2.0 * NODE_REACH_M * float(np.sin(np.radians(condition.angle_deg) / 2.0))
        scene = box_room(room, 2, condition.angle_deg, chord_m)
        (target, T_world_target), (source, T_world_source) = (
            _node_cloud(scene, index, condition, room, rng) for index in (0, 1)
        )
        T_true = inverse(T_world_target) @ T_world_source
    if condition.overlap is not None:
        source, target = _with_overlap(source, target, T_true, condition.overlap, room)
    T_init = wrong_start(T_true, source.points_m, condition.start_deg, condition.start_m, rng)
    return Case(source, target, T_true, T_init, float(partnered(source, target, T_true).mean()))


def wrong_start(
    T_true: FloatArray, points_m: FloatArray, angle_deg: float, distance_m: float, rng: np.random.Generator
) -> FloatArray:
    """Return the (4, 4) true pose, rotated by ``angle_deg`` about a random axis through the centre of the
    (N, 3) points, and shifted by ``distance_m`` in a random direction."""
    axis, shift_m = rng.normal(size=(2, 3))
    rotation = rotation_exp(np.radians(angle_deg) * axis / np.linalg.norm(axis))
    center_m = apply(T_true, points_m.mean(axis=0, keepdims=True))[0]
    shift_m *= distance_m / np.linalg.norm(shift_m)
    return rigid(rotation, center_m - rotation @ center_m + shift_m) @ T_true


def random_subset(cloud: PointCloud, count: int, seed: int) -> PointCloud:
    """Return a random subset of at most ``count`` points, in their order."""
    if len(cloud) <= count:
        return cloud
    chosen = np.random.default_rng([seed, 4000]).choice(len(cloud), count, replace=False)
    return cloud.select(np.sort(chosen))


def _node_cloud(
    scene: Scene, index: int, condition: Condition, room: int, rng: np.random.Generator
) -> tuple[PointCloud, FloatArray]:
    """Return the cloud that one of two nodes registers, and the node's true T_world_camera."""
    sensor, inferred, T_world_camera = _node(scene, index, condition, room, rng)
    if condition.clouds == "sensor":
        return sensor, T_world_camera
    return fuse(sensor, inferred, "fill"), T_world_camera


def _node(
    scene: Scene, index: int, condition: Condition, room: int, rng: np.random.Generator
) -> tuple[PointCloud, PointCloud, FloatArray]:
    """Return sensor cloud and complete cloud of one node, degraded, and its true T_world_camera."""
    T_world_camera = scene.cameras[index]
    view = render(scene, scene.intrinsics, T_world_camera, "fast", rng)
    depth = sense_depth(view, scene.intrinsics, rng)
    frame = RgbdFrame("node", view.rgb, depth, scene.intrinsics, T_world_camera)
    complete = DepthMap(_blurred_edges(view.z_m))
    seed = 2 * room + index
    extra_holes = (condition.holes - 1.0) * (1.0 - depth.coverage) / depth.coverage
    sensor_how = Degradation(outlier_share=condition.outliers, hole_share=min(0.9, extra_holes))
    sensor = degrade(back_project(frame), sensor_how, seed)
    inferred = back_project(frame, complete, PointSource.INFERRED)
    return sensor, degrade(inferred, Degradation(depth_bias=condition.bias), seed), T_world_camera


def _blurred_edges(z_m: FloatArray) -> FloatArray:
    """Return (H, W) depth with edges blurred over a few pixels; NaN where ``z_m`` is not finite."""
    known = np.isfinite(z_m)
    inverse_m = np.where(known, 1.0 / np.where(known, z_m, 1.0), 0.0).astype(np.float64)
    weight = cv2.GaussianBlur(known.astype(np.float64), (0, 0), EDGE_BLUR_PX)
    blurred = cv2.GaussianBlur(inverse_m, (0, 0), EDGE_BLUR_PX) / np.maximum(weight, 1e-9)
    return np.where(known, 1.0 / np.where(known, blurred, 1.0), np.nan).astype(np.float32)


def partnered(source: PointCloud, target: PointCloud, T_true: FloatArray) -> np.ndarray:
    """Return (N,) whether each source point has a target point within ``PARTNER_M`` at the true pose."""
    tree = cKDTree(target.points_m)
    return tree.query(apply(T_true, source.points_m), distance_upper_bound=PARTNER_M)[0] <= PARTNER_M


def _with_overlap(
    source: PointCloud, target: PointCloud, T_true: FloatArray, overlap: float, seed: int
) -> tuple[PointCloud, PointCloud]:
    """Return both clouds with this overlap: drop source points without a partner, or crop the target.

    A crop reaches the overlap only approximately: a bisection measures it on 2,000 source points.
    """
    shared = partnered(source, target, T_true)
    if shared.mean() < overlap:
        lone = np.flatnonzero(~shared)
        surplus = len(lone) - round((1.0 - overlap) / overlap * np.sum(shared))
        keep = np.ones(len(source), np.bool_)
        keep[np.random.default_rng([seed, 90]).permutation(lone)[:surplus]] = False
        return source.select(keep), target
    probe = random_subset(source, 2000, seed)
    low, high = 0.0, 0.9
    for _ in range(10):
        share = 0.5 * (low + high)
        cropped = degrade(target, Degradation(crop_share=share), seed)
        low, high = (share, high) if partnered(probe, cropped, T_true).mean() > overlap else (low, share)
    return source, cropped
