"""How sure the nodes' poses and the scale are."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, look_at, rigid, rotation_exp
from pipeline.measuring import poses
from pipeline.placement.outcome import Placement
from pipeline.registration.graph.edges import PoseEdge, cross_matrix
from pipeline.registration.graph.pose_graph import motion_covariances, optimised
from pipeline.types import CameraIntrinsics, DepthMap, Link, PointCloud, RgbdFrame, Walk

SDS = np.array([0.01, 0.02, 0.015, 0.03, 0.02, 0.04])
POSES = [look_at((x_m, 2.0, 1.0), (0.0, 0.0, 0.5)) for x_m in (-1.0, 0.5, 2.0)]
T = [inverse(POSES[0]) @ pose for pose in POSES]


def edge(source, target, information):
    return PoseEdge(source, target, inverse(POSES[target]) @ POSES[source], information)


def moved_points(covariance, points_m):
    """Standard deviations of points that a small motion moves."""
    jacobians = [np.hstack([-cross_matrix(point_m), np.eye(3)]) for point_m in points_m]
    return np.array([np.sqrt(np.diag(J @ covariance @ J.T)) for J in jacobians])


def test_one_edge_gives_its_own_covariance_where_the_points_are():
    information = np.diag(1.0 / SDS**2)
    held, found, none = motion_covariances([*T[:2], np.full((4, 4), np.nan)], [edge(1, 0, information)], 0)
    assert not held.any()
    assert np.isnan(none).all()
    rng = np.random.default_rng(0)
    own_m = np.array([[0.2, -0.1, 1.5], [0.0, 0.4, 2.5]])
    drawn = [
        apply(T[1] @ rigid(rotation_exp(motion[:3]), motion[3:]), own_m)
        for motion in rng.normal(size=(4000, 6)) * 0.1 * SDS
    ]
    assert moved_points(0.01 * found, apply(T[1], own_m)) == pytest.approx(np.std(drawn, axis=0), rel=0.06)


def test_errors_add_along_a_chain_and_a_loop_takes_them_back():
    information = np.diag(1.0 / SDS**2)
    chain = [edge(1, 0, information), edge(2, 1, information)]
    alone, far = motion_covariances(T, chain, 0)[1:]
    point_m = [np.array([0.0, 0.2, 2.0])]
    assert np.all(moved_points(far, point_m) > moved_points(alone, point_m))
    closed = motion_covariances(T, [*chain, edge(2, 0, information)], 0)
    assert np.all(moved_points(closed[2], point_m) < moved_points(far, point_m))


def test_solved_poses_scatter_as_the_covariance_says():
    rng, information = np.random.default_rng(1), np.diag(1.0 / (0.1 * SDS) ** 2)
    edges = [edge(1, 0, information), edge(2, 1, information), edge(2, 0, information)]
    covariance = motion_covariances(T, edges, 0)[2]
    own_m = np.array([[0.1, 0.2, 2.0]])
    ends = []
    for _ in range(300):
        noisy = [
            replace(one, T_target_source=one.T_target_source @ rigid(rotation_exp(motion[:3]), motion[3:]))
            for one, motion in zip(edges, rng.normal(size=(3, 6)) * 0.1 * SDS, strict=True)
        ]
        ends.append(apply(optimised(np.array(T), noisy)[0][2], own_m)[0])
    assert np.std(ends, axis=0) == pytest.approx(moved_points(covariance, apply(T[2], own_m))[0], rel=0.15)


def test_cameras_of_wrong_scale_leave_more_the_farther_they_look():
    given = tuple(np.eye(6) * 1e-12 * k for k in (0.0, 1.0, 1.0))
    place = Placement((), tuple(POSES), covariances=given)
    seen_m = [pose[:3, 3] + away_m * pose[:3, 2:3].T for pose, away_m in zip(POSES, (1, 2, 4), strict=True)]
    found = poses.of_placement(place, seen_m, 0.01)
    assert not found[0].any()
    for node, away_m in ((1, 2.0), (2, 4.0)):
        sds = moved_points(found[node], seen_m[node])
        assert sds == pytest.approx(poses.SLACK_OF_SCALE * 0.01 * away_m, rel=1e-3)


def test_a_node_that_no_registration_holds_is_unsure_by_centimetres():
    place = Placement((), tuple(POSES[:2]), covariances=(np.zeros((6, 6)), np.full((6, 6), np.nan)))
    seen_m = [np.array([[0.0, 0.0, 0.5]])] * 2
    assert moved_points(poses.of_placement(place, seen_m, 0.0)[1], seen_m[1]) == pytest.approx(poses.UNHELD_M)


def frame(scale_sd):
    camera = CameraIntrinsics.pinhole(1.0, 1.0, 0.0, 0.0, 1, 1)
    image = np.zeros((1, 1, 3), np.uint8), DepthMap(np.ones((1, 1), np.float32))
    return RgbdFrame("node", *image, camera, np.eye(4), scale_sd=scale_sd)


def test_the_scale_is_the_calibrations_or_assumed_and_says_so():
    sd, sentence = poses.scale_of([frame(0.002), frame(0.004)])
    assert sd == 0.004
    assert sentence == "By the calibration, lengths have a standard deviation of 0.4 %"
    sd, sentence = poses.scale_of([frame(None)])
    assert sd == poses.ASSUMED_SCALE_SD
    assert sentence == (
        "Lengths are assumed to have a standard deviation of 1 %, because no node has a calibration of known "
        "accuracy"
    )
    assert "not all nodes have" in poses.scale_of([frame(None), frame(0.001)])[1]


def test_keyframes_of_a_walk_are_less_sure_the_more_links_lead_to_them():
    poses_of_frames = (POSES[0], None, POSES[1], POSES[2])
    information = np.diag(1.0 / SDS**2)
    links = tuple(
        Link(
            source, target, inverse(poses_of_frames[target]) @ poses_of_frames[source], information, 0.5, 0.9
        )
        for source, target in ((2, 0), (3, 2))
    )
    nothing = PointCloud(np.empty((0, 3)))
    walk = Walk(
        np.arange(4.0), poses_of_frames, (0, 2, 3), links, nothing, 0.01, np.empty(0, int), poses_of_frames
    )
    found = poses.of_walk(walk)
    assert not found[0].any()
    point_m = [np.array([0.0, 0.0, 0.5])]
    near, far = (moved_points(covariance, point_m) for covariance in found[1:])
    assert np.all(far > near)
    T_first = inverse(POSES[0])
    local = motion_covariances(T, [edge(1, 0, information), edge(2, 1, information)], 0)[1]
    expected = moved_points(local, apply(T_first, np.array(point_m)))
    assert np.linalg.norm(near) == pytest.approx(np.linalg.norm(expected))


def test_a_node_that_no_edge_joins_to_the_reference_is_not_sure():
    information = np.diag(1.0 / SDS**2)
    held, near, apart = motion_covariances(T, [edge(1, 0, information)], 0)
    assert not held.any()
    assert np.isfinite(near).all()
    assert np.isnan(apart).all()
    place = Placement((), tuple(POSES[:2]))
    seen_m = [np.array([[0.0, 0.0, 0.5]])] * 2
    first, second = poses.of_placement(place, seen_m, 0.0)
    assert not first.any()
    assert moved_points(second, seen_m[1]) == pytest.approx(poses.UNHELD_M)


def test_a_keyframe_without_links_or_without_a_pose_has_a_finite_covariance():
    frames = (POSES[0], None, POSES[1])
    nothing = PointCloud(np.empty((0, 3)))
    walk = Walk(np.arange(3.0), frames, (0, 1, 2), (), nothing, 0.01, np.empty(0, int), frames)
    first, lost, alone = poses.of_walk(walk)
    assert not first.any()
    assert np.isfinite(lost).all()
    assert moved_points(alone, [POSES[1][:3, 3]]) == pytest.approx(poses.UNHELD_M)
