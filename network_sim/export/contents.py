"""Content of each packet of a run, as the bytes of its frame's payload."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from network_sim.config import NetworkConfig
from network_sim.export.datagrams import IPV4_BYTES, LOWPAN_BYTES, ipv4_datagram, lowpan_datagram, padded
from network_sim.trace.log import NetworkTrace
from network_sim.types import EventKind, PacketKind

NO_NODE = -1
"""Index where no node, or no single one, is meant."""


class OnAir(NamedTuple):
    """Columns of an event of the log, named as there: a frame, or a node that fails or falls asleep."""

    t_ns: int
    kind: int
    node: int
    peer: int
    packet: int
    packet_kind: int
    image: int
    first_byte: int
    size_bytes: int
    duration_ns: int


def header_bytes(config: NetworkConfig) -> int:
    """Return the bytes of each packet that the config calls headers of higher layers."""
    street = config.scenario == "street-grid"
    return config.scheme.headers_bytes if street else config.nodes.header_bytes


class Contents:
    """Sources, sizes and contents of the packets of a run whose log is complete."""

    def __init__(self, trace: NetworkTrace) -> None:
        config = trace.config
        street = config.scenario == "street-grid"
        most = (
            config.scheme.datagram_bytes if street else config.nodes.payload_bytes - config.nodes.header_bytes
        )
        self._headers, self._data_bytes, self._names = header_bytes(config), most, trace.names
        self._lowpan = config.mac.kind == "ieee802154"
        self._last = NO_NODE if street else len(trace.names) - 1
        entered = trace.events.of(EventKind.ENQUEUE)
        packets, first = np.unique(entered.packet, return_index=True)
        self._sources = _by_id(packets, entered.node[first])
        self._sizes = _by_id(packets, entered.size_bytes[first])
        taken = trace.events.of(EventKind.CAPTURE)
        self._cameras = _by_id(taken.image, taken.node)

    @property
    def are_ip(self) -> bool:
        """Whether the packets are IP datagrams: their headers have room for those of UDP and IP."""
        return self._headers >= (LOWPAN_BYTES if self._lowpan else IPV4_BYTES)

    def size_bytes(self, packet: int) -> int:
        """Return the size of a packet."""
        return int(self._sizes[packet])

    def payload(self, row: OnAir) -> bytes:
        """Return the content of the packet of a frame."""
        packet = row.packet
        size_bytes = self.size_bytes(packet)
        text = self._text(row, size_bytes - self._headers)
        if not self.are_ip:
            return padded(text, size_bytes)
        ends = int(self._sources[packet]) + 1, self._destination(row) + 1
        if self._lowpan:
            return lowpan_datagram(*ends, padded(text, size_bytes - LOWPAN_BYTES))
        return ipv4_datagram(*ends, packet, padded(text, size_bytes - IPV4_BYTES))

    def _destination(self, row: OnAir) -> int:
        if self._last == NO_NODE:
            return row.peer
        to_camera = row.packet_kind in (PacketKind.STATUS, PacketKind.REQUEST)
        return int(self._cameras[row.image]) if to_camera else self._last

    def _text(self, row: OnAir, data_bytes: int) -> str:
        name, image, first_byte = self._names[self._sources[row.packet]], row.image, row.first_byte
        if row.packet_kind == PacketKind.IMAGE:
            fragment, last_byte = first_byte // self._data_bytes, first_byte + data_bytes - 1
            return f"#{name} image {image} fragment {fragment} bytes {first_byte}-{last_byte}"
        if row.packet_kind == PacketKind.STATUS:
            return f"#{name} status of image {image}"
        return f"#{name} {PacketKind(row.packet_kind).name.lower()}"


def _by_id(ids: NDArray[np.int32], values: NDArray[np.generic]) -> NDArray[np.int32]:
    """Return an array that holds the value of each id at its index, and -1 elsewhere."""
    found = np.full(int(ids.max(initial=-1)) + 1, NO_NODE, np.int32)
    found[ids] = values
    return found
