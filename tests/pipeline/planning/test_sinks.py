"""The place of the sink: distance to the farthest camera, and walls in between."""

from dataclasses import replace

import numpy as np
import pytest

from network_sim.presets import PRESETS
from packetmesh.errors import InputError
from pipeline.planning.places import WHERES, free_places
from pipeline.planning.plan import PlanConfig, plan_of
from pipeline.planning.radio import PlanRadio, deliver_plan
from pipeline.planning.sinks import APART_M, best_sink, weakest_link_w

RADIO = replace(PRESETS["office"].radio, walls_m=(), wall_db=8.0)
TWO_M = np.array([[0.0, 0.0], [6.0, 0.0]])


def weakest_db(x_m, y_m, radio=RADIO):
    return 10.0 * np.log10(weakest_link_w(np.array([x_m, y_m]), TWO_M, radio))


def test_the_farther_camera_counts():
    assert weakest_db(3.0, 0.0) > weakest_db(2.0, 0.0) == pytest.approx(weakest_db(4.0, 0.0))
    assert weakest_db(3.0, 0.0) > weakest_db(3.0, 1.0)


def test_a_wall_costs_its_decibels_and_only_on_a_link_that_crosses_it():
    wall = replace(RADIO, walls_m=(4.0, -1.0, 4.0, 1.0))
    assert weakest_db(3.0, 0.0, wall) == pytest.approx(weakest_db(3.0, 0.0) - 8.0)
    assert weakest_db(1.0, 0.0, wall) == pytest.approx(weakest_db(1.0, 0.0) - 8.0)  # the far one, at 5 m
    assert weakest_db(9.0, 3.0, wall) == pytest.approx(weakest_db(9.0, 3.0))  # passes beside the wall


def test_no_free_place_has_a_stronger_weakest_link(office):
    frames = office.rig.frames
    cameras_m = np.array([frame.T_world_camera[:2, 3] for frame in frames] + [[4.0, 2.0]])
    best_m = best_sink(office.seen, cameras_m, RADIO)
    places_m = np.vstack([place[:2] for kind in WHERES for place in free_places(office.seen, kind)])
    assert (places_m == best_m).all(axis=1).any()
    places_m = places_m[np.linalg.norm(places_m[:, None] - cameras_m, axis=2).min(axis=1) >= APART_M]
    most_w = weakest_link_w(best_m, cameras_m, RADIO)
    assert all(weakest_link_w(place_m, cameras_m, RADIO) <= most_w for place_m in places_m)
    farthest_m = np.linalg.norm(places_m[:, None] - cameras_m, axis=2).max(axis=1)
    without_walls_m = np.linalg.norm(best_m - cameras_m, axis=1).max()
    assert without_walls_m == pytest.approx(farthest_m.min())


def test_the_sink_does_not_stand_where_a_camera_does(office):
    places_m = np.vstack([place[:2] for kind in WHERES for place in free_places(office.seen, kind)])
    middle_m = best_sink(office.seen, places_m[:1], RADIO)
    for cameras_m in (places_m[:1], np.vstack([places_m[:1], middle_m])):
        sink_m = best_sink(office.seen, cameras_m, RADIO)
        assert np.linalg.norm(sink_m - cameras_m, axis=1).min() >= APART_M
    with pytest.raises(InputError, match="give its x and y"):
        best_sink(office.seen, places_m, RADIO)


def test_the_plan_s_images_go_to_the_best_sink_of_all_its_cameras(office):
    plan = plan_of(office.seen, office.judged, office.sensor, PlanConfig(cameras=2))
    found = deliver_plan(office.rig, office.seen, plan, PlanRadio(sink_m="best"))
    stands_m = [T[:2, 3] for T in (frame.T_world_camera for frame in office.rig.frames)]
    stands_m += [camera.T_world_camera[:2, 3] for camera in plan.cameras]
    damped = replace(RADIO, walls_m=tuple(found.walls_m.ravel().tolist()))
    assert found.sink_m == pytest.approx(best_sink(office.seen, np.array(stands_m), damped))
    assert all(np.isfinite(one.seconds_to_99_s) for one in found.cameras)
