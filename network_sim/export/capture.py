"""Packet captures (pcap) of a run, for Wireshark, tshark and other readers.

A capture holds every frame that was on the air, as a sniffer beside its sender sees it: frames that collided
or were lost are in it, unharmed. A record's time is the start of its frame's preamble, from the start of the
run, in nanoseconds. Addresses are the number of each node in the trace, plus 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from struct import Struct

from network_sim.config import NetworkConfig
from network_sim.export import ieee80211_frames as wlan
from network_sim.export import ieee802154_frames as wpan
from network_sim.export.contents import Contents, OnAir, header_bytes
from network_sim.export.datagrams import IPV4_BYTES
from network_sim.mac import dcf
from network_sim.trace.log import NetworkTrace
from network_sim.types import NS_PER_S, EventKind
from packetmesh.errors import InputError
from packetmesh.files import atomic_path

LINKTYPE_RAW = 101
LINKTYPE_RADIOTAP = 127
LINKTYPE_IEEE802_15_4 = 195
"""IEEE 802.15.4 with its check sum."""

_MAGIC_NS = 0xA1B23C4D
_MOST_BYTES = 1 << 18
_FILE_HEADER = Struct("<IHHiIII").pack
_RECORD_HEADER = Struct("<IIII").pack
_BLOCK = 65536

Frames = Iterator[tuple[int, bytes]]
"""Start of each frame in ns, and its bytes."""


def check_capture(config: NetworkConfig) -> None:
    """Check that a run with this config can be written as a capture.

    Raises:
        InputError: its log is not kept, or its links have no frames and its packets no IP headers.
    """
    if config.run.keep != "all":
        raise InputError(f"run.keep is {config.run.keep}, which keeps no frames to write; try run.keep=all")
    kind, headers = config.mac.kind, header_bytes(config)
    if kind not in ("ieee802154", "ieee80211b") and headers < IPV4_BYTES:
        key = "scheme.headers_bytes" if config.scenario == "street-grid" else "nodes.header_bytes"
        raise InputError(
            f"mac.kind is {kind}, which has no frames, and {key} is {headers}, too few for the IP packets "
            f"that a capture could hold; try {key}={IPV4_BYTES}, or mac.kind=ieee802154"
        )


def write_capture(trace: NetworkTrace, path: Path) -> None:
    """Write the frames of a run to a pcap file with times in nanoseconds.

    IEEE 802.15.4 has the link type 195 (with check sum), IEEE 802.11b 127 (radiotap, with rate and check
    sum), every other link 101 (IP packets, as these links have no frames).

    Raises:
        InputError: as for ``check_capture``, or the file cannot be written.
    """
    check_capture(trace.config)
    kind, contents = trace.config.mac.kind, Contents(trace)
    link_type, frames = LINKTYPE_RAW, _packets(trace, contents)
    if kind == "ieee802154":
        link_type, frames = LINKTYPE_IEEE802_15_4, _wpan_frames(trace, contents)
    elif kind == "ieee80211b":
        link_type, frames = LINKTYPE_RADIOTAP, _wlan_frames(trace, contents)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(_FILE_HEADER(_MAGIC_NS, 2, 4, 0, 0, _MOST_BYTES, link_type))
        for t_ns, frame in frames:
            file.write(_RECORD_HEADER(*divmod(t_ns, NS_PER_S), len(frame), len(frame)) + frame)


def _rows(trace: NetworkTrace) -> Iterator[OnAir]:
    """Yield each frame on the air, and each failure or falling asleep of a node, in the order of time."""
    events = trace.events.of(EventKind.AIR, EventKind.ACK, EventKind.DOWN)
    for start in range(0, len(events), _BLOCK):
        part = slice(start, start + _BLOCK)
        columns = (getattr(events, name)[part].tolist() for name in OnAir._fields)
        yield from map(OnAir._make, zip(*columns, strict=True))


class _Numbers:
    """Sequence numbers of each sender, from 0: a packet keeps its number when it is sent again.

    A node that was down hands its packet to the medium access anew, which gives it a new number.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._packets: dict[int, int] = {}
        self._latest: dict[int, int] = {}

    def of(self, row: OnAir) -> tuple[int, bool]:
        """Return the number of a data frame, and whether the frame was sent before."""
        if self._packets.get(row.node) == row.packet:
            return self._latest[row.node], True
        self._packets[row.node] = row.packet
        self._latest[row.node] = number = (self.latest(row.node) + 1) % self._count
        return number, False

    def latest(self, node: int) -> int:
        """Return the number of a node's last data frame; -1 before its first."""
        return self._latest.get(node, -1)

    def forget(self, node: int) -> None:
        """Give the next data frame of a node a new number."""
        self._packets.pop(node, None)


def _packets(trace: NetworkTrace, contents: Contents) -> Frames:
    """Yield time and IP packet of each transmission on links that have no frames."""
    return ((row.t_ns, contents.payload(row)) for row in _rows(trace) if row.kind == EventKind.AIR)


def _wpan_frames(trace: NetworkTrace, contents: Contents) -> Frames:
    """Yield time and bytes of each frame of IEEE 802.15.4."""
    numbers, acknowledged = _Numbers(wpan.SEQUENCES), trace.config.mac.ack
    for row in _rows(trace):
        if row.kind == EventKind.DOWN:
            numbers.forget(row.node)
        elif row.kind == EventKind.ACK:
            yield row.t_ns, wpan.acknowledgement(numbers.latest(row.peer))
        else:
            number, _ = numbers.of(row)
            ends = row.node + 1, row.peer + 1
            yield row.t_ns, wpan.data_frame(*ends, number, acknowledged, contents.payload(row))


def _wlan_frames(trace: NetworkTrace, contents: Contents) -> Frames:
    """Yield time and bytes of each frame of IEEE 802.11b; a reply to an RTS is a CTS, any other an ACK."""
    rate_bps = trace.config.mac.rate_bps
    control_bps = min(rate_bps, dcf.CONTROL_BPS)
    headers = wlan.radiotap(rate_bps), wlan.radiotap(control_bps)
    numbers, ether_type = _Numbers(wlan.SEQUENCES), wlan.IPV4 if contents.are_ip else wlan.EXPERIMENTAL
    reply_ns = dcf.GAP_NS + dcf.air_ns(dcf.ACK_BYTES, control_bps)
    stations = [wlan.address(node + 1) for node in range(len(trace.names))]
    asked: set[int] = set()
    """Stations whose last request for a reply was an RTS."""
    for row in _rows(trace):
        if row.kind == EventKind.DOWN:
            numbers.forget(row.node)
            continue
        sender, receiver = stations[row.node], stations[row.peer]
        data_ns = dcf.GAP_NS + dcf.data_ns(contents.size_bytes(row.packet), rate_bps)
        if row.kind == EventKind.AIR:
            asked.discard(row.node)
            ends, order = (sender, receiver), numbers.of(row)
            frame = wlan.data_frame(*ends, *order, _us(reply_ns), ether_type, contents.payload(row))
        elif row.size_bytes == dcf.RTS_BYTES:
            asked.add(row.node)
            frame = wlan.rts(sender, receiver, _us(reply_ns + data_ns + reply_ns))
        elif row.peer in asked:
            frame = wlan.cts(receiver, _us(data_ns + reply_ns))
        else:
            frame = wlan.acknowledgement(receiver)
        yield row.t_ns, headers[row.kind != EventKind.AIR] + frame


def _us(duration_ns: int) -> int:
    """Return the whole microseconds of a reservation, rounded up as in IEEE 802.11-2007, 7.1.4."""
    return -(-duration_ns // 1000)
