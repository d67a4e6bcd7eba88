"""Given poses hold what the nodes' surfaces leave open, and nothing else."""

import numpy as np
import pytest

from pipeline.kernels.geometry import LEVEL_POSE, inverse, pixel_rays, rigid, rotation_exp
from pipeline.placement.given import (
    GIVEN_INFORMATION,
    GIVEN_M,
    given_edges,
    is_loose,
    loose_nodes,
    with_given_poses,
)
from pipeline.registration.graph.edges import PoseEdge
from pipeline.registration.graph.pose_graph import PoseGraph
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame
from tests.pipeline.placement.test_rig_places import placed

FIRM = np.diag([1e6] * 6)
"""Information of an edge that is right to a milliradian and a millimetre in all directions."""
ALONG_X = np.diag([1e6, 1e6, 1e6, 1.0, 1e6, 1e6])
"""The same, but with a standard error of a metre along x."""


def moved(*shift_m):
    return rigid(np.eye(3), np.array(shift_m, float))


def solved(T, count=2):
    return PoseGraph((np.eye(4), *T), (float("nan"),) * (count - 1), (True,) * (count - 1))


def test_an_open_direction_is_the_given_one_and_the_others_are_the_registrations():
    slid = PoseEdge(1, 0, moved(1.4, 0.0, 0.0), ALONG_X)
    given = given_edges([np.eye(4), moved(1.0, 0.03, -0.02)], [True, True], solved([slid.T_target_source]), 0)
    T = with_given_poses(solved([slid.T_target_source]), [slid], given, 0).T_reference_node[1]
    share = GIVEN_M**2 / (GIVEN_M**2 + 1.0)  # how much of the slide stays
    assert T[0, 3] == pytest.approx(1.0 + 0.4 * share, abs=1e-6)
    assert np.abs(T[1:3, 3]).max() < 1e-5
    np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=1e-4)


def test_a_given_pose_is_relative_to_that_of_the_reference():
    world = [
        rigid(rotation_exp(np.array([0.1, 0.7, -0.3])), np.array([3.0, 1.0, 2.0])) @ moved(0.5 * k, 0, 0)
        for k in range(3)
    ]
    graph = PoseGraph((moved(-0.5, 0, 0), np.eye(4), moved(0.5, 0, 0)), (float("nan"),) * 2, (True,) * 2)
    edges = given_edges(world, [True, True, True], graph, 1)
    assert [(edge.source, edge.target) for edge in edges] == [(0, 1), (2, 1)]
    np.testing.assert_allclose(edges[0].T_target_source, moved(-0.5, 0, 0), atol=1e-12)
    np.testing.assert_allclose(edges[1].T_target_source, moved(0.5, 0, 0), atol=1e-12)
    assert all(np.array_equal(edge.information, GIVEN_INFORMATION) for edge in edges)


def test_poses_that_nobody_gave_and_nodes_that_no_registration_reaches_count_for_nothing():
    nowhere = np.full((4, 4), np.nan)
    graph = solved([moved(1, 0, 0), nowhere], 3)
    world = [np.eye(4), moved(1, 0, 0), moved(2, 0, 0)]
    assert given_edges(world, [False, True, True], graph, 0) == []
    (edge,) = given_edges(world, [True, True, True], graph, 0)
    assert edge.source == 1
    assert given_edges(world, [True, False, True], graph, 0) == []
    held = [PoseEdge(1, 0, moved(1, 0, 0), FIRM)]
    after = with_given_poses(graph, held, [edge], 0)
    assert np.isnan(after.T_reference_node[2]).all()


def test_the_reference_stays_where_it_is_even_if_it_is_not_the_first():
    edge = PoseEdge(0, 1, moved(-1.4, 0, 0), ALONG_X)
    graph = PoseGraph((edge.T_target_source, np.eye(4)), (float("nan"),), (True,))
    given = given_edges([np.eye(4), moved(1.0, 0, 0)], [True, True], graph, 1)
    T = with_given_poses(graph, [edge], given, 1).T_reference_node
    np.testing.assert_allclose(T[1], np.eye(4), atol=1e-12)
    assert T[0][0, 3] == pytest.approx(-1.0, abs=0.01)


def test_a_registration_is_loose_by_the_information_of_standard_errors():
    assert not is_loose(PoseEdge(1, 0, np.eye(4), FIRM))
    assert is_loose(PoseEdge(1, 0, np.eye(4), ALONG_X))
    assert not is_loose(PoseEdge(1, 0, np.eye(4), ALONG_X, weak_information=FIRM))
    assert is_loose(PoseEdge(1, 0, np.eye(4), FIRM, weak_information=ALONG_X))


def test_a_node_is_loose_unless_another_way_holds_it():
    T = [moved(1, 0, 0), moved(2, 0, 0)]
    chain = [PoseEdge(1, 0, moved(1, 0, 0), ALONG_X), PoseEdge(2, 1, moved(1, 0, 0), FIRM)]
    assert loose_nodes(solved(T, 3), chain, 0) == [1, 2]
    loop = [*chain, PoseEdge(2, 0, moved(2, 0, 0), FIRM)]
    assert loose_nodes(solved(T, 3), loop, 0) == []


NORMALS = np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]]) / np.sqrt(2.0)
"""Of the two upright walls of a corner, which leave the motion along y, up and down, open."""


def view_of_corner(name, shift_m, error_m):
    """A corner 2 m away as a camera with a Kinect's noise measures it; the camera's pose has an error."""
    camera, rng = CameraIntrinsics.pinhole(262.0, 262.0, 159.5, 119.5, 320, 240), np.random.default_rng(0)
    along = pixel_rays(camera) @ NORMALS.T
    z_m = np.min(np.where(along > 0.0, (2.0 - NORMALS @ shift_m) / along, np.inf), axis=-1)
    z_m += 0.0012 * z_m**2 * rng.standard_normal(z_m.shape)
    given = LEVEL_POSE @ moved(*np.add(shift_m, error_m))
    rgb = np.full((240, 320, 3), 128, np.uint8)
    return RgbdFrame(name, rgb, DepthMap(z_m.astype(np.float32)), camera, given)


def test_a_camera_at_a_bare_corner_keeps_its_given_height_and_is_corrected_across_the_walls():
    shift_m = np.array([0.15, 0.1, 0.1])
    frames = [
        view_of_corner("one", np.zeros(3), np.zeros(3)),
        view_of_corner("other", shift_m, [0.02, 0.05, 0.03]),
    ]
    placement = placed(*frames)
    T = inverse(placement.T_world_camera[0]) @ placement.T_world_camera[1]
    x_m, y_m, z_m = T[:3, 3] - shift_m
    assert abs(x_m) < 0.005
    assert abs(z_m) < 0.005
    assert y_m == pytest.approx(0.05, abs=0.01)
    (sentence,) = placement.sentences
    assert sentence.startswith("other shares too little shape with the others to determine its place")
    shift_sd_m = np.sqrt(np.linalg.eigvalsh(placement.covariances[1][3:, 3:])[-1])
    assert 0.5 * GIVEN_M < shift_sd_m < 3.0 * GIVEN_M
