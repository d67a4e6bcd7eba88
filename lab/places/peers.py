"""Other programs that place one view or cloud relative to another without a start, with their usual settings.

Every program gets the same pair, and the same ICP refines its pose. Programs whose library is not installed
are skipped. Lengths are for rooms; for larger clouds they grow with the extent.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from lab.places.colmap import colmap_pose
from lab.places.judging import PlacesTask, judged
from lab.places.pairs import pair
from pipeline.acquisition import back_project
from pipeline.kernels.geometry import rigid
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.point_sets import middle_extent_m
from pipeline.registration.peers import run_peer
from pipeline.types import FloatArray, PointCloud

o3d_registration: Any = o3d.pipelines.registration
ROOM_M = 10.0
"""Extent up to which the lengths below hold; beyond it they grow in proportion."""
VOXEL_M = 0.05
"""Voxel of the features of Open3D and KISS-Matcher, that of Open3D's tutorial for rooms."""
RANSAC_ITERATIONS, RANSAC_CONFIDENCE = 100_000, 0.999
"""Limits of Open3D's RANSAC, from its tutorial."""
FINE_M = 0.02
"""Voxel of the clouds that ICP refines."""
GATES_M = (0.15, 0.05)
"""Gates of the refinement."""
REFINEMENTS = 50
"""Largest number of ICP iterations at each gate."""
GICP_GATE_M = 0.3
"""First gate of small_gicp, which starts at the identity."""


@dataclass(frozen=True, slots=True)
class PlacePeer:
    """A program that finds the pose of a pair."""

    module: str
    """Name of its library's module."""
    start: Callable[[PointCloud, PointCloud], FloatArray | None] | None
    """Takes the clouds of source and target and returns the (4, 4) pose T_target_source before refinement, or
    None if it finds none. The field is None for pycolmap, which takes the images."""


def available_place_peers() -> tuple[str, ...]:
    """Return the names of the programs whose libraries are installed."""
    return tuple(name for name, peer in PLACE_PEERS.items() if find_spec(peer.module) is not None)


def solve_peer(task: PlacesTask) -> dict[str, Any]:
    """Solve a pair by one of the programs; returns the row of ``judged``, without a verdict."""
    views = pair(task.split, task.index, task.overlap)
    peer = PLACE_PEERS[task.program]
    import_module(peer.module)  # before the clock starts
    started = time.perf_counter()
    clouds = back_project(views.source), back_project(views.target)
    T = colmap_pose(views) if peer.start is None else peer.start(*clouds)
    if T is not None:
        T = refined(*clouds, T)
    return judged(task, views, T, None, time.perf_counter() - started)


def refined(source: PointCloud, target: PointCloud, T: FloatArray) -> FloatArray:
    """Return the (4, 4) pose T after Open3D's point-to-plane ICP with each of ``GATES_M`` in turn."""
    scale = _scale(source, target)
    moving, fixed = _thinned(source, FINE_M * scale), _thinned(target, FINE_M * scale)
    fixed.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
    method = o3d_registration.TransformationEstimationPointToPlane()
    criteria = o3d_registration.ICPConvergenceCriteria(max_iteration=REFINEMENTS)
    for gate_m in GATES_M:
        found = o3d_registration.registration_icp(moving, fixed, scale * gate_m, T, method, criteria)
        T = np.array(found.transformation)
    return T


def _scale(source: PointCloud, target: PointCloud) -> float:
    extent_m = max(middle_extent_m(cloud.points_m) for cloud in (source, target))
    return max(1.0, extent_m / ROOM_M)


def _thinned(cloud: PointCloud, voxel_m: float) -> Any:
    whole = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    return whole.voxel_down_sample(voxel_m)


def _with_features(cloud: PointCloud, voxel_m: float) -> tuple[Any, Any]:
    """Return the thinned cloud and its FPFH features, as in Open3D's tutorial."""
    thin = _thinned(cloud, voxel_m)
    thin.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2.0 * voxel_m, 30))
    thin.orient_normals_towards_camera_location(np.zeros(3))
    around = o3d.geometry.KDTreeSearchParamHybrid(5.0 * voxel_m, 100)
    return thin, o3d_registration.compute_fpfh_feature(thin, around)


def _fpfh(source: PointCloud, target: PointCloud, fast: bool) -> FloatArray | None:
    """Return the (4, 4) pose by Open3D's FPFH features and RANSAC, or fast global registration (``fast``)."""
    voxel_m = VOXEL_M * _scale(source, target)
    (moving, moving_features), (fixed, fixed_features) = (
        _with_features(cloud, voxel_m) for cloud in (source, target)
    )
    clouds = (moving, fixed, moving_features, fixed_features)
    o3d.utility.random.seed(0)
    if fast:
        option = o3d_registration.FastGlobalRegistrationOption(maximum_correspondence_distance=voxel_m)
        found = o3d_registration.registration_fgr_based_on_feature_matching(*clouds, option)
        return np.array(found.transformation)
    reach_m = 1.5 * voxel_m
    checks = [
        o3d_registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
        o3d_registration.CorrespondenceCheckerBasedOnDistance(reach_m),
    ]
    solver = o3d_registration.TransformationEstimationPointToPoint(False)
    limits = o3d_registration.RANSACConvergenceCriteria(RANSAC_ITERATIONS, RANSAC_CONFIDENCE)
    found = o3d_registration.registration_ransac_based_on_feature_matching(
        *clouds, True, reach_m, solver, 3, checks, limits
    )
    return np.array(found.transformation)


def _kiss_matcher(source: PointCloud, target: PointCloud) -> FloatArray | None:
    """Run KISS-Matcher (Lim et al., ICRA 2025).

    A pose that it calls invalid is refined too: some of them are near enough.
    """
    import kiss_matcher

    settings = kiss_matcher.KISSMatcherConfig(VOXEL_M * _scale(source, target))
    points = (cloud.points_m.astype(np.float32) for cloud in (source, target))
    found = kiss_matcher.KISSMatcher(settings).estimate(*points)
    T = rigid(np.array(found.rotation), np.ravel(found.translation))
    return T if np.all(np.isfinite(T)) else None


def _small_gicp(source: PointCloud, target: PointCloud) -> FloatArray | None:
    """Run small_gicp's GICP in stages from the identity."""
    scale = _scale(source, target)
    moving, fixed = (
        PointCloud(np.asarray(_thinned(cloud, FINE_M * scale).points)) for cloud in (source, target)
    )
    return run_peer("small-gicp-staged", moving, fixed, GICP_GATE_M * scale).T_target_source


PLACE_PEERS: dict[str, PlacePeer] = {
    "kiss-matcher": PlacePeer("kiss_matcher", _kiss_matcher),
    "open3d-fpfh-ransac": PlacePeer("open3d", partial(_fpfh, fast=False)),
    "open3d-fpfh-fgr": PlacePeer("open3d", partial(_fpfh, fast=True)),
    "small-gicp": PlacePeer("small_gicp", _small_gicp),
    "pycolmap": PlacePeer("pycolmap", None),
}
"""All programs by name, installed or not."""
