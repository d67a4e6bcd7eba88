"""Energy from times in states and from bits over a distance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from network_sim import energy as e
from network_sim.config import EnergyConfig
from packetmesh.errors import InputError


def times(elapsed_s: float, tx_s: float, rx_s: float, sleep_s: float) -> e.RadioTimes:
    return e.radio_times(elapsed_s, np.array([tx_s]), np.array([rx_s]), np.array([sleep_s]))


def test_first_order_radio_has_its_crossover_at_87_7_m_and_is_continuous_there() -> None:
    assert pytest.approx(87.7, abs=0.01) == e.CROSSOVER_M
    before, after = (e.first_order_tx_j(1.0, math.nextafter(e.CROSSOVER_M, goal)) for goal in (0.0, 1e3))
    assert before == pytest.approx(after, rel=1e-12)


def test_first_order_radio_at_known_distances() -> None:
    assert e.first_order_tx_j(2000, 10.0) == pytest.approx(2000 * (50e-9 + 1e-9))
    assert e.first_order_tx_j(2000, 100.0) == pytest.approx(2000 * (50e-9 + 130e-9))
    assert e.first_order_rx_j(2000) == pytest.approx(100e-6)
    assert e.first_order_tx_j(1, 0.0) == e.first_order_rx_j(1)


def test_a_bit_sent_at_250_kbps_costs_209_nj() -> None:
    assert e.joules(times(1.0, 1 / 250e3, 0.0, 0.0), EnergyConfig()).tx_j[0] == pytest.approx(
        209e-9, rel=2e-3
    )


def test_the_platform_dominates_the_transfer_of_one_image() -> None:
    packets = math.ceil(921_615 / 116)
    energy = e.joules(times(138.0, packets * 133 * 32e-6, 0.0, 0.0), EnergyConfig())
    assert energy.tx_j[0] == pytest.approx(1.77, abs=0.01)
    assert energy.platform_j[0] == pytest.approx(372.6)


def test_states_are_priced_apart_and_sum_to_the_total() -> None:
    config = EnergyConfig(tx_w=2.0, rx_w=3.0, idle_w=5.0, sleep_w=7.0, platform_w=11.0, platform_sleep_w=13.0)
    energy = e.joules(times(10.0, 1.0, 2.0, 4.0), config)
    parts = (
        energy.tx_j,
        energy.rx_j,
        energy.idle_j,
        energy.sleep_j,
        energy.platform_j,
        energy.platform_sleep_j,
    )
    assert [float(part[0]) for part in parts] == [2.0, 6.0, 15.0, 28.0, 66.0, 52.0]
    assert energy.radio_j[0] == 51.0
    assert energy.total_j[0] == 169.0


def test_a_node_listens_whenever_it_does_nothing_else() -> None:
    rng = np.random.default_rng(0)
    shares = rng.dirichlet(np.ones(4), 50)
    states = e.radio_times(90.0, 90.0 * shares[:, 0], 90.0 * shares[:, 1], 90.0 * shares[:, 2])
    np.testing.assert_allclose(states.idle_s, 90.0 * shares[:, 3], atol=1e-12)
    np.testing.assert_allclose(states.elapsed_s, 90.0)
    full = times(0.3, 0.1, 0.2, 0.0)
    assert full.idle_s[0] == 0.0


@pytest.mark.parametrize("bad", [(1.0, 0.6, 0.3, 0.2), (1.0, -0.1, 0.3, 0.2), (1.0, 0.1, 0.3, -0.2)])
def test_times_that_cannot_be_are_refused(bad: tuple[float, float, float, float]) -> None:
    with pytest.raises(InputError, match=r"^Node 0 sends .* try times that do not overlap, none negative$"):
        times(*bad)


def test_a_battery_lasts_its_energy_over_the_mean_power() -> None:
    config = EnergyConfig(battery_j=36_000.0)
    states = e.radio_times(100.0, np.array([0.0, 50.0]), np.zeros(2), np.array([100.0, 0.0]))
    lifetimes_s = e.lifetimes_s(states, config)
    assert lifetimes_s[0] == pytest.approx(36_000.0 / (0.00006 + 0.1))
    assert lifetimes_s[1] == pytest.approx(36_000.0 / (2.7 + 0.5 * (0.0522 + 0.0564)))


def test_without_a_battery_or_consumption_a_node_lasts_for_ever() -> None:
    states = times(100.0, 50.0, 0.0, 0.0)
    assert e.lifetimes_s(states, EnergyConfig()).tolist() == [math.inf]
    free = EnergyConfig(tx_w=0, rx_w=0, idle_w=0, sleep_w=0, platform_w=0, platform_sleep_w=0, battery_j=1.0)
    assert e.lifetimes_s(states, free).tolist() == [math.inf]
