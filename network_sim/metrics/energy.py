"""Energy of radios and platforms, from the time that each radio spends in each state (SPEC 6.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from network_sim.config import EnergyConfig
from network_sim.trace.counters import Counters
from network_sim.trace.states import State
from network_sim.types import NS_PER_S

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RadioTimes:
    """Time of each radio in each state, arrays of one shape; the platform sleeps with its radio."""

    tx_s: FloatArray
    """Sending."""
    rx_s: FloatArray
    """Receiving."""
    idle_s: FloatArray
    """Listening while no frame for this node is on the air."""
    sleep_s: FloatArray
    """Asleep or down."""

    @property
    def elapsed_s(self) -> FloatArray:
        """Time in all states together."""
        return self.tx_s + self.rx_s + self.idle_s + self.sleep_s


def radio_times(states_ns: NDArray[np.int64], elapsed_s: float | FloatArray) -> RadioTimes:
    """Compute the radio times, where the time outside all recorded states is listening.

    Args:
        states_ns: (..., S) time in each ``State``.
        elapsed_s: simulated time over which the states were counted; broadcasts to (...).
    """
    states_s = states_ns / NS_PER_S
    tx_s, rx_s, sleep_s = (states_s[..., s] for s in (State.SENDING, State.RECEIVING, State.ASLEEP))
    return RadioTimes(tx_s, rx_s, np.maximum(elapsed_s - (tx_s + rx_s + sleep_s), 0.0), sleep_s)


@dataclass(frozen=True, slots=True)
class Energy:
    """Energy of each node by state: of its radio, and of its platform (computer and camera)."""

    tx_j: FloatArray
    """Radio sending."""
    rx_j: FloatArray
    """Radio receiving."""
    idle_j: FloatArray
    """Radio listening."""
    sleep_j: FloatArray
    """Radio asleep."""
    platform_j: FloatArray
    """Platform awake."""
    platform_sleep_j: FloatArray
    """Platform asleep."""

    @property
    def radio_j(self) -> FloatArray:
        """Energy of the radio in all its states."""
        return self.tx_j + self.rx_j + self.idle_j + self.sleep_j

    @property
    def total_j(self) -> FloatArray:
        """Energy of radio and platform."""
        return self.radio_j + self.platform_j + self.platform_sleep_j


def joules(times: RadioTimes, config: EnergyConfig) -> Energy:
    """Compute the energy from the time in each state and its power."""
    return Energy(
        tx_j=times.tx_s * config.tx_w,
        rx_j=times.rx_s * config.rx_w,
        idle_j=times.idle_s * config.idle_w,
        sleep_j=times.sleep_s * config.sleep_w,
        platform_j=(times.tx_s + times.rx_s + times.idle_s) * config.platform_w,
        platform_sleep_j=times.sleep_s * config.platform_sleep_w,
    )


def cumulative_radio_j(counters: Counters, nodes: NDArray[np.bool_], config: EnergyConfig) -> FloatArray:
    """Sum the radio energy of the chosen nodes, from the end of the warm-up on.

    Args:
        counters: counters of a run.
        nodes: (N,) True for each chosen node.
        config: power of each state.

    Returns:
        (K + 1,) joules until each of ``counters.edges_ns`` from the end of the warm-up on, where they are 0;
        K minutes follow the warm-up.
    """
    after = slice(counters.warmup_minutes, None)
    elapsed_s = np.diff(counters.edges_ns[after]) / NS_PER_S
    times = radio_times(counters.states_ns[after][:, nodes], elapsed_s[:, None])
    return np.append(0.0, np.cumsum(joules(times, config).radio_j.sum(axis=1)))


def lifetimes_s(times: RadioTimes, config: EnergyConfig) -> FloatArray:
    """Return (N,) seconds that each node's battery lasts at its mean power in the run.

    A lifetime is infinite without a battery or without consumption. The network's lifetime, until the first
    battery is empty, is the minimum.
    """
    total_j = joules(times, config).total_j
    if config.battery_j is None:
        return np.full(total_j.shape, math.inf)
    share = np.divide(config.battery_j, total_j, out=np.full(total_j.shape, math.inf), where=total_j > 0.0)
    return share * times.elapsed_s
