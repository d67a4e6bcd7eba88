"""Configs say in one sentence what cannot be; layouts stand where they should."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network_sim.config import NetworkConfig, NodesConfig
from network_sim.radio.places import FixedPlaces, place_nodes
from network_sim.simulate import simulate
from network_sim.types import EventKind
from packetmesh.errors import InputError
from packetmesh.settings import settings, with_settings
from packetmesh.settings_help import describe


@pytest.mark.parametrize(
    ("setting", "names"),
    [
        ("radio.range_m=0", "radio.range_m"),
        ("radio.range_m=-5", "-5"),
        ("radio.sense_range_m=50", "at least 100"),
        ("radio.nakagami_m=0.1", "at least 0.5"),
        ("mac.link_bps=0", "mac.link_bps"),
        ("mac.link_bps=-1", "mac.link_bps"),
        ("nodes.count=0", "nodes.count"),
        ("nodes.images=-1", "nodes.images"),
        ("nodes.image_bytes=0", "nodes.image_bytes"),
        ("nodes.payload_bytes=117", "ieee802154 carries 116; try nodes.payload_bytes=116"),
        ("nodes.header_bytes=116", "no room"),
        ("nodes.duty_cycle=0", "nodes.duty_cycle"),
        ("nodes.duty_cycle=1.1", "between 0.0 and 1"),
        ("nodes.duty_cycle=0.004", "try nodes.duty_period_s=25"),
        ("nodes.duty_cycle=1e-11", "try a larger nodes.duty_cycle"),
        ("nodes.deadline_s=0", "nodes.deadline_s"),
        ("uplink.rate_bps=0", "uplink.rate_bps"),
        ("uplink.loss=2", "uplink.loss"),
        ("scheme.k=0", "scheme.k"),
        ("scheme.r_high=2", "scheme.r_high"),
        ("street.access_points=0", "street.access_points"),
        ("street.access_points=50", "at most 36"),
        ("energy.battery_j=0", "energy.battery_j"),
        ("run.horizon_s=0", "run.horizon_s"),
        ("run.warmup_s=3600", "nothing of run.horizon_s"),
        ("run.keep=some", "counters"),
        ("scenario=town", "street-grid"),
    ],
)
def test_an_impossible_value_is_one_sentence_that_names_it(setting, names):
    with pytest.raises(InputError) as error:
        with_settings(NetworkConfig(), [setting])
    assert names in str(error.value)
    assert "\n" not in str(error.value)


def test_no_config_takes_nan():
    with pytest.raises(InputError, match=r"nodes\.spacing_m is nan"):
        NodesConfig(spacing_m=math.nan)


@pytest.mark.parametrize("layout", ["star", "line", "grid", "random"])
def test_the_sink_stands_at_the_origin_behind_all_nodes(layout):
    places = place_nodes(NodesConfig(count=8, layout=layout), np.random.default_rng(3))
    assert places.count == 9
    assert places.static
    np.testing.assert_array_equal(places.positions_m[-1], 0.0)
    apart_m = [places.distance_m(a, b, 0) for a in range(9) for b in range(a)]
    assert min(apart_m) > 0.0


@pytest.mark.parametrize(("layout", "nearest"), [("star", 8), ("line", 1), ("grid", 2)])
def test_spacing_is_the_distance_to_the_nearest(layout, nearest):
    places = place_nodes(NodesConfig(count=8, layout=layout, spacing_m=7.0), np.random.default_rng(0))
    to_sink_m = np.array([places.distance_m(node, 8, 0) for node in range(8)])
    np.testing.assert_allclose(to_sink_m.min(), 7.0)
    assert np.count_nonzero(np.isclose(to_sink_m, 7.0)) == nearest


def test_random_places_follow_their_stream():
    config = NodesConfig(count=20, layout="random")
    first, again, other = (place_nodes(config, np.random.default_rng(seed)).positions_m for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_distances_are_those_of_the_plane():
    places = FixedPlaces(np.array([[0.0, 0.0], [3.0, 4.0]]))
    assert places.distance_m(0, 1, 0) == places.distance_m(1, 0, 10**12) == 5.0


def test_nodes_stand_where_they_are_put_and_the_sink_comes_last():
    config = with_settings(NetworkConfig(), ["nodes.count=2", "nodes.places_m=1,2.5,-3,4,0.25,0"]).nodes
    places = place_nodes(config, np.random.default_rng(0))
    np.testing.assert_array_equal(places.positions_m, [[1.0, 2.5], [-3.0, 4.0], [0.25, 0.0]])


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        (["nodes.places_m=0,0,1,1"], "nodes.places_m has 4 numbers; try 8"),
        (["nodes.count=1", "nodes.places_m=0,0,1,1,2,2"], "nodes.count is 1"),
        (["nodes.places_m=0,0,1,1,2,2,3,here"], "nodes.places_m=here is not a number"),
        (["nodes.bytes_by_node=5,6"], "nodes.bytes_by_node has 2 numbers; try 3"),
        (["nodes.bytes_by_node=5,0,6"], "nodes.bytes_by_node is 0"),
        (["nodes.bytes_by_node=5,1.5,6"], "nodes.bytes_by_node=1.5 is not a whole number"),
    ],
)
def test_places_and_sizes_agree_with_the_number_of_nodes(changes, names):
    with pytest.raises(InputError) as error:
        with_settings(NetworkConfig(), changes)
    assert names in str(error.value)


def test_no_place_is_nan():
    with pytest.raises(InputError, match=r"nodes\.places_m holds"):
        NodesConfig(count=1, places_m=(0.0, 0.0, 1.0, math.nan))


@given(
    places_m=st.lists(st.floats(-1e6, 1e6), min_size=4, max_size=12).filter(lambda xy: len(xy) % 2 == 0),
    data=st.data(),
)
def test_places_and_sizes_survive_as_text(places_m, data):
    count = len(places_m) // 2 - 1
    sizes = data.draw(st.lists(st.integers(1, 10**9), min_size=count, max_size=count))
    nodes = NodesConfig(count=count, places_m=tuple(places_m), bytes_by_node=tuple(sizes))
    config = replace(NetworkConfig(), nodes=nodes)
    text = settings(config)
    again = with_settings(NetworkConfig(), [f"{key}={value}" for key, value in text.items()])
    assert again == config
    assert all(type(size) is int for size in again.nodes.bytes_by_node)
    assert {row.key: row.value for row in describe(config)} == text


def test_every_node_sends_its_own_bytes():
    own = ["nodes.bytes_by_node=1000,117,116", "nodes.places_m=0,20,20,0,0,-20,0,0", "nodes.depth_bytes=9"]
    trace = simulate(with_settings(NetworkConfig(), own))
    for kind in (EventKind.CAPTURE, EventKind.ARRIVE):
        events = trace.events.of(kind)
        assert dict(zip(events.node.tolist(), events.size_bytes.tolist(), strict=True)) == {
            0: 1000,
            1: 117,
            2: 116,
        }
    fragments = trace.events.of(EventKind.RECEIVE)
    sums = np.bincount(fragments.node, fragments.size_bytes)
    assert sums.tolist() == [1000.0, 117.0, 116.0]
    np.testing.assert_array_equal(trace.positions_m, [[0, 20], [20, 0], [0, -20], [0, 0]])
