"""Joules of radios and platforms, from times in states or from bits over a distance (SPEC 6.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from network_sim.config import EnergyConfig
from packetmesh.errors import InputError

FloatArray = NDArray[np.float64]

ELECTRONICS_J_PER_BIT = 50e-9
"""What sending or receiving a bit costs before any distance (Heinzelman et al. 2002, table I)."""
FREE_SPACE_J_PER_BIT_M2 = 10e-12
"""Amplifier over free space (Heinzelman et al. 2002)."""
MULTIPATH_J_PER_BIT_M4 = 0.0013e-12
"""Amplifier beyond the crossover distance (Heinzelman et al. 2002)."""
CROSSOVER_M = math.sqrt(FREE_SPACE_J_PER_BIT_M2 / MULTIPATH_J_PER_BIT_M4)
"""Where both amplifier terms are equal: 87.7 m."""


def first_order_tx_j(bits: float, distance_m: float) -> float:
    """Energy to send ``bits`` over a distance: ``l E_elec + l eps d^a`` with a = 2, beyond 87.7 m a = 4."""
    if distance_m < CROSSOVER_M:
        return bits * (ELECTRONICS_J_PER_BIT + FREE_SPACE_J_PER_BIT_M2 * distance_m**2)
    return bits * (ELECTRONICS_J_PER_BIT + MULTIPATH_J_PER_BIT_M4 * distance_m**4)


def first_order_rx_j(bits: float) -> float:
    """Energy to receive ``bits``: ``l E_elec``."""
    return bits * ELECTRONICS_J_PER_BIT


@dataclass(frozen=True, slots=True)
class RadioTimes:
    """How long each node's radio was in each state; the platform sleeps with its radio."""

    tx_s: FloatArray
    """(N,) sending."""
    rx_s: FloatArray
    """(N,) receiving."""
    idle_s: FloatArray
    """(N,) listening to a channel on which nothing for it was sent."""
    sleep_s: FloatArray
    """(N,) asleep or down."""

    @property
    def elapsed_s(self) -> FloatArray:
        """(N,) all states together."""
        return self.tx_s + self.rx_s + self.idle_s + self.sleep_s


def radio_times(elapsed_s: float, tx_s: FloatArray, rx_s: FloatArray, sleep_s: FloatArray) -> RadioTimes:
    """Times in states of nodes that listen whenever they do nothing else.

    Args:
        elapsed_s: how long they were watched.
        tx_s, rx_s, sleep_s: (N,) time sending, receiving and asleep.

    Raises:
        InputError: a negative time, or more time in states than was watched.
    """
    busy_s = tx_s + rx_s + sleep_s
    impossible = (np.minimum(np.minimum(tx_s, rx_s), sleep_s) < 0.0) | (busy_s > elapsed_s * (1.0 + 1e-9))
    if impossible.any():
        node = int(np.argmax(impossible))
        raise InputError(
            f"Node {node} sends {tx_s[node]:g} s, receives {rx_s[node]:g} s and sleeps {sleep_s[node]:g} s "
            f"of {elapsed_s:g} s; try times that do not overlap, none negative"
        )
    return RadioTimes(tx_s, rx_s, np.maximum(elapsed_s - busy_s, 0.0), sleep_s)


@dataclass(frozen=True, slots=True)
class Energy:
    """Joules of each node by state: of its radio, and of the computer and camera that carry it."""

    tx_j: FloatArray
    """(N,) radio sending."""
    rx_j: FloatArray
    """(N,) radio receiving."""
    idle_j: FloatArray
    """(N,) radio listening."""
    sleep_j: FloatArray
    """(N,) radio asleep."""
    platform_j: FloatArray
    """(N,) platform awake."""
    platform_sleep_j: FloatArray
    """(N,) platform asleep."""

    @property
    def radio_j(self) -> FloatArray:
        """(N,) the radio in all its states."""
        return self.tx_j + self.rx_j + self.idle_j + self.sleep_j

    @property
    def total_j(self) -> FloatArray:
        """(N,) radio and platform."""
        return self.radio_j + self.platform_j + self.platform_sleep_j


def joules(times: RadioTimes, config: EnergyConfig) -> Energy:
    """Energy of times in states."""
    return Energy(
        tx_j=times.tx_s * config.tx_w,
        rx_j=times.rx_s * config.rx_w,
        idle_j=times.idle_s * config.idle_w,
        sleep_j=times.sleep_s * config.sleep_w,
        platform_j=(times.tx_s + times.rx_s + times.idle_s) * config.platform_w,
        platform_sleep_j=times.sleep_s * config.platform_sleep_w,
    )


def lifetimes_s(times: RadioTimes, config: EnergyConfig) -> FloatArray:
    """(N,) how long each node's battery lasts if it goes on as it did.

    Infinite without a battery or without consumption. The network's lifetime, until the first node is empty,
    is the least of them.
    """
    total_j = joules(times, config).total_j
    if config.battery_j is None:
        return np.full(total_j.shape, math.inf)
    share = np.divide(config.battery_j, total_j, out=np.full(total_j.shape, math.inf), where=total_j > 0.0)
    return share * times.elapsed_s
