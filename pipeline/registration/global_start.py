"""Global registration without a start pose: a pose from matched local features (FPFH)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.point_sets import middle_extent_m
from pipeline.types import FloatArray, PointCloud

VOXELS_ACROSS = 50
"""Default number of thinning voxels across the target's extent."""
NORMAL_REACH, FEATURE_REACH, PAIR_REACH = 2.0, 5.0, 1.5
"""Radii of normals and features and largest distance of a pair, in voxels (Open3D's proportions)."""
EDGE_RATIO = 0.9
"""Least ratio of the edge lengths between matched points in a hypothesis of RANSAC."""
RANSAC_ITERATIONS, RANSAC_CONFIDENCE = 100_000, 0.999
SMALLEST_SHARE = 0.15
"""Least share of the source points with a partner in the target."""


def default_voxel_m(target: PointCloud) -> float:
    """Return a fiftieth of the widest side of the box around nine tenths of the points.

    Raises:
        InputError: there are no points, or all coincide.
    """
    if not len(target):
        raise InputError("The target cloud has no points; a start pose cannot be found, so check its file.")
    extent_m = middle_extent_m(target.points_m)
    if not extent_m > 0.0:
        raise InputError("The target cloud's points are all in one place; check its depth image or file.")
    return extent_m / VOXELS_ACROSS


def global_start(source: PointCloud, target: PointCloud, voxel_m: float, seed: int = 0) -> FloatArray:
    """Find the (4, 4) T_target_source to about two voxels by FPFH features (Rusu et al. 2009).

    Args:
        source, target, voxel_m: as for ``global_starts``.
        seed: random seed.

    Raises:
        ReconstructionError: the pose does not match enough points.
    """
    return next(global_starts(source, target, voxel_m, (seed,)))


def global_starts(
    source: PointCloud, target: PointCloud, voxel_m: float, seeds: Sequence[int]
) -> Iterator[FloatArray]:
    """Find a (4, 4) T_target_source for each seed of Open3D's RANSAC; its answers at low overlap differ.

    Estimated normals are oriented towards the origin, so clouds without normals should be in their cameras'
    frames. Open3D's fast global registration finds no pose that RANSAC misses.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        voxel_m: voxel edge to which both clouds are first thinned.
        seeds: random seeds.

    Raises:
        ReconstructionError: no pose matches enough points.
    """
    (moving, moving_features), (fixed, fixed_features) = (
        _with_features(cloud, voxel_m) for cloud in (source, target)
    )
    if min(len(moving.points), len(fixed.points)) < 3:
        raise ReconstructionError(
            f"Too few points remain at {voxel_m:.3g} m to find a start pose; give one, or a smaller voxel."
        )
    most = 0.0
    for seed in seeds:
        o3d.utility.random.seed(seed)
        found = _by_ransac(moving, fixed, moving_features, fixed_features, PAIR_REACH * voxel_m)
        most = max(most, found.fitness)
        if found.fitness >= SMALLEST_SHARE:
            yield np.array(found.transformation)
    if most < SMALLEST_SHARE:
        raise ReconstructionError(
            f"No start pose brings more than {most:.0%} of the source points to the target: "
            "the clouds hardly overlap or have no features; give a start pose."
        )


def _with_features(cloud: PointCloud, voxel_m: float) -> tuple[Any, Any]:
    """Return the thinned cloud with normals, and its features."""
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    given = cloud.normals
    if given is not None and not (np.isfinite(given).all() and given.any(axis=1).all()):
        given = None
    if given is not None:
        points.normals = o3d.utility.Vector3dVector(given)
    points = points.voxel_down_sample(voxel_m)
    if given is None:
        points.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(NORMAL_REACH * voxel_m, 30))
        points.orient_normals_towards_camera_location(np.zeros(3))
    o3d_registration: Any = o3d.pipelines.registration  # its stubs require an optional argument
    reach = o3d.geometry.KDTreeSearchParamHybrid(FEATURE_REACH * voxel_m, 100)
    return points, o3d_registration.compute_fpfh_feature(points, reach)


def _by_ransac(source: Any, target: Any, source_features: Any, target_features: Any, reach_m: float) -> Any:
    o3d_registration = o3d.pipelines.registration
    return o3d_registration.registration_ransac_based_on_feature_matching(
        source,
        target,
        source_features,
        target_features,
        True,
        reach_m,
        o3d_registration.TransformationEstimationPointToPoint(False),
        3,
        [
            o3d_registration.CorrespondenceCheckerBasedOnEdgeLength(EDGE_RATIO),
            o3d_registration.CorrespondenceCheckerBasedOnDistance(reach_m),
        ],
        o3d_registration.RANSACConvergenceCriteria(RANSAC_ITERATIONS, RANSAC_CONFIDENCE),
    )
