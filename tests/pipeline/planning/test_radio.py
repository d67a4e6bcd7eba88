"""Images of planned cameras on the network model: walls, distance, budget and deadline."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from network_sim.presets import PRESETS
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from pipeline.kernels.geometry import LEVEL_POSE
from pipeline.planning.plan import PlanConfig, plan_of
from pipeline.planning.radio import BATTERY_J, PlanRadio, deliver_plan, plan_within, ruled_out
from pipeline.types import Rig


def plan(office, count=2):
    return plan_of(office.seen, office.judged, office.sensor, PlanConfig(cameras=count))


def within(office, count, **limits):
    config = PlanConfig(cameras=count)
    return plan_within(office.rig, office.seen, office.judged, office.sensor, config, PlanRadio(**limits))


def test_every_new_image_has_the_present_ones_mean_size_and_arrives(office):
    found = deliver_plan(office.rig, office.seen, plan(office), PlanRadio(coding="raw"))
    frame = office.rig.frames[0]
    assert found.image_bytes == pytest.approx(5 * frame.rgb.shape[0] * frame.rgb.shape[1], rel=0.02)
    for one in found.cameras:
        assert 0.0 < one.seconds_to_90_s < one.seconds_to_99_s < np.inf
        least_s = 0.99 * 8 * found.image_bytes / 11e6  # at 802.11b's 11 Mbit/s
        assert one.seconds_to_99_s > least_s
        assert one.joules > 0.0
    assert found.joules == pytest.approx(sum(one.joules for one in found.cameras))


def test_more_cameras_at_once_wait_for_each_other(office):
    alone, shared = (
        deliver_plan(office.rig, office.seen, plan(office, count), PlanRadio()) for count in (1, 5)
    )
    last_s = max(one.seconds_to_99_s for one in shared.cameras)
    assert last_s > alone.cameras[0].seconds_to_99_s


def test_the_camera_of_a_recording_has_left_and_the_new_ones_send_alone(office):
    chosen, walked = plan(office, 1), replace(office.rig, walk=SimpleNamespace())
    beside, alone = (deliver_plan(rig, office.seen, chosen, PlanRadio()) for rig in (office.rig, walked))
    assert (alone.image_bytes, alone.sink_m) == (beside.image_bytes, beside.sink_m)
    assert alone.cameras[0].seconds_to_99_s < beside.cameras[0].seconds_to_99_s
    given = with_settings(PRESETS["office"], ["nodes.count=1", "nodes.places_m=0,0,3,4"])
    assert deliver_plan(walked, office.seen, chosen, PlanRadio(network=given)).sink_m == (3.0, 4.0)


def test_days_on_a_battery_are_those_of_an_image_and_sleep_in_each_period(office):
    found = deliver_plan(office.rig, office.seen, plan(office, 1), PlanRadio(every_s=600.0)).cameras[0]
    energy = PRESETS["office"].energy
    asleep_w = energy.sleep_w + energy.platform_sleep_w
    period_j = found.joules + asleep_w * (600.0 - found.seconds_to_99_s)
    assert found.battery_days == pytest.approx(BATTERY_J / period_j * 600.0 / 86400.0)
    seldom = deliver_plan(office.rig, office.seen, plan(office, 1), PlanRadio(every_s=6000.0)).cameras[0]
    assert seldom.battery_days > found.battery_days


def test_nothing_arrives_at_a_sink_out_of_reach(office):
    found = deliver_plan(office.rig, office.seen, plan(office), PlanRadio(sink_m=(900.0, 900.0)))
    assert [one.seconds_to_90_s for one in found.cameras] == [np.inf, np.inf]
    assert found.sink_m == (900.0, 900.0)
    with pytest.raises(InputError, match="does not carry a new camera's image to the sink"):
        within(office, 1, sink_m=(900.0, 900.0))


def test_a_wall_of_concrete_stops_what_one_of_plaster_lets_through(office):
    """A sink 8 m behind the office's wall, and a radio that reaches 30 m without one."""
    short = with_settings(PRESETS["office"], ["radio.range_m=30", "radio.sense_range_m=60"])
    arrived_s = {}
    for material in ("plaster", "concrete"):
        radio = PlanRadio(network=short, walls=material, sink_m=(1.5, 12.0))
        found = deliver_plan(office.rig, office.seen, plan(office, 1), radio)
        assert len(found.walls_m)
        arrived_s[material] = found.cameras[0].seconds_to_99_s
    assert arrived_s["plaster"] < np.inf == arrived_s["concrete"]


