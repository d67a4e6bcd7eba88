"""Energy from times in states, and how it adds up over a run."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import ArrayLike

from network_sim.config import EnergyConfig
from network_sim.metrics import energy as e
from network_sim.metrics.metrics import camera_nodes, metrics
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.trace.states import State
from network_sim.types import NS_PER_S
from packetmesh.settings import with_settings
from tests.network_sim.by_hand import small_run, trace_of


def times_of(elapsed_s: float, tx_s: ArrayLike, rx_s: ArrayLike, sleep_s: ArrayLike) -> e.RadioTimes:
    """Times of nodes from seconds (N,) that each sent, received and slept."""
    states_s = {State.SENDING: tx_s, State.RECEIVING: rx_s, State.ASLEEP: sleep_s}
    return e.radio_times(np.stack([np.asarray(states_s[s]) * NS_PER_S for s in State], axis=-1), elapsed_s)


def times(elapsed_s: float, tx_s: float, rx_s: float, sleep_s: float) -> e.RadioTimes:
    return times_of(elapsed_s, [tx_s], [rx_s], [sleep_s])


def test_a_bit_sent_at_250_kbps_costs_209_nj() -> None:
    assert e.joules(times(1.0, 1 / 250e3, 0.0, 0.0), EnergyConfig()).tx_j[0] == pytest.approx(
        209e-9, rel=2e-3
    )


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_has_the_power_of_its_own_radio(preset):
    """What a radio draws, listening and sending: about a watt in 802.11b, less in newer modules of 802.11,
    tens of milliwatts in 802.15.4, LoRa and Bluetooth LE, whose nodes sleep instead of listening."""
    config = PRESETS[preset]
    least_w, most_w = {
        "ieee802154": (0.03, 0.1),
        "ieee80211b": (0.5, 2.0),
        "ieee80211n": (0.2, 1.0),
        "ieee80211ax": (0.2, 1.0),
        "ieee80211ah": (0.1, 1.0),
        "lora": (0.03, 0.1),
        "ble": (0.01, 0.03),
        "lte-m": (0.05, 1.0),
        "nb-iot": (0.05, 1.0),
    }[config.mac.kind]
    power = config.energy
    sleeps = config.mac.kind in ("lora", "ble")
    awake_w = (power.tx_w, power.rx_w) if sleeps else (power.tx_w, power.rx_w, power.idle_w)
    assert least_w < min(awake_w)
    assert max(awake_w) < most_w
    assert 0.0 < power.sleep_w < 0.1 * min(awake_w)
    assert power.idle_w == power.sleep_w or not sleeps


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
    states = times_of(90.0, *(90.0 * shares[:, :3].T))
    np.testing.assert_allclose(states.idle_s, 90.0 * shares[:, 3], atol=1e-12)
    np.testing.assert_allclose(states.elapsed_s, 90.0)
    full = times(0.3, 0.1, 0.2, 0.0)
    assert full.idle_s[0] == 0.0


def test_a_battery_lasts_its_energy_over_the_mean_power() -> None:
    config = EnergyConfig(battery_j=36_000.0)
    states = times_of(100.0, [0.0, 50.0], [0.0, 0.0], [100.0, 0.0])
    lifetimes_s = e.lifetimes_s(states, config)
    assert lifetimes_s[0] == pytest.approx(36_000.0 / (0.00006 + 0.1))
    assert lifetimes_s[1] == pytest.approx(36_000.0 / (2.7 + 0.5 * (0.0522 + 0.0564)))


def test_without_a_battery_or_consumption_a_node_lasts_for_ever() -> None:
    states = times(100.0, 50.0, 0.0, 0.0)
    assert e.lifetimes_s(states, EnergyConfig()).tolist() == [math.inf]
    free = EnergyConfig(tx_w=0, rx_w=0, idle_w=0, sleep_w=0, platform_w=0, platform_sleep_w=0, battery_j=1.0)
    assert e.lifetimes_s(states, free).tolist() == [math.inf]


def test_radio_energy_of_the_small_run_adds_up_minute_by_minute() -> None:
    """The second camera: a frame of 2 s in each minute (1 W), 10 s asleep (8 W), else it listens (4 W)."""
    trace = trace_of(small_run)
    second = np.array([False, True, False])
    found_j = e.cumulative_radio_j(trace.counters, second, trace.config.energy)
    first_minute_j = 1.0 * 2 + 4.0 * 58
    assert found_j.tolist() == [0.0, first_minute_j, first_minute_j + 1.0 * 2 + 8.0 * 10 + 4.0 * 48]


@pytest.mark.parametrize("preset", PRESETS)
def test_energy_never_falls_and_lies_between_sleep_and_full_power(preset: str) -> None:
    short = ["run.horizon_s=150", "run.warmup_s=20", "street.vehicles=5", "run.keep=counters"]
    trace = simulate(with_settings(PRESETS[preset], short))
    counters, config, cameras = trace.counters, trace.config.energy, camera_nodes(trace)
    spent_j = np.diff(e.cumulative_radio_j(counters, cameras, config))
    node_s = np.diff(counters.edges_ns[counters.warmup_minutes :]) / NS_PER_S * cameras.sum()
    assert len(spent_j) == 3
    assert (spent_j >= config.sleep_w * node_s).all()
    assert (spent_j <= max(config.tx_w, config.rx_w, config.idle_w) * node_s * (1 + 1e-12)).all()
    assert spent_j.sum() == pytest.approx(metrics(trace)["energy_radio"].value)
