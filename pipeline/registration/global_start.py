"""Global registration without a start pose: a pose from matched local features (FPFH)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.kernels.geometry import apply
from pipeline.kernels.kdtree import KdTree
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.point_sets import middle_extent_m
from pipeline.registration.consensus import WITHIN_SD, Motion, PointPairs, Scale, consensus
from pipeline.registration.finding.viewpoint import range_image
from pipeline.registration.neighbourhood import facing_origin
from pipeline.types import FloatArray, IntArray, PointCloud

VOXELS_ACROSS = 50
"""Default number of thinning voxels across the target's extent."""
NORMAL_REACH, FEATURE_REACH = 2.0, 5.0
"""Radii of normals and features, in voxels (Open3D's proportions)."""
SHORTEST, OTHER = 2.0, 3.0
"""Least distance of compared pairs, and of different start poses, in voxels."""
NEAR = 1.5
"""A point is near the target if its nearest point there is at most this many voxels away."""
START_VOXELS = 1.6
"""Voxel of a single start pose, in default voxels: with coarse features the first one is right more often."""
POINTS_OF_VOXEL = 4.0
"""Least mean number of points in a voxel."""
MOST_PAIRS = 1500
"""Largest number of pairs of features that are compared, the most alike first."""
LEAST_VOTES = 5.0
"""Least votes of a start pose; a few wrong pairs always agree."""
DIFFERENT_STARTS = 3
"""Largest number of start poses."""
PAIR_REACH, EDGE_RATIO = 1.5, 0.9
"""Of RANSAC: largest distance of a pair in voxels, least ratio of the edge lengths between matched points."""
RANSAC_ITERATIONS, RANSAC_CONFIDENCE = 100_000, 0.999
SMALLEST_SHARE = 0.15
"""Least share of the source points with a partner in the target after RANSAC."""
ROWS = 1000
"""Number of features that are compared with all others at once, which limits the memory."""


def default_voxel_m(target: PointCloud) -> float:
    """Return a fiftieth of the widest side of the box around the middle 90 % of the points, metres.

    Raises:
        InputError: there are no points, or all coincide.
    """
    if not len(target):
        raise InputError("The target cloud has no points; a start pose cannot be found, so check its file.")
    extent_m = middle_extent_m(target.points_m)
    if not extent_m > 0.0:
        raise InputError("The target cloud's points are all in one place; check its depth image or file.")
    return extent_m / VOXELS_ACROSS


def global_start(source: PointCloud, target: PointCloud) -> FloatArray:
    """Find the (4, 4) T_target_source to about two voxels by FPFH features (Rusu et al. 2009).

    Args:
        source: the cloud that moves.
        target: the cloud that stays.

    Raises:
        InputError: the target has no points, or all coincide.
        ReconstructionError: too few points remain after thinning, or too few features agree on one pose.
    """
    if without_viewpoint(source, target):
        return next(sampled_starts(source, target, default_voxel_m(target), (0,)))
    return global_starts(source, target, START_VOXELS * default_voxel_m(target))[0]


def without_viewpoint(source: PointCloud, target: PointCloud) -> bool:
    """Return whether one of the clouds was not seen from its origin.

    Its normals have no sure sign then, and random samples, which are tested on the points, find more than the
    consensus of the features.
    """
    return any(range_image(cloud.points_m) is None for cloud in (source, target))


def sampled_starts(
    source: PointCloud, target: PointCloud, voxel_m: float, seeds: Sequence[int]
) -> Iterator[FloatArray]:
    """Yield the (4, 4) T_target_source of Open3D's RANSAC for each seed; at low overlap they differ.

    It sets the random seed of Open3D, which all threads share.

    Args:
        source, target, voxel_m: as for ``global_starts``.
        seeds: random seeds.

    Raises:
        ReconstructionError: too few points remain after thinning, or no pose matches enough points.
    """
    (moving, moving_features), (fixed, fixed_features) = (
        _with_features(cloud, voxel_m) for cloud in (source, target)
    )
    _refuse_few(moving, fixed, voxel_m)
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


