"""Surfaces that can be measured: vertices with their noise, their node and whether they were guessed."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, atomic_path, read_bytes
from pipeline.kernels import geometry
from pipeline.kernels.kdtree import tree_of
from pipeline.measuring import poses
from pipeline.measuring.views import Known, View, known_by
from pipeline.nodes import NodeClouds
from pipeline.placement.outcome import Placement
from pipeline.reconstruct import Reconstruction
from pipeline.surface.normals import estimate_normals
from pipeline.surface.radii import spacing
from pipeline.types import BoolArray, FloatArray, IntArray, PointCloud, PointSource, Rig, Surface

MEASURING = "measuring.npz"
"""File of a run that ``read_measured`` reads."""
SAMPLED = 500
"""About the number of a node's points whose mean is taken as the middle of what it sees."""


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class MeasuredSurface:
    """A mesh, or a cloud without triangles, with what the intervals of its measures need."""

    vertices_m: FloatArray
    """(V, 3) world frame; those of a rig's surface, moved onto the averaged measurements around them."""
    triangles: IntArray
    """(F, 3); (0, 3) for a cloud."""
    normals: FloatArray
    """(V, 3) unit vectors towards the observer."""
    sigma_m: FloatArray
    """(V,) standard deviation of each vertex along ``rays``."""
    rays: FloatArray
    """(V, 3) unit direction of that noise: from camera to point, or the normal of a map's point."""
    guessed: BoolArray
    """(V,) True for vertices from inferred depth."""
    nodes: IntArray
    """(V,) index of the node, or recording's keyframe, that measured each vertex; -1: several or unknown."""
    pose_covariances: FloatArray
    """(N, 6, 6) covariance of each node's small motion (turn in rad about the world's origin, then shift in
    m) relative to the node whose pose is kept, or of each keyframe's relative to the first keyframe."""
    scale_sd: float
    """Relative standard deviation of all lengths together."""
    scale_source: str
    """One sentence: whose calibration gives ``scale_sd``, or which value is assumed."""
    ranges_m: FloatArray | None = None
    """(V,) distance of each vertex from the camera of its ray; None if unknown."""
    confidence: FloatArray | None = None
    """(V,) confidence of a guessed vertex, NaN for a measured one; None if unknown."""
    bent_sd: float | None = None
    """Relative standard deviation of the focal lengths, which tilt planes, where a true length has set the
    scale: it does not straighten them. None: ``scale_sd``."""

    @property
    def tilting_sd(self) -> float:
        """Relative standard deviation of the scale that planes and lines are tilted by."""
        return self.scale_sd if self.bent_sd is None else self.bent_sd


def measured_surface(result: Reconstruction) -> MeasuredSurface:
    """Return the surface of the fused cloud, ready to be measured.

    Raises:
        InputError: the reconstruction has no surface.

    >>> import packetmesh as pm
    >>> rig = pm.Rig("one node", pm.load_demo("office").frames[:1])
    >>> result = pm.reconstruct(rig, pm.with_settings(pm.PRESETS["packetmesh"], ["surface.max_points=3000"]))
    >>> surface = pm.measured_surface(result)
    >>> surface.scale_sd, len(surface.sigma_m) == len(result.after.vertices_m)
    (0.01, True)
    """
    smoothed = result.spec.config.surface.smoothing_passes > 0
    return surface_of_rig(result.rig, result.nodes, result.placement, result.after, smoothed)


