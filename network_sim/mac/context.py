"""Clock, channel and callbacks that every medium access needs, and random numbers for its backoffs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import simpy

from network_sim.config import NetworkConfig
from network_sim.types import Delivery, Packet

if TYPE_CHECKING:
    from network_sim.mac.medium import Medium
    from network_sim.trace.log import Recorder

_BLOCK = 4096
"""Random numbers drawn per call: one call for each number would dominate the run time."""


def ignore(packet: Packet, sender: int, receiver: int, delivery: Delivery) -> None:
    """Ignore the reported outcome of a packet (default of ``MacContext.report``)."""


@dataclass(frozen=True, slots=True)
class MacContext:
    """The clock, the channel and the nodes of one medium access."""

    env: simpy.Environment
    """Simulation environment; its clock counts nanoseconds."""
    medium: Medium
    """The shared channel; ideal and serial links do not use it."""
    config: NetworkConfig
    """Config of the whole network; ``config.mac`` is for this medium access."""
    recorder: Recorder
    """Receives the events AIR, ACK, LOSS and DELIVER."""
    rng: np.random.Generator
    """Random generator of the backoffs."""
    up: Callable[[int], bool]
    """Returns whether a node has neither failed nor fallen asleep."""
    receive: Callable[[Packet, int], None]
    """Called with a packet and the node that it has reached, at most once per ``send``."""
    report: Callable[[Packet, int, int, Delivery], None] = ignore
    """Called with packet, sender, receiver and outcome of each packet that was under way after ``send``."""


def random_below(most: int, rng: np.random.Generator) -> Iterator[int]:
    """Yield random integers below a power of two; their lowest bits serve for smaller windows."""
    while True:
        yield from rng.integers(0, most, size=_BLOCK).tolist()
