"""The nodes of a rig beside each other: by all pairs that share enough, by loops, from anywhere."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lab.worlds import box_room
from lab.worlds.demos import disturbed
from lab.worlds.render import Renderer
from pipeline.acquisition import back_project
from pipeline.config import PRESETS, RegistrationConfig
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.placement import attempt
from pipeline.placement.pairwise import place_nodes
from pipeline.placement.views import Views
from pipeline.registration import point_error_m, register
from pipeline.registration.finding.surface import Surface
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame
from tests.pipeline.registration.rooms import seen_by

CONFIG = PRESETS["packetmesh"].node_registration


def rig_of(nodes: int):
    """Frames whose nodes are wrong about their poses by 3 degrees and 6 cm, and their sensor clouds."""
    scene, rng = box_room(6, nodes=nodes), np.random.default_rng(1)
    renderer = Renderer(scene, threads=1)
    frames, works = [], []
    for index, (camera, cloud) in enumerate(zip(scene.cameras, seen_by(scene, 0.002), strict=True)):
        believed = camera if index == 0 else disturbed(camera, rng)
        image = np.zeros((240, 320, 3), np.uint8)
        depth = DepthMap(renderer.depth(scene.intrinsics, camera))
        frames.append(RgbdFrame(f"node_{index:02d}", image, depth, scene.intrinsics, believed))
        works.append(SimpleNamespace(name=frames[-1].name, sensor=cloud, fused=cloud))
    return scene, frames, works


@pytest.fixture(scope="module")
def six():
    return rig_of(6)


SLID = {("node_04", "node_00")}
"""Registrations that may end elsewhere, by little overlap, and are then rejected by their loops."""


def placed(frames, works, config=CONFIG):
    placement = place_nodes(frames, works, config)
    return placement.registrations, placement.T_world_camera


def is_of(sample, work) -> bool:
    """Whether a sample's first point is one of a node's."""
    return bool((work.sensor.points_m == sample.points_m[0]).all(axis=1).any())


def worst_error_m(scene, works, poses) -> float:
    return max(
        point_error_m(pose, truth, work.sensor.points_m)
        for pose, truth, work in zip(poses, scene.cameras, works, strict=True)
    )


def test_six_nodes_find_their_places_by_more_pairs_than_a_tree_has(six):
    scene, frames, works = six
    registrations, poses = placed(frames, works)
    assert len(registrations) > 5
    assert {row.source for row in registrations[:5]} == {work.name for work in works[1:]}
    unused = [row for row in registrations if not row.used]
    assert {(row.source, row.target) for row in unused} <= SLID
    assert max(row.loop_error_m for row in registrations if row.used) < 0.02
    np.testing.assert_array_equal(poses[0], frames[0].T_world_camera)
    assert worst_error_m(scene, works, poses) < 0.02


def test_a_registration_that_went_wrong_is_left_out(six, monkeypatch):
    scene, frames, works = six
    damage = rigid(rotation_exp(np.array([0.0, 0.1, 0.05])), np.array([0.2, 0.1, 0.0]))

    def misled(source, target, config, T_init):
        result = register(source, target, config, T_init)
        wrong = is_of(source, works[3]) and is_of(target, works[2])
        return replace(result, T_target_source=damage @ result.T_target_source) if wrong else result

    monkeypatch.setattr(attempt, "register", misled)
    registrations, poses = placed(frames, works)
    unused = {(row.source, row.target) for row in registrations if not row.used}
    assert unused - SLID == {("node_03", "node_02")}
    assert max(row.loop_error_m for row in registrations) > 0.1
    assert worst_error_m(scene, works, poses) < 0.02


def test_two_nodes_are_where_their_registration_says():
    _, frames, works = rig_of(2)
    (row,), poses = placed(frames, works)
    T_init = inverse(frames[0].T_world_camera) @ frames[1].T_world_camera
    alone = register(works[1].sensor, works[0].sensor, CONFIG, T_init)
    np.testing.assert_array_equal(row.result.T_target_source, alone.T_target_source)
    np.testing.assert_allclose(poses[1], poses[0] @ alone.T_target_source, atol=1e-12)
    assert row.used
    assert np.isnan(row.loop_error_m)


def test_views_taken_for_those_of_the_opposite_corner_do_not_confirm_each_other(six):
    """Nodes a third of a turn apart fit each other wall on wall, two of them in the same wrong way."""
    scene, frames, works = six
    placement = place_nodes([replace(frame, pose_known=False) for frame in frames], works, CONFIG)
    assert placement.sentences == []
    T = scene.cameras[0] @ inverse(placement.T_world_camera[0])
    assert worst_error_m(scene, works, [T @ pose for pose in placement.T_world_camera]) < 0.02


def test_nodes_that_do_not_know_where_they_are_find_out():
    scene, frames, works = rig_of(3)
    lost = [frames[0], *(replace(frame, T_world_camera=frames[0].T_world_camera) for frame in frames[1:])]
    registrations, poses = placed(lost, works, RegistrationConfig(start="global"))
    assert len(registrations) == 3
    assert worst_error_m(scene, works, poses) < 0.02


def test_a_nodes_points_are_seen_from_its_camera_even_in_clutter():
    """In this view near and far pixels alternate, so that the points alone do not tell who saw them."""
    z_m = np.where(np.indices((120, 160)).sum(axis=0) % 2, 1.0, 2.0)
    camera = CameraIntrinsics.pinhole(150.0, 150.0, 79.5, 59.5, 160, 120)
    frame = RgbdFrame("node_00", np.zeros((120, 160, 3), np.uint8), DepthMap(z_m), camera, np.eye(4))
    assert Surface(back_project(frame)).view is None
    assert Views([frame], 0).surface(0).view is not None


def test_a_node_that_measured_two_points_is_left_out_and_the_others_are_placed(six):
    """Its fused cloud is whole, as with inferred depth."""
    _, frames, works = six
    hidden_m = np.full_like(frames[2].depth.z_m, np.nan)
    hidden_m[100, [100, 200]] = 2.0
    blind = replace(frames[2], depth=DepthMap(hidden_m), pose_known=False)
    placement = place_nodes([*frames[:2], blind], works[:3], CONFIG, "fused")
    assert placement.placed([0, 1, 2]) == [0, 1]
    assert "relative to node_01: The node_02 cloud has 2 points" in placement.sentences[0]
