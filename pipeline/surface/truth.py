"""Errors of a surface against the true surface (SPEC 5)."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, inverse
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import Camera, hit_depths, tensor, triangle_areas_m2, triangle_scene
from pipeline.surface.ray_parts import sight
from pipeline.types import FloatArray, IntArray, RigTruth

TOLERANCES_M = (0.01, 0.03, 0.05)
SAMPLES = 20_000
"""Number of points drawn on each surface: a standard error of at most 0.4 percentage points."""
_CLOSE_DEPTH = 0.05
"""A ray is right if the mesh's depth is within this share of the true depth."""
_SELF_HIT_M = 1e-3
"""A hit within this distance of a ray's target point is the point itself."""
_DRAWS_A_SAMPLE = 4
"""Points drawn on the whole true surface per point needed on the part that cameras see."""


@dataclass(frozen=True, slots=True)
class Yardstick:
    """Data that every comparison with one truth needs, independent of the mesh."""

    scene: o3d.t.geometry.RaycastingScene
    """Ray casting scene of the true surface."""
    cameras: tuple[Camera, ...]
    """Cameras at their true poses."""
    seen_m: FloatArray
    """(at most SAMPLES, 3) points, uniform by area, on the part of the true surface that cameras see."""
    rng: np.random.Generator
    """Random generator, in its state after these points were drawn."""


def yardstick_of(truth: RigTruth, seed: int = 0) -> Yardstick:
    """Create the yardstick of a truth; ``seed`` draws the sample points."""
    scene, rng = triangle_scene(truth.vertices_m, truth.triangles), np.random.default_rng(seed)
    cameras = tuple(Camera(*one) for one in zip(truth.intrinsics, truth.T_world_camera, strict=True))
    points_m = sample_surface(truth.vertices_m, truth.triangles, _DRAWS_A_SAMPLE * SAMPLES, rng)
    seen = np.zeros(len(points_m), dtype=bool)
    for camera in cameras:
        seen_here = sight(points_m, scene, camera, _SELF_HIT_M)
        seen |= seen_here.in_image & ~seen_here.hidden
    return Yardstick(scene, cameras, points_m[seen][:SAMPLES], rng)


def compare_with_truth(
    vertices_m: FloatArray,
    triangles: IntArray,
    truth: RigTruth,
    cameras: Sequence[Camera],
    yardstick: Yardstick | None = None,
) -> dict[str, float]:
    """Measure a mesh against the true surface.

    Registration finds only the relative poses of the nodes, so the mesh is first moved so that its
    first camera is at its true pose.

    Args:
        vertices_m: (V, 3) vertices in the world frame of ``cameras``.
        triangles: (F, 3) vertex indices.
        truth: the true surface, poses and depth maps.
        cameras: one for each of the truth's, with the poses the mesh was made with.
        yardstick: yardstick of this truth, to compare many meshes faster; None creates one.

    Returns:
        For each of 1, 3 and 5 cm: ``coverage_1cm``, the share, of the true surface that cameras see, within
        1 cm of the mesh; ``accuracy_1cm``, the share of the mesh within 1 cm of the true surface;
        ``f_score_1cm``, their harmonic mean; all by area and by exact distances. Along the rays of the true
        cameras: ``no_hit_ray_share`` and ``within_5pct_depth_share`` of all rays that meet the true surface,
        and ``median_depth_error_m`` of those that meet both (NaN if none).

    Raises:
        InputError: the mesh has no triangle.
    """
    if not len(triangles):
        raise InputError("There is no triangle to compare with the truth; try a larger ball radius")
    mesh_m = _in_true_frame(vertices_m, truth, cameras)
    yardstick = yardstick or yardstick_of(truth)
    return _surface_measures(mesh_m, triangles, yardstick) | _ray_measures(
        mesh_m, triangles, truth, yardstick.cameras
    )


def distances_to_truth_m(vertices_m: FloatArray, truth: RigTruth, cameras: Sequence[Camera]) -> FloatArray:
    """Return (N,) distances of (N, 3) points to the true surface, moved as in ``compare_with_truth``."""
    true_scene = triangle_scene(truth.vertices_m, truth.triangles)
    return _distances_m(true_scene, _in_true_frame(vertices_m, truth, cameras))


def _in_true_frame(vertices_m: FloatArray, truth: RigTruth, cameras: Sequence[Camera]) -> FloatArray:
    """Move the points so that their first camera is at its true pose."""
    return apply(truth.T_world_camera[0] @ inverse(cameras[0].T_world_camera), vertices_m)


def _surface_measures(mesh_m: FloatArray, triangles: IntArray, yardstick: Yardstick) -> dict[str, float]:
    missing_m = _distances_m(triangle_scene(mesh_m, triangles), yardstick.seen_m)
    drawn_m = sample_surface(mesh_m, triangles, SAMPLES, deepcopy(yardstick.rng))
    error_m = _distances_m(yardstick.scene, drawn_m)
    measures = {}
    for tolerance_m in TOLERANCES_M:
        name = f"{100 * tolerance_m:.0f}cm"
        coverage = float((missing_m <= tolerance_m).mean())
        accuracy = float((error_m <= tolerance_m).mean())
        measures[f"coverage_{name}"] = coverage
        measures[f"accuracy_{name}"] = accuracy
        measures[f"f_score_{name}"] = 2 * coverage * accuracy / max(coverage + accuracy, 1e-12)
    return measures


def _ray_measures(
    mesh_m: FloatArray, triangles: IntArray, truth: RigTruth, true_cameras: Sequence[Camera]
) -> dict[str, float]:
    seen_m = [depth.z_m for depth in hit_depths(mesh_m, triangles, true_cameras)]
    z_m = np.concatenate([depth.z_m[depth.valid] for depth in truth.depth])
    mesh_z_m = np.concatenate([z[depth.valid] for z, depth in zip(seen_m, truth.depth, strict=True)])
    error_m = np.abs(mesh_z_m - z_m)
    hit = np.isfinite(error_m)
    return {
        "no_hit_ray_share": float(1.0 - hit.mean()),
        "within_5pct_depth_share": float((error_m <= _CLOSE_DEPTH * z_m).mean()),
        "median_depth_error_m": float(np.median(error_m[hit])) if hit.any() else float("nan"),
    }


def sample_surface(
    vertices_m: FloatArray, triangles: IntArray, count: int, rng: np.random.Generator
) -> FloatArray:
    """Draw (count, 3) points uniformly by area on a mesh."""
    area_m2 = triangle_areas_m2(vertices_m, triangles)
    a, b, c = vertices_m[triangles[rng.choice(len(triangles), count, p=area_m2 / area_m2.sum())]].swapaxes(
        0, 1
    )
    root, share = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    return (1 - root) * a + root * (1 - share) * b + root * share * c


def _distances_m(scene: o3d.t.geometry.RaycastingScene, points_m: FloatArray) -> FloatArray:
    """Return (N,) exact distance of each point to the nearest triangle."""
    return scene.compute_distance(tensor(points_m, np.float32)).numpy()
