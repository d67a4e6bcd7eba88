"""Cameras as the nodes of a network."""

from dataclasses import replace

import numpy as np
import pytest

from network_sim.presets import PRESETS
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from pipeline.delivery.plan import network_of, placed, places_of, poses_known
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import look_at
from pipeline.types import Rig


def moved(rig, eyes_m):
    target_m = np.array([0.0, 10.0, 1.0])
    frames = [
        replace(frame, T_world_camera=look_at(np.array(eye_m), target_m))
        for frame, eye_m in zip(rig.frames, eyes_m, strict=True)
    ]
    return Rig(rig.name, tuple(frames))


def test_nodes_stand_under_their_cameras_and_the_sink_behind_them():
    rig = moved(load_demo("office"), [(-1.0, 0.0, 1.0), (0.0, 0.0, 2.0), (1.0, 0.0, 1.0)])
    places_m = np.reshape(places_of(rig, 8.0), (-1, 2))
    np.testing.assert_allclose(places_m[:3], [(-1, 0), (0, 0), (1, 0)], atol=1e-12)
    np.testing.assert_allclose(places_m[3], (0.0, -8.0), atol=1e-9)


def test_every_node_sends_its_own_image_once():
    rig = load_demo("office")
    nodes = network_of(rig, (10, 20, 30), PRESETS["office"]).nodes
    assert (nodes.count, nodes.images, nodes.bytes_by_node) == (3, 1, (10, 20, 30))


def test_without_poses_the_preset_says_where_nodes_stand():
    rig = load_demo("office")
    pose = rig.frames[0].T_world_camera
    heap = Rig("heap", tuple(replace(frame, T_world_camera=pose) for frame in rig.frames))
    assert not poses_known(heap)
    assert network_of(heap, (1, 1, 1), PRESETS["office"]).nodes.places_m == ()


def test_places_that_are_given_go_before_the_cameras_own_and_follow_who_sends():
    given = (0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 9.0, 9.0)
    network = with_settings(PRESETS["office"], ["nodes.count=3", f"nodes.places_m={str(given)[1:-1]}"])
    rig = load_demo("office")
    assert network_of(rig, (1, 1, 1), network).nodes.places_m == given
    some = placed(rig, network, [0, 2]).nodes
    assert (some.count, some.places_m) == (2, (0.0, 0.0, 2.0, 0.0, 9.0, 9.0))
    with pytest.raises(InputError, match="places 3 nodes and the sink, and there are 2 nodes"):
        placed(Rig("two", rig.frames[:2]), network, [0, 1])


def test_whoever_is_down_moves_nobody_else():
    rig, network = load_demo("office"), PRESETS["office"]
    whole = np.reshape(placed(rig, network, [0, 1, 2]).nodes.places_m, (-1, 2))
    some = np.reshape(placed(rig, network, [0, 2]).nodes.places_m, (-1, 2))
    np.testing.assert_array_equal(some, whole[[0, 2, 3]])
    pose = rig.frames[0].T_world_camera
    heap = Rig("heap", tuple(replace(frame, T_world_camera=pose) for frame in rig.frames))
    assert placed(heap, network, [0, 1, 2]) == network
    some = np.reshape(placed(heap, network, [0, 2]).nodes.places_m, (-1, 2))
    np.testing.assert_allclose(some[:2] @ some[1], [-32.0, 64.0], atol=1e-9)  # of a star of three, 8 m


def test_vehicles_are_no_cameras_of_a_room():
    with pytest.raises(InputError, match="stand still"):
        network_of(load_demo("office"), (1, 1, 1), PRESETS["street-grid"])
