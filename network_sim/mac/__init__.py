"""Medium access: carries a packet from one node to a neighbour."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Protocol

import simpy

from network_sim.config import OFDM_KINDS, MacConfig, MacKind, NetworkConfig
from network_sim.mac import (
    ble,
    ieee80211ah,
    ieee80211ax,
    ieee80211b,
    ieee80211n,
    ieee802154,
    lora,
    lte_m,
    nb_iot,
)
from network_sim.mac.aggregating import Aggregating
from network_sim.mac.ble import Ble
from network_sim.mac.cellular import Cellular
from network_sim.mac.context import MacContext
from network_sim.mac.dcf import Dcf
from network_sim.mac.ieee802154 import Ieee802154
from network_sim.mac.lora import Lora
from network_sim.mac.phy import DELIMITER_BYTES, QOS_HEADER_BYTES, PhysicalLayer
from network_sim.mac.replay import RecordedLink
from network_sim.mac.simple import OwnLink
from network_sim.types import Delivery, Packet

FRAME_HEADER_BYTES: dict[MacKind, int] = {
    "ieee80211b": ieee80211b.HEADER_BYTES,
    **dict.fromkeys(OFDM_KINDS, QOS_HEADER_BYTES + DELIMITER_BYTES),
    "ieee802154": ieee802154.PHY_BYTES + ieee802154.HEADER_BYTES,
    "lora": lora.HEADER_BYTES,
    "ble": ble.HEADER_BYTES,
    "lte-m": lte_m.HEADER_BYTES,
    "nb-iot": nb_iot.HEADER_BYTES,
}
"""Bytes that each medium access adds to a packet to form a frame; the others add none."""


class Mac(Protocol):
    """Medium access of all nodes of one channel."""

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        A sender calls this for one packet after the other; earlier packets may still be ``under_way``. The
        outcome of such a packet is reported once, before or after this returns.
        ``Delivery.ok`` is what the sender knows, ``Delivery.cause`` what happened.
        """


def make_mac(context: MacContext) -> Mac:
    """Create the medium access named by ``context.config.mac.kind``."""
    kind = context.config.mac.kind
    if kind in ("ideal", "serial"):
        return OwnLink(context)
    if kind == "replay":
        return RecordedLink(context)
    if kind == "lora":
        return Lora(context)
    if kind == "ble":
        return Ble(context)
    if kind in ("lte-m", "nb-iot"):
        return Cellular(context, (lte_m if kind == "lte-m" else nb_iot).carrier(context.config.mac))
    if kind == "ieee802154":
        return Ieee802154(context)
    return make_wlan(context)


def make_wlan(context: MacContext, wait_after_loss: bool = True) -> Mac:
    """Create the medium access of an IEEE 802.11 network; ``wait_after_loss`` is that of ``Contention``."""
    layer = physical_layer(context.config.mac)
    return (Dcf if layer.aggregation is None else Aggregating)(context, layer, wait_after_loss)


def physical_layer(mac: MacConfig) -> PhysicalLayer:
    """Return the physical layer of an IEEE 802.11 network."""
    return {
        "ieee80211b": ieee80211b,
        "ieee80211n": ieee80211n,
        "ieee80211ax": ieee80211ax,
        "ieee80211ah": ieee80211ah,
    }[mac.kind].physical_layer(mac)


def pace_ns(config: NetworkConfig) -> int:
    """Return the time from one full packet of a node to its next, where regulation limits it; else 0."""
    return lora.period_ns(config) if config.mac.kind == "lora" else 0
