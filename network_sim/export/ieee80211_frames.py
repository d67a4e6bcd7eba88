"""Frames of IEEE 802.11 as bytes, with their check sums, behind a radiotap header.

Fields are those of IEEE 802.11-2007, 7.2; all numbers are little-endian. The stations form an ad-hoc network:
each frame goes straight from sender to receiver.
"""

from __future__ import annotations

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
_DATA, _RTS, _CTS, _ACK = 0x0008, 0x00B4, 0x00C4, 0x00D4
"""Frame control of each kind of frame."""
_RETRY = 0x0800
_SNAP = bytes.fromhex("aaaa03000000")
"""LLC and SNAP header before the EtherType."""
_RADIOTAP = Struct("<BBHIBB").pack
_FLAGS_AND_RATE = 0b110
_WITH_CHECK_SUM = 0x10
_RATE_STEP_BPS = 500_000
_TWO = Struct("<HH").pack


def address(node: int) -> bytes:
    """Return the locally administered MAC address 02:50:4d:00:xx:xx of a node, from its number there."""
    return b"\x02\x50\x4d\x00" + node.to_bytes(2, "big")


def radiotap(rate_bps: float) -> bytes:
    """Return the radiotap header of a frame that ends with its check sum and is sent at this rate."""
    return _RADIOTAP(0, 0, 10, _FLAGS_AND_RATE, _WITH_CHECK_SUM, round(rate_bps / _RATE_STEP_BPS))


def data_frame(
    sender: bytes,
    receiver: bytes,
    sequence: int,
    retry: bool,
    reserved_us: int,
    ether_type: int,
    payload: bytes,
) -> bytes:
    """Return a data frame without radiotap header.

    Args:
        sender: address of the station that sends.
        receiver: address of the next station.
        sequence: sequence number, 0 to 4095.
        retry: whether the frame was sent before.
        reserved_us: time for which the channel is reserved after the frame.
        ether_type: what the payload is.
        payload: what the frame carries after LLC and SNAP.
    """
    control = _DATA | _RETRY if retry else _DATA
    header = _TWO(control, reserved_us) + receiver + sender + _NETWORK + (sequence << 4).to_bytes(2, "little")
    return _with_check_sum(header + _SNAP + ether_type.to_bytes(2, "big") + payload)


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
