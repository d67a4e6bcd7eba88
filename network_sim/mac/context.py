"""What every medium access works with, and random numbers for its backoffs."""

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
"""Random numbers are drawn in blocks: a call for each would dominate the run time."""


def ignore(packet: Packet, sender: int, receiver: int, delivery: Delivery) -> None:
    """For senders that never ask what became of a packet."""


@dataclass(frozen=True, slots=True)
class MacContext:
    """The clock, the channel and the nodes of one medium access."""

    env: simpy.Environment
    """Its clock counts nanoseconds."""
    medium: Medium
    """The shared channel; ideal and serial links do not use it."""
    config: NetworkConfig
    """Of the whole network; ``config.mac`` is this medium access."""
    recorder: Recorder
    """Gets AIR, ACK, LOSS and DELIVER."""
    rng: np.random.Generator
    """Draws backoffs."""
    up: Callable[[int], bool]
    """Whether a node is awake."""
    receive: Callable[[Packet, int], None]
    """Gets each packet once per ``send`` at most, and the node that it has reached."""
    report: Callable[[Packet, int, int, Delivery], None] = ignore
    """Gets each packet that was under way when ``send`` ended, its sender, its receiver, and the outcome."""


def random_below(most: int, rng: np.random.Generator) -> Iterator[int]:
    """Random numbers below a power of two; their lowest bits are those of smaller windows."""
    while True:
        yield from rng.integers(0, most, size=_BLOCK).tolist()
