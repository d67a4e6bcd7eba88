"""Frames of IEEE 802.11 as bytes, with their check sums.

Fields are those of IEEE 802.11-2007, 7.2; all numbers are little-endian. The stations form an ad-hoc network:
each frame goes straight from sender to receiver.
"""

from __future__ import annotations

from collections.abc import Mapping
from struct import Struct
from zlib import crc32

SEQUENCES = 1 << 12
"""Sequence numbers are taken modulo this."""
IPV4 = 0x0800
"""EtherType of IPv4."""
EXPERIMENTAL = 0x88B5
"""EtherType that IEEE 802 leaves to experiments: raw data."""

_NETWORK = bytes.fromhex("02504dffffff")
"""Identifier of the network (BSSID), locally administered."""
_DATA, _QOS_DATA, _BLOCK_ACK, _RTS, _CTS, _ACK = 0x0008, 0x0088, 0x0094, 0x00B4, 0x00C4, 0x00D4
"""Frame control of each kind of frame."""
_RETRY = 0x0800
_COMPRESSED = 0x0004
"""Control field of a compressed block acknowledgement of best effort."""
_SHORT_BLOCK_ACK_BYTES = 32
_WIDE_BITMAP = 4
"""Fragment number of a bitmap of 256 packets."""
_SNAP = bytes.fromhex("aaaa03000000")
"""LLC and SNAP header before the EtherType."""
_TWO = Struct("<HH").pack


def address(node: int) -> bytes:
    """Return the locally administered MAC address 02:50:4d:00:xx:xx of a node, from its number there."""
    return b"\x02\x50\x4d\x00" + node.to_bytes(2, "big")


def data_frame(
    sender: bytes,
    receiver: bytes,
    sequence: int,
    retry: bool,
    reserved_us: int,
    ether_type: int,
    payload: bytes,
) -> bytes:
    """Return a data frame.

    Args:
        sender: address of the station that sends.
        receiver: address of the next station.
        sequence: sequence number, 0 to 4095.
        retry: whether the frame was sent before.
        reserved_us: time for which the channel is reserved after the frame.
        ether_type: EtherType of the payload.
        payload: content of the frame after the headers LLC and SNAP.
    """
    return _data(_DATA, sender, receiver, sequence, retry, reserved_us, b"", ether_type, payload)


def qos_data_frame(
    sender: bytes,
    receiver: bytes,
    sequence: int,
    retry: bool,
    reserved_us: int,
    ether_type: int,
    payload: bytes,
) -> bytes:
    """Return a data frame of best effort, to be acknowledged at once; arguments as for ``data_frame``."""
    return _data(_QOS_DATA, sender, receiver, sequence, retry, reserved_us, b"\0\0", ether_type, payload)


def _data(
    kind: int,
    sender: bytes,
    receiver: bytes,
    sequence: int,
    retry: bool,
    reserved_us: int,
    qos: bytes,
    ether_type: int,
    payload: bytes,
) -> bytes:
    control = kind | _RETRY if retry else kind
    header = _TWO(control, reserved_us) + receiver + sender + _NETWORK + (sequence << 4).to_bytes(2, "little")
    return _with_check_sum(header + qos + _SNAP + ether_type.to_bytes(2, "big") + payload)


def block_ack(sender: bytes, receiver: bytes, received: Mapping[int, bool], size_bytes: int) -> bytes:
    """Return a compressed block acknowledgement.

    Args:
        sender: address of the station that answers.
        receiver: address of the station that sent the packets.
        received: whether each packet arrived, by sequence number, in the order of the numbers.
        size_bytes: 32 for a bitmap of 64 packets, 56 for one of 256 (IEEE 802.11ax-2021, 9.3.1.8.2).
    """
    first, wide = next(iter(received)), size_bytes > _SHORT_BLOCK_ACK_BYTES
    bitmap = sum(1 << (number - first) % SEQUENCES for number, well in received.items() if well)
    start = first << 4 | (_WIDE_BITMAP if wide else 0)
    body = _TWO(_COMPRESSED, start) + bitmap.to_bytes(32 if wide else 8, "little")
    return _with_check_sum(_TWO(_BLOCK_ACK, 0) + receiver + sender + body)


def acknowledgement(receiver: bytes) -> bytes:
    """Return an acknowledgement to a station; it reserves nothing."""
    return _with_check_sum(_TWO(_ACK, 0) + receiver)


def rts(sender: bytes, receiver: bytes, reserved_us: int) -> bytes:
    """Return a request to send (RTS) that reserves the channel for this time after it."""
    return _with_check_sum(_TWO(_RTS, reserved_us) + receiver + sender)


def cts(receiver: bytes, reserved_us: int) -> bytes:
    """Return the answer to an RTS (CTS) that reserves the channel for this time after it."""
    return _with_check_sum(_TWO(_CTS, reserved_us) + receiver)


def _with_check_sum(frame: bytes) -> bytes:
    """Return the frame followed by its CRC-32 (7.1.3.7)."""
    return frame + crc32(frame).to_bytes(4, "little")
