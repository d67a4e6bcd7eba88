"""Ways to the sink are the cheapest that there are."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from network_sim.config import NetworkConfig, NodesConfig, RadioConfig
from network_sim.fixed.collection import disconnected, topology
from network_sim.fixed.routing import link_success, shortest_paths
from network_sim.presets import PRESETS
from network_sim.radio.places import FixedPlaces
from network_sim.radio.propagation import Radio
from packetmesh.settings import with_settings


def line_success(config: NetworkConfig, *at_m: float) -> np.ndarray:
    places = FixedPlaces(np.array([[x, 0.0] for x in at_m]))
    return link_success(config, Radio(config.radio, config.mac, np.random.default_rng(0)), places)


@settings(max_examples=50)
@given(st.integers(0, 10**6))
def test_costs_are_those_of_dijkstra(seed):
    rng = np.random.default_rng(seed)
    success = np.where(rng.random((12, 12)) < 0.3, rng.uniform(0.2, 1.0, (12, 12)), 0.0)
    success = np.triu(success, 1) + np.triu(success, 1).T
    routes = shortest_paths(success, 11)
    links = np.divide(1.0, success**2, out=np.zeros_like(success), where=success > 0)
    np.testing.assert_allclose(routes.cost, dijkstra(links, indices=11))
    for node in set(range(11)) - set(routes.unreachable):
        parent = routes.parents[node]
        assert routes.cost[node] == pytest.approx(routes.cost[parent] + links[node, parent])
        assert routes.hops(node) == routes.hops(parent) + 1


def test_booleans_give_the_fewest_hops_and_probabilities_the_fewest_transmissions():
    success = np.array([[0.0, 0.9, 0.5], [0.9, 0.0, 0.9], [0.5, 0.9, 0.0]])
    assert shortest_paths(success > 0, 2).parents == (2, 2, -1)
    assert shortest_paths(success, 2).parents == (1, 2, -1)


def test_the_way_down_is_the_way_up_reversed():
    chain = np.eye(5, k=1) + np.eye(5, k=-1)
    routes = shortest_paths(chain, 4)
    assert [routes.next_hop(at, 0) for at in (4, 3, 2, 1)] == [3, 2, 1, 0]
    assert [routes.next_hop(at, 4) for at in (0, 1, 2, 3)] == [1, 2, 3, 4]
    assert routes.hops(0) == 4


def test_a_node_without_links_has_no_way_up_or_down():
    success = np.zeros((3, 3))
    success[1, 2] = success[2, 1] = 1.0
    routes = shortest_paths(success, 2)
    assert routes.unreachable == (0,)
    assert routes.hops(0) == routes.next_hop(0, 2) == routes.next_hop(2, 0) == -1


def test_links_end_at_the_nominal_range():
    links = line_success(NetworkConfig(), 0.0, 100.0, 201.0) > 0
    np.testing.assert_array_equal(links, [[False, True, False], [True, False, False], [False, False, False]])


def test_a_serial_line_has_no_range():
    config = with_settings(NetworkConfig(), ["mac.kind=serial"])
    np.testing.assert_array_equal(line_success(config, 0.0, 1e4), 1.0 - np.eye(2))


def test_fading_at_the_nominal_range_is_rayleigh_s():
    config = NetworkConfig(radio=RadioConfig(nakagami_m=1.0))
    assert line_success(config, 0.0, 100.0)[0, 1] == pytest.approx(np.exp(-1.0), abs=0.02)


def test_noise_makes_far_links_worse():
    radio = RadioConfig(tx_power_dbm=0.0, nakagami_m=2.0, noise_dbm=-82.0)
    success = line_success(NetworkConfig(radio=radio), 0.0, 20.0, 70.0)
    assert 0.0 < success[1, 2] < success[0, 1] < 1.0
    np.testing.assert_array_equal(success, success.T)


def test_who_cannot_reach_the_sink_is_named():
    config = NetworkConfig(nodes=NodesConfig(count=3, layout="line", spacing_m=120.0))
    assert disconnected(config) == ("node 1", "node 2", "node 3")
    near = replace(config, nodes=replace(config.nodes, spacing_m=80.0))
    assert disconnected(near) == ()
    routes = shortest_paths(line_success(near, 80.0, 160.0, 240.0, 0.0), 3)
    assert [routes.hops(node) for node in range(3)] == [1, 2, 3]


def test_frames_go_round_a_wall_over_another_node():
    places = FixedPlaces(np.array([[0.0, 0.0], [20.0, 20.0], [40.0, 0.0]]))
    radio = RadioConfig(range_m=50.0, sense_range_m=100.0)
    walled = replace(radio, walls_m=(20.0, -5.0, 20.0, 5.0), wall_db=30.0)
    parents = []
    for one in (radio, walled):
        config = NetworkConfig(radio=one)
        success = link_success(config, Radio(one, config.mac, np.random.default_rng(0)), places)
        parents.append(shortest_paths(success, 2).parents)
    assert parents == [(2, 2, -1), (1, 2, -1)]


@pytest.mark.parametrize("preset", ["lora", "ble", "lte-m", "nb-iot"])
def test_in_a_star_no_node_forwards_for_another(preset):
    """In a line of nodes 7 m apart the nearer ones would be relays; links have the sink at one end."""
    config = with_settings(PRESETS[preset], ["nodes.layout=line", "nodes.count=4", "nodes.spacing_m=7"])
    _, _, success = topology(config)
    assert (success[:-1, :-1] == 0.0).all()
    np.testing.assert_array_equal(success, success.T)
    assert shortest_paths(success, 4).parents == (4, 4, 4, 4, -1)