def surface_of_rig(
    rig: Rig, nodes: Sequence[NodeClouds], placement: Placement, surface: Surface, smoothed: bool = True
) -> MeasuredSurface:
    """Return a surface of a rig, ready to be measured.

    Args:
        rig: the images.
        nodes: the clouds of its nodes.
        placement: their places.
        surface: a surface of their points, world frame.
        smoothed: whether its vertices were moved onto the planes of their neighbours.

    Raises:
        InputError: the surface has no triangle.
    """
    if not len(surface.triangles) or surface.normals is None:
        raise InputError("There is no surface to measure; try a larger ball radius or more points")
    placed = placement.placed(list(zip(range(len(nodes)), nodes, placement.T_world_camera, strict=True)))
    views = [_view(number, node, pose) for number, node, pose in placed]
    guessed = np.zeros(len(surface.vertices_m), bool)
    if surface.source is not None:
        guessed = np.asarray(surface.source) == PointSource.INFERRED
    known = known_by(
        surface.vertices_m, surface.triangles, guessed, views, spacing(surface.vertices_m)[0], smoothed
    )
    scale_sd, sentence = poses.scale_of([node.frame for _, node, _ in placed])
    if rig.walk is not None:
        covariances, known = poses.of_walk(rig.walk), _of_map(rig, surface, known, guessed)
    else:
        seen_m = [_some_m(node, pose) for node, pose in zip(nodes, placement.T_world_camera, strict=True)]
        covariances = poses.of_placement(placement, seen_m, scale_sd)
    return MeasuredSurface(
        known.vertices_m,
        surface.triangles,
        _normals(known.vertices_m, surface.triangles, np.asarray(surface.normals, float)),
        known.sigma_m,
        known.rays,
        guessed,
        known.nodes,
        covariances,
        scale_sd,
        sentence,
        known.ranges_m,
        known.confidence,
    )


def measured_cloud(cloud: PointCloud, scale_sd: float = poses.ASSUMED_SCALE_SD) -> MeasuredSurface:
    """Return a cloud, ready to be measured; missing normals and noise are estimated.

    Without ``sigma_m``, and where it is NaN, the noise of a point is the standard deviation of its
    neighbours' distances from its tangent plane. Estimated normals point towards the mean of the points.

    Args:
        cloud: (N, 3) points; with labels of their source, inferred ones count as guessed.
        scale_sd: relative standard deviation of all lengths together.

    Raises:
        InputError: fewer than four points.

    >>> import numpy as np, packetmesh as pm
    >>> flat = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), [0.0]), axis=-1).reshape(-1, 3)
    >>> surface = pm.measured_cloud(pm.PointCloud(flat, sigma_m=np.full(25, 0.002)))
    >>> surface.normals[12].tolist(), float(surface.sigma_m[12])
    ([0.0, 0.0, 1.0], 0.002)
    """
    if len(cloud) < 4:
        raise InputError(f"A cloud of {len(cloud)} points has no surface to measure; try another cloud")
    if cloud.normals is None:
        cloud = estimate_normals(cloud, cloud.points_m.mean(axis=0))
    normals, count = np.asarray(cloud.normals, float), len(cloud)
    sigma_m = np.full(count, np.nan) if cloud.sigma_m is None else np.asarray(cloud.sigma_m, float)
    if np.isnan(sigma_m).any():
        sigma_m = np.where(np.isnan(sigma_m), _scatter_m(cloud.points_m, normals), sigma_m)
    guessed = np.zeros(count, bool) if cloud.source is None else cloud.source == PointSource.INFERRED
    return MeasuredSurface(
        np.asarray(cloud.points_m, float),
        np.empty((0, 3), np.int32),
        normals,
        sigma_m,
        normals,
        guessed,
        np.full(count, -1),
        np.zeros((1, 6, 6)),
        scale_sd,
        f"Lengths are assumed to have a standard deviation of {100.0 * scale_sd:g} %",
    )


def _normals(vertices_m: FloatArray, triangles: IntArray, before: FloatArray) -> FloatArray:
    """Return (V, 3) mean normals of the triangles at each vertex, on the side of those before."""
    a, b, c = (vertices_m[triangles[:, corner]] for corner in range(3))
    doubled_m2 = np.cross(b - a, c - a)
    sums = np.zeros_like(vertices_m)
    for corner in range(3):
        np.add.at(sums, triangles[:, corner], doubled_m2)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    found = np.where(lengths > 1e-12, sums / np.maximum(lengths, 1e-12), before)
    return found * np.where(np.sum(found * before, axis=1, keepdims=True) < 0.0, -1.0, 1.0)


def _view(number: int, node: NodeClouds, pose: FloatArray) -> View:
    """Return a placed node as a view of the surface."""
    measured = node.acquired.depth
    guessed_m = np.where(node.frame.depth.valid, np.nan, node.judged.depth.z_m)
    return View(node.frame, pose, measured.z_m, guessed_m, node.judged.confidence, number)


