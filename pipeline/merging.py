"""Merging the clouds of all nodes into one, thinned and with normals, from which the surface is made."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pipeline.config import FusionMode
from pipeline.kernels import geometry
from pipeline.kernels.splat import splat_depth
from pipeline.kernels.threads import threads
from pipeline.nodes import NodeClouds
from pipeline.registration import hidden_from
from pipeline.surface.normals import estimate_normals
from pipeline.surface.radii import spacing
from pipeline.surface.smooth import smooth
from pipeline.surface.voxel import in_cubes_of, voxel_average, voxel_for_count
from pipeline.types import (
    BoolArray,
    FloatArray,
    IntArray,
    PointCloud,
    PointSource,
    RgbdFrame,
    Walk,
)

SIZING_POINTS = 2_000_000
"""About the largest number of points from which the voxel edge is chosen; of more, every k-th is used."""
NOISE_VOXELS = 2.0
"""Least ratio of the voxel edge to the measured points' median noise: smaller voxels reproduce the noise."""

SPLAT = 2.0
"""Side of the square that a point of the map covers, in voxels."""
IN_FRONT = 0.1
"""Share of the map's depth by which an inferred point must be in front of the map to be kept."""
LEAST_GUESSED = 30
"""Views with fewer inferred points are left out: too few for normals."""


@dataclass(frozen=True, slots=True)
class FusedCloud:
    """All nodes' fused clouds in the world frame, thinned, with normals."""

    fused: PointCloud
    """Its ``sigma_m`` is NaN for inferred points; None if points of both kinds are averaged."""
    voxel_m: float
    """Edge of the voxels over which the points were averaged."""
    r_F_m: float
    """Mean nearest-neighbour distance."""
    sigma_D_m: float
    """Standard deviation of the nearest-neighbour distance."""
    measured: int | None
    """Number of measured points, which come first and are free of inferred ones; None if they are mixed."""


@dataclass(frozen=True, slots=True)
class MergedClouds:
    """The fused cloud and, thinned in the same way, the measured points alone."""

    sensor: PointCloud
    fused: PointCloud
    r_F_m: float
    """Mean nearest-neighbour distance of the fused cloud."""
    sigma_D_m: float
    """Standard deviation of the nearest-neighbour distance."""


def merge_fused(
    frames: Sequence[RgbdFrame],
    nodes: Sequence[NodeClouds],
    T_world_camera: Sequence[FloatArray],
    mode: FusionMode,
    max_points: int,
    smoothing_passes: int,
) -> FusedCloud:
    """Merge the clouds of all nodes into one.

    Args:
        frames: the nodes' images.
        nodes: their clouds, each in its node's frame.
        T_world_camera: (4, 4) registered pose of each node.
        mode: ``union`` averages all points; ``fill`` drops inferred points that another node's sensor can
            judge, and those close to measured ones, so that no measurement is averaged with a guess.
        max_points: the voxels are chosen to leave about this many points, or fewer if they would be too small
            for the sensors' noise.
        smoothing_passes: how many times every point is moved onto the plane of its neighbours.
    """
    pool = threads("merging", 2)
    keep: list[BoolArray | None] = [None] * len(nodes)
    if mode == "fill":
        keep = list(pool.map(partial(not_guessed_in_view, frames, nodes, T_world_camera), range(len(nodes))))
    joint = partial(_joint, nodes, keep)
    voxel_m = _voxel_m(nodes, joint(), T_world_camera, max_points)
    if mode != "fill":
        fused = replace(merge(joint(), T_world_camera, voxel_m, smoothing_passes), sigma_m=None)
        return FusedCloud(fused, voxel_m, *spacing(fused.points_m), None)
    own = pool.submit(thinned, (node.sensor for node in nodes), T_world_camera, voxel_m)
    whole = thinned(joint(), T_world_camera, voxel_m)
    sensors = own.result()
    smoothed = pool.submit(smooth, sensors, smoothing_passes)
    guesses = smooth(whole, smoothing_passes, guessed_alone(sensors, whole, voxel_m))
    measured = smoothed.result()
    labelled = replace(measured, source=np.full(len(measured), PointSource.SENSOR, np.uint8))
    fused = PointCloud.concatenate([labelled, _without_noise(guesses)])
    return FusedCloud(fused, voxel_m, *spacing(fused.points_m), len(measured))


