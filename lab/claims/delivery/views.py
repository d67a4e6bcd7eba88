"""Visibility of surfaces for a rig's cameras, from the depth and the believed poses of the nodes."""

from __future__ import annotations

import numpy as np

from network_sim.fixed.selection import view_quality
from pipeline.acquisition import back_project
from pipeline.kernels import geometry
from pipeline.surface.normals import estimate_normals
from pipeline.types import BoolArray, FloatArray, PointCloud, RgbdFrame, Rig

STRIDE_PX = 8
"""Step between the pixels that give points, about as in a base layer (SPEC 6.5)."""
VOXEL_M = 0.1
REFERENCE_M = 2.0
"""Distance up to which a camera resolves all details at 5 cm."""
SAME_SURFACE = 0.05
"""Largest relative difference between depths of one surface."""


def sees(frame: RgbdFrame, points_m: FloatArray) -> BoolArray:
    """Return (N,) whether a camera has measured (N, 3) world points, by its believed pose."""
    here_m = geometry.apply(geometry.inverse(frame.T_world_camera), points_m)
    seen = here_m[:, 2] > 0.1
    height, width = frame.depth.z_m.shape
    u, v = np.rint(geometry.project(frame.intrinsics, here_m[seen])).astype(int).T
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    z_m = np.full(len(u), np.nan)
    z_m[inside] = frame.depth.z_m[v[inside], u[inside]]
    seen[seen] = np.abs(z_m - here_m[seen, 2]) <= SAME_SURFACE * here_m[seen, 2]
    return seen


def sparse_points(frame: RgbdFrame) -> PointCloud:
    """Return world points of every ``STRIDE_PX``-th row and column of a node, with normals and pixels."""
    cloud = back_project(frame)
    assert cloud.pixels is not None
    few = cloud.select(np.all(cloud.pixels % STRIDE_PX == 0, axis=1))
    return estimate_normals(few, np.zeros(3)).transformed(frame.T_world_camera)


def rig_quality(rig: Rig) -> FloatArray:
    """Return (N, V) quality, 0 to 1, of each camera's view of each voxel that any camera has measured.

    The quality is visibility x resolution x incidence (SPEC 6.3).
    """
    clouds = [sparse_points(frame) for frame in rig.frames]
    points_m = np.concatenate([cloud.points_m for cloud in clouds])
    normals = np.concatenate([cloud.normals for cloud in clouds if cloud.normals is not None])
    first = np.unique(np.floor(points_m / VOXEL_M).astype(int), axis=0, return_index=True)[1]
    points_m, normals = points_m[first], normals[first]
    cameras_m = np.stack([frame.T_world_camera[:3, 3] for frame in rig.frames])
    to_camera_m = cameras_m[:, None] - points_m[None]
    distance_m = np.linalg.norm(to_camera_m, axis=2)
    incidence = np.abs(np.einsum("nvc,vc->nv", to_camera_m, normals)) / distance_m
    visible = np.stack([sees(frame, points_m) for frame in rig.frames])
    return view_quality(visible, distance_m, np.minimum(incidence, 1.0), REFERENCE_M)
