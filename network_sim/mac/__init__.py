"""Medium access: carries a packet from one node to a neighbour."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Protocol

import simpy

from network_sim.config import MacKind
from network_sim.mac import dcf, ieee802154
from network_sim.mac.context import MacContext
from network_sim.mac.dcf import Dcf
from network_sim.mac.ieee802154 import Ieee802154
from network_sim.mac.replay import RecordedLink
from network_sim.mac.simple import OwnLink
from network_sim.types import Delivery, Packet

FRAME_HEADER_BYTES: dict[MacKind, int] = {
    "ieee80211b": dcf.HEADER_BYTES,
    "ieee802154": ieee802154.PHY_BYTES + ieee802154.HEADER_BYTES,
}
"""Bytes that each medium access adds to a packet to form a frame; the others add none."""


class Mac(Protocol):
    """Medium access of all nodes of one channel."""

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        A sender calls this for one packet after the other; earlier packets may still be ``under_way``.
        ``Delivery.ok`` is what the sender knows, ``Delivery.cause`` what happened.
        """


def make_mac(context: MacContext) -> Mac:
    """Create the medium access named by ``context.config.mac.kind``."""
    kind = context.config.mac.kind
    if kind in ("ideal", "serial"):
        return OwnLink(context)
    if kind == "replay":
        return RecordedLink(context)
    return Ieee802154(context) if kind == "ieee802154" else Dcf(context)