def test_a_budget_takes_cameras_away_until_it_is_kept(office):
    _, free = within(office, 3)
    budget_j = 0.75 * free.joules
    fewer, sent = within(office, 3, budget_j=budget_j)
    assert 1 <= len(fewer.cameras) < 3
    assert sent.joules <= budget_j
    with pytest.raises(InputError, match=r"No camera meets budget and deadline: .* allow that much"):
        within(office, 1, budget_j=1e-6)


def test_a_deadline_is_kept_or_refused(office):
    _, free = within(office, 1)
    deadline_s = 1.01 * free.cameras[0].seconds_to_99_s
    _, sent = within(office, 1, deadline_s=deadline_s)
    assert sent.cameras[0].seconds_to_99_s <= deadline_s
    with pytest.raises(InputError, match="No camera meets budget and deadline"):
        within(office, 1, deadline_s=1e-3)


def test_a_plan_says_by_what_places_are_ruled_out_and_nothing_where_none_is(office):
    free, _ = within(office, 1)
    assert free.barred == 0
    assert ruled_out(free, None) == ruled_out(free, 5.0) == ""
    allowed = np.flatnonzero(office.judged.allowed)
    fewer = plan_of(office.seen, office.judged, office.sensor, PlanConfig(), allowed[:3])
    assert (fewer.barred, fewer.candidates) == (3, len(allowed) - 3)
    assert ruled_out(fewer, None).endswith("ruled out by the radio")
    assert ruled_out(fewer, 5.0).endswith("ruled out by the deadline")


def test_the_same_plan_is_delivered_the_same(office):
    first, again = (deliver_plan(office.rig, office.seen, plan(office), PlanRadio()) for _ in range(2))
    assert first.cameras == again.cameras


@pytest.mark.parametrize("preset", ["thesis-link", "greenhouse"])
def test_other_networks_of_standing_cameras_carry_a_plan_too(office, preset):
    found = deliver_plan(office.rig, office.seen, plan(office, 1), PlanRadio(network=PRESETS[preset]))
    assert found.cameras[0].seconds_to_99_s < np.inf


def test_nodes_at_given_places_keep_them_and_their_sink(office):
    places = with_settings(PRESETS["office"], ["nodes.count=2", "nodes.places_m=0,0,1,0,2,5"])
    found = deliver_plan(office.rig, office.seen, plan(office, 1), PlanRadio(network=places))
    assert found.sink_m == (2.0, 5.0)
    three = with_settings(PRESETS["office"], ["nodes.count=3", "nodes.places_m=0,0,1,0,2,5,3,3"])
    with pytest.raises(InputError, match=r"nodes\.places_m"):
        deliver_plan(office.rig, office.seen, plan(office, 1), PlanRadio(network=three))


def test_cameras_that_turn_at_one_place_stand_there(office):
    same = tuple(replace(frame, T_world_camera=LEVEL_POSE) for frame in office.rig.frames)
    found = deliver_plan(Rig("same", same), office.seen, plan(office, 1), PlanRadio())
    assert found.sink_m == pytest.approx((0.0, -PRESETS["office"].nodes.spacing_m))
    assert found.cameras[0].seconds_to_99_s < np.inf


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"walls": "glass"}, "no wall of 'glass'; try one of plaster, wood"),
        ({"coding": "zip"}, "no coding 'zip'"),
        ({"network": PRESETS["street-grid"]}, "no cameras that stand still"),
        ({"every_s": 0.0}, "every_s is 0"),
        ({"budget_j": -1.0}, "budget_j is -1"),
        ({"deadline_s": 0.0}, "deadline_s is 0"),
    ],
)
def test_what_cannot_be_sent_is_one_sentence(changes, says):
    with pytest.raises(InputError, match=says):
        PlanRadio(**changes)
