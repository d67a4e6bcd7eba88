"""Medium access: how a packet gets from one node to the next."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import simpy

from network_sim.config import MacKind, NetworkConfig
from network_sim.mac.dcf import Dcf
from network_sim.mac.ieee802154 import Ieee802154
from network_sim.mac.simple import OwnLink
from network_sim.types import Delivery, Packet

if TYPE_CHECKING:
    from network_sim.mac.medium import Medium
    from network_sim.trace import Recorder


class Mac(Protocol):
    """Medium access of all nodes of one channel."""

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        A sender has one packet at a time. ``Delivery.ok`` is what the sender knows.
        """


def make_mac(
    kind: MacKind,
    env: simpy.Environment,
    medium: Medium | None,
    config: NetworkConfig,
    recorder: Recorder,
    rng: np.random.Generator,
    up: Callable[[int], bool],
    receive: Callable[[Packet, int], None],
) -> Mac:
    """The medium access of this kind.

    Args:
        kind: Ideal and serial links need no ``medium``; the others do.
        env: Its clock counts nanoseconds.
        medium: The shared channel.
        config: Of the whole network.
        recorder: Gets AIR, ACK, LOSS and DELIVER.
        rng: Draws backoffs.
        up: Whether a node is awake.
        receive: Called with each packet that has reached a node, and that node; once per ``send``.
    """
    if kind in ("ideal", "serial"):
        return OwnLink(env, medium, config, recorder, rng, up, receive)
    if medium is None:
        raise TypeError(f"{kind} needs a medium")
    if kind == "ieee802154":
        return Ieee802154(env, medium, config, recorder, rng, up, receive)
    return Dcf(env, medium, config, recorder, rng, up, receive)