def merge_map(
    walk: Walk,
    frames: Sequence[RgbdFrame],
    nodes: Sequence[NodeClouds],
    T_world_camera: Sequence[FloatArray],
    smoothing_passes: int,
) -> FusedCloud:
    """Add the nodes' inferred points to the map of a recording, where no frame measured.

    An inferred point is kept only if its view sees no point of the map at its pixel, or if it is clearly in
    front of the map there (``IN_FRONT``).

    Args:
        walk: the recording, with its map.
        frames: images of some keyframes.
        nodes: their clouds.
        T_world_camera: (4, 4) pose of each.
        smoothing_passes: how many times every inferred point is moved onto the plane of its neighbours; the
            map is an average of many frames already.
    """
    measured = replace(walk.map, source=np.full(len(walk.map), PointSource.SENSOR, np.uint8))
    guessed = []
    for index, node in enumerate(nodes):
        cloud = node.fused
        inferred = not_guessed_in_view(frames, nodes, T_world_camera, index)
        inferred &= np.asarray(cloud.source) == PointSource.INFERRED
        if inferred.any():
            u, v = np.asarray(cloud.pixels).T
            side_m, camera = SPLAT * walk.voxel_m, frames[index].intrinsics
            nearest_m = splat_depth(walk.map.points_m, side_m, camera, T_world_camera[index])[v, u]
            inferred &= cloud.points_m[:, 2] < (1.0 - IN_FRONT) * nearest_m
        guessed.append(replace(cloud, pixels=None).select(inferred))
    some = [k for k, cloud in enumerate(guessed) if len(cloud) >= LEAST_GUESSED]
    fused = measured
    if some:
        whole = thinned((guessed[k] for k in some), [T_world_camera[k] for k in some], walk.voxel_m)
        alone = ~in_cubes_of(measured.points_m, whole.points_m, walk.voxel_m)
        guesses = _without_noise(smooth(whole, smoothing_passes).select(alone))
        fused = PointCloud.concatenate([measured, guesses])
    return FusedCloud(fused, walk.voxel_m, *spacing(fused.points_m), len(measured))


def _without_noise(guesses: PointCloud) -> PointCloud:
    """Return inferred points with NaN as noise: the sensor's noise law does not hold for them."""
    return replace(guesses, sigma_m=np.full(len(guesses), np.nan))


def _joint(nodes: Sequence[NodeClouds], keep: Sequence[BoolArray | None]) -> Iterator[PointCloud]:
    """Yield the kept rows of every node's fused cloud, without pixels; one whole cloud exists at a time."""
    for node, rows in zip(nodes, keep, strict=True):
        cloud = replace(node.fused, pixels=None)
        yield cloud if rows is None else cloud.select(rows)


def _voxel_m(
    nodes: Sequence[NodeClouds],
    joint: Iterable[PointCloud],
    T_world_camera: Sequence[FloatArray],
    max_points: int,
) -> float:
    """Return the voxel edge that leaves about ``max_points``, but no less than the noise allows."""
    every = max(1, -(-sum(node.frame.depth.z_m.size for node in nodes) // SIZING_POINTS))
    parts_m, sigmas_m = [], []
    for node, cloud, pose in zip(nodes, joint, T_world_camera, strict=True):
        parts_m.append(geometry.apply(pose, cloud.points_m[::every]))
        sigmas_m.append(np.asarray(node.sensor.sigma_m)[::every])
    noise_m = float(np.median(np.concatenate(sigmas_m)))
    return voxel_for_count(np.concatenate(parts_m), max_points, NOISE_VOXELS * noise_m)


def guessed_alone(sensors: PointCloud, whole: PointCloud, voxel_m: float) -> IntArray:
    """Return the rows of ``whole`` that were inferred and whose voxel contains no measured point.

    At the rim of a hole, averaging and smoothing would mix both kinds, and an error of the inferred points
    would detach the surface from the measured points. So measured points are thinned and smoothed alone,
    then these inferred points are added; their own smoothing may use measured points.

    Args:
        sensors: the measured points, thinned to ``voxel_m``.
        whole: the measured and the inferred points, thinned in the same way.
    """
    guessed = np.flatnonzero(whole.source == PointSource.INFERRED)
    return guessed[~in_cubes_of(sensors.points_m, whole.points_m[guessed], voxel_m)]


def merge(
    clouds: Iterable[PointCloud], T_world_camera: Sequence[FloatArray], voxel_m: float, smoothing_passes: int
) -> PointCloud:
    """Merge clouds from their nodes' frames into one in the world frame: averaged, with normals, smoothed."""
    return smooth(thinned(clouds, T_world_camera, voxel_m), smoothing_passes)


def thinned(clouds: Iterable[PointCloud], T_world_camera: Sequence[FloatArray], voxel_m: float) -> PointCloud:
    """Merge like ``merge``, without smoothing."""
    thin = [
        replace(estimate_normals(voxel_average(cloud, voxel_m), np.zeros(3)), pixels=None) for cloud in clouds
    ]
    placed = _placed(thin, T_world_camera)
    return placed[0] if len(placed) == 1 else voxel_average(PointCloud.concatenate(placed), voxel_m)


def not_guessed_in_view(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], T_world_camera: Sequence[FloatArray], index: int
) -> BoolArray:
    """Return (N,) False for the inferred points of one node's fused cloud that another sensor can judge.

    Another node may have measured what one node had to infer: an inferred point is kept only if it is
    hidden from every other node's sensor.
    """
    cloud = nodes[index].fused
    keep = np.ones(len(cloud), dtype=bool)
    left = np.flatnonzero(cloud.source == PointSource.INFERRED)
    for other, frame in enumerate(frames):
        if other != index and len(left):
            T_other_node = geometry.inverse(T_world_camera[other]) @ T_world_camera[index]
            guesses = PointCloud(cloud.points_m.take(left, axis=0))
            hidden = hidden_from(guesses, T_other_node, frame.intrinsics, frame.depth)
            keep[left[~hidden]] = False
            left = left[hidden]
    return keep


def _placed(clouds: Sequence[PointCloud], T_world_camera: Sequence[FloatArray]) -> list[PointCloud]:
    """Move clouds from their own frames to the world frame."""
    return [cloud.transformed(pose) for cloud, pose in zip(clouds, T_world_camera, strict=True)]
