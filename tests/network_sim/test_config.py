"""Configs say in one sentence what cannot be; layouts stand where they should."""

import math

import numpy as np
import pytest

from network_sim.config import NetworkConfig, NodesConfig
from network_sim.places import FixedPlaces, place_nodes
from packetmesh.errors import InputError
from packetmesh.settings import with_settings


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
        ("nodes.payload_bytes=117", "ieee802154 carries 116"),
        ("nodes.header_bytes=116", "no room"),
        ("nodes.duty_cycle=0", "nodes.duty_cycle"),
        ("nodes.duty_cycle=1.1", "between 0.0 and 1"),
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