def _some_m(node: NodeClouds, pose: FloatArray) -> FloatArray:
    """Return (K, 3) some points of a node, world frame."""
    points_m = node.sensor.points_m
    return geometry.apply(pose, points_m[:: max(1, len(points_m) // SAMPLED)])


def _of_map(rig: Rig, surface: Surface, known: Known, guessed: BoolArray) -> Known:
    """Return what is known of a recording's surface: its measured vertices are points of the map.

    Their nodes are the keyframes, their rays the normals, and their noise is at least the map's own.
    """
    walk = rig.walk
    assert walk is not None
    assert walk.map.sigma_m is not None
    assert surface.normals is not None
    rows = tree_of(walk.map.points_m).nearest(np.asarray(surface.vertices_m, float), 1)[1][:, 0]
    keyframe = np.searchsorted(walk.keyframes, walk.first_frames[rows], side="right") - 1
    own = ~guessed
    vertices_m = np.where(own[:, None], np.asarray(surface.vertices_m, float), known.vertices_m)
    sigma_m = np.where(own, np.maximum(walk.map.sigma_m[rows], known.sigma_m), known.sigma_m)
    rays = np.where(own[:, None], -np.asarray(surface.normals), known.rays)
    nodes = np.where(own, np.maximum(keyframe, 0), -1)
    return Known(vertices_m, sigma_m, rays, known.ranges_m, nodes, known.confidence)


def _scatter_m(points_m: FloatArray, normals: FloatArray) -> FloatArray:
    """Return (N,) standard deviation of the neighbours' distances from each point's tangent plane."""
    rows = tree_of(points_m).nearest(points_m, min(9, len(points_m)))[1]
    off_m = np.einsum("nkd,nd->nk", points_m[rows] - points_m[:, None], normals)
    return np.maximum(off_m.std(axis=1), 1e-6)


def write_measured(path: Path, surface: MeasuredSurface) -> None:
    """Write a surface for ``read_measured``, exact to the last bit.

    Raises:
        InputError: the file cannot be written.
    """
    values = {one.name: getattr(surface, one.name) for one in fields(surface)}
    arrays: dict[str, Any] = {name: np.asarray(one) for name, one in values.items() if one is not None}
    with atomic_path(path) as sibling, sibling.open("wb") as file:
        np.savez_compressed(file, **arrays)


def read_measured(run: Path) -> MeasuredSurface:
    """Read the surface that ``packetmesh reconstruct --out RUN`` wrote.

    Raises:
        InputError: the folder has no surface, or it was written without the noise of its vertices.

    >>> from pathlib import Path; import numpy as np, packetmesh as pm
    >>> from pipeline.measuring.surface import write_measured
    >>> flat = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), [0.0]), axis=-1).reshape(-1, 3)
    >>> surface = pm.measured_cloud(pm.PointCloud(flat, sigma_m=np.full(25, 0.002)))
    >>> write_measured(Path("measuring.npz"), surface)
    >>> pm.read_measured(Path(".")).vertices_m.shape
    (25, 3)
    """
    path = Path(run) / MEASURING
    if not path.exists():
        why = "holds no surface with the noise of its points" if path.parent.is_dir() else "does not exist"
        raise InputError(
            f"The folder {run} {why} ({MEASURING}); make it with packetmesh reconstruct ... --out {run}"
        )
    try:
        with np.load(
            io.BytesIO(read_bytes(path, MAX_GEOMETRY_BYTES, "surface")), allow_pickle=False
        ) as stored:
            values: dict[str, Any] = {name: stored[name] for name in stored.files}
        values |= {"scale_sd": float(values["scale_sd"]), "scale_source": str(values["scale_source"])}
        if "bent_sd" in values:
            values["bent_sd"] = float(values["bent_sd"])
        surface = MeasuredSurface(**values)
        count = len(surface.vertices_m)
        whole = all(
            len(getattr(surface, name)) == count
            for name in ("normals", "sigma_m", "rays", "guessed", "nodes")
        )
        whole &= surface.pose_covariances.shape[1:] == (6, 6)
    except (ValueError, KeyError, TypeError, OSError, EOFError, zipfile.BadZipFile):
        whole = False
    if not whole or not count or surface.triangles.max(initial=-1) >= count:
        raise InputError(f"The surface {path} is damaged or of another version; reconstruct the scene again")
    return surface