def global_starts(source: PointCloud, target: PointCloud, voxel_m: float) -> list[FloatArray]:
    """Find up to three (4, 4) T_target_source, clearly different ones, that most pairs of features fit.

    Pairs are each other's most similar FPFH features. ``consensus`` finds the motions without random samples,
    so the same clouds give exactly the same poses. They are ranked by their votes times the share of the
    source's points that they bring near the target. Estimated normals are oriented towards the origin, so
    clouds without normals should be in their cameras' frames.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        voxel_m: voxel edge, metres, to which both clouds are first thinned. It is enlarged if a voxel would
            hold fewer than four points on average, whose features would be noise.

    Raises:
        ReconstructionError: too few points remain after thinning, or too few features agree on one pose.
    """
    voxel_m = max(_filled_voxel_m(cloud, voxel_m) for cloud in (source, target))
    clouds = [_with_features(cloud, voxel_m) for cloud in (source, target)]
    _refuse_few(clouds[0][0], clouds[1][0], voxel_m)
    moving_m, fixed_m = (np.asarray(points.points) for points, _ in clouds)
    moving, fixed = (np.ascontiguousarray(features.data.T, np.float32) for _, features in clouds)
    rows, partners = _mutual_nearest(moving, fixed)
    votes = np.ones(len(rows))
    pairs = PointPairs(moving_m[rows], fixed_m[partners], votes * voxel_m / WITHIN_SD, votes)
    scale = Scale(voxel_m, SHORTEST * voxel_m, OTHER * voxel_m, from_origin=False)
    found = [motion for motion in consensus(pairs, scale) if motion.votes >= LEAST_VOTES]
    tree = KdTree(fixed_m)

    def rank(motion: Motion) -> float:
        near = tree.nearest(apply(motion.T_target_source, moving_m), 1)[0] <= NEAR * voxel_m
        return motion.votes * float(np.mean(near))

    found.sort(key=rank, reverse=True)
    if not found:
        raise ReconstructionError(
            f"Of {len(pairs)} features of similar surfaces too few agree on one pose: the clouds hardly "
            "overlap or have no features; give a start pose."
        )
    return [motion.T_target_source for motion in found[:DIFFERENT_STARTS]]


def _filled_voxel_m(cloud: PointCloud, voxel_m: float) -> float:
    """Return the voxel edge, at least the given one, for about ``POINTS_OF_VOXEL`` points in a voxel."""
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    filled = len(points.voxel_down_sample(voxel_m).points)
    return float(voxel_m * np.sqrt(max(1.0, POINTS_OF_VOXEL * filled / max(1, len(cloud)))))


def _mutual_nearest(moving: FloatArray, fixed: FloatArray) -> tuple[IntArray, IntArray]:
    """Return rows of (N, 33) and (M, 33) features that are each other's most similar, the best first."""
    nearest, least = np.empty(len(moving), np.intp), np.empty(len(moving), np.float32)
    back, back_least = np.zeros(len(fixed), np.intp), np.full(len(fixed), np.inf, np.float32)
    squares = np.sum(fixed**2, axis=1)
    for first in range(0, len(moving), ROWS):
        some = moving[first : first + ROWS]
        apart = np.sum(some**2, axis=1)[:, None] + squares - 2.0 * some @ fixed.T
        of_some = slice(first, first + len(some))
        nearest[of_some], least[of_some] = apart.argmin(axis=1), apart.min(axis=1)
        closer = apart.min(axis=0) < back_least
        back[closer] = first + apart.argmin(axis=0)[closer]
        back_least[closer] = apart.min(axis=0)[closer]
    rows = np.flatnonzero(back[nearest] == np.arange(len(moving)))
    rows = rows[np.argsort(least[rows], kind="stable")[:MOST_PAIRS]]
    return rows, nearest[rows]


def _refuse_few(moving: Any, fixed: Any, voxel_m: float) -> None:
    if min(len(moving.points), len(fixed.points)) < 3:
        raise ReconstructionError(
            f"Too few points remain at {voxel_m:.3g} m to find a start pose; give one, or a smaller voxel."
        )


def _with_features(cloud: PointCloud, voxel_m: float) -> tuple[Any, Any]:
    """Return the thinned cloud with normals, and its features.

    FPFH depends on the normals' signs: where the cloud was seen from its origin, given ones are turned there.
    """
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    given = cloud.normals
    if given is not None and not (np.isfinite(given).all() and given.any(axis=1).all()):
        given = None
    if given is not None:
        if range_image(cloud.points_m) is not None:
            given = facing_origin(given, cloud.points_m)
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
