"""Packet captures (pcap) of a run, for Wireshark, tshark and other readers.

A capture holds every frame that was on the air, as a sniffer next to its sender sees it: frames that collided
or were lost are in it, unharmed. A record's time is the start of its frame's preamble, from the start of the
run, in nanoseconds. Addresses are the number of each node in the trace, plus 1.
"""

from __future__ import annotations

from pathlib import Path
from struct import Struct

from network_sim.config import WLAN_KINDS, NetworkConfig
from network_sim.export import ieee802154_frames as wpan
from network_sim.export.contents import Contents, header_bytes
from network_sim.export.datagrams import IPV4_BYTES
from network_sim.export.numbers import LastNumbers
from network_sim.export.on_air import Frames, rows
from network_sim.export.wlan_capture import wlan_frames
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
"""Largest size of a frame (snapshot length) that the file's header states."""
_FILE_HEADER = Struct("<IHHiIII").pack
_RECORD_HEADER = Struct("<IIII").pack


def check_capture(config: NetworkConfig) -> None:
    """Check that a run with this config can be written as a capture.

    Raises:
        InputError: its log is not kept, or its links have no frames and its packets no IP headers.
    """
    if config.run.keep != "all":
        raise InputError(f"run.keep is {config.run.keep}, which keeps no frames to write; try run.keep=all")
    kind, headers = config.mac.kind, header_bytes(config)
    if kind not in ("ieee802154", *WLAN_KINDS) and headers < IPV4_BYTES:
        key = "scheme.headers_bytes" if config.scenario == "street-grid" else "nodes.header_bytes"
        raise InputError(
            f"mac.kind is {kind}, which has no frames, and {key} is {headers}, too few for the IP packets "
            f"that a capture could hold; try {key}={IPV4_BYTES}, or mac.kind=ieee802154"
        )


def write_capture(trace: NetworkTrace, path: Path) -> None:
    """Write the frames of a run to a pcap file with times in nanoseconds.

    IEEE 802.15.4 has the link type 195 (with check sum), IEEE 802.11 127 (radiotap, with rate and check
    sum), every other link 101 (IP packets, as these links have no frames). Each packet of an A-MPDU is a
    record of its own, as sniffers write it; answers of IEEE 802.11ah that are preambles only have no bytes
    and no record.

    Raises:
        InputError: as for ``check_capture``, or the file cannot be written.
    """
    check_capture(trace.config)
    kind, contents = trace.config.mac.kind, Contents(trace)
    link_type, frames = LINKTYPE_RAW, _packets(trace, contents)
    if kind == "ieee802154":
        link_type, frames = LINKTYPE_IEEE802_15_4, _wpan_frames(trace, contents)
    elif kind in WLAN_KINDS:
        link_type, frames = LINKTYPE_RADIOTAP, wlan_frames(trace, contents)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(_FILE_HEADER(_MAGIC_NS, 2, 4, 0, 0, _MOST_BYTES, link_type))
        for t_ns, frame in frames:
            file.write(_RECORD_HEADER(*divmod(t_ns, NS_PER_S), len(frame), len(frame)) + frame)


def _packets(trace: NetworkTrace, contents: Contents) -> Frames:
    """Yield time and IP packet of each transmission on links that have no frames."""
    return ((row.t_ns, contents.payload(row)) for row in rows(trace) if row.kind == EventKind.AIR)


def _wpan_frames(trace: NetworkTrace, contents: Contents) -> Frames:
    """Yield time and bytes of each frame of IEEE 802.15.4."""
    numbers, acknowledged = LastNumbers(wpan.SEQUENCES), trace.config.mac.ack
    for row in rows(trace):
        if row.kind == EventKind.DOWN:
            numbers.forget(row.node)
        elif row.kind == EventKind.ACK:
            yield row.t_ns, wpan.acknowledgement(numbers.latest(row.peer))
        else:
            number, _ = numbers.of(row)
            ends = row.node + 1, row.peer + 1
            yield row.t_ns, wpan.data_frame(*ends, number, acknowledged, contents.payload(row))
