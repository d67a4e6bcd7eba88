"""Frames of IEEE 802.15.4 as bytes: data frames and acknowledgements, with their check sums.

Fields are those of IEEE 802.15.4-2006, 7.2; all numbers are little-endian. PHY headers are left out, as in
every capture.
"""

from __future__ import annotations

from binascii import crc_hqx
from struct import Struct

PAN_ID = 0x504D
"""Identifier of the network: "PM" in ASCII."""
SEQUENCES = 1 << 8
"""Sequence numbers are taken modulo this."""

_DATA = 0x8841
"""Frame control of a data frame: one network (PAN ID compression), two short addresses."""
_ACK_REQUEST = 0x0020
_ACK = 0x0002
_HEADER = Struct("<HBHHH").pack
_MIRRORED = bytes(int(f"{value:08b}"[::-1], 2) for value in range(256))
"""Each byte with its bits in reverse order."""


def data_frame(sender: int, receiver: int, sequence: int, acknowledged: bool, payload: bytes) -> bytes:
    """Return a data frame.

    Args:
        sender: short address of the node that sends.
        receiver: short address of the next node.
        sequence: sequence number, 0 to 255.
        acknowledged: whether the frame asks for an acknowledgement.
        payload: what the frame carries, at most 116 bytes.
    """
    control = _DATA | _ACK_REQUEST if acknowledged else _DATA
    return with_check_sum(_HEADER(control, sequence, PAN_ID, receiver, sender) + payload)


def acknowledgement(sequence: int) -> bytes:
    """Return the acknowledgement of the frame with this sequence number; it holds no address."""
    return with_check_sum(_ACK.to_bytes(2, "little") + bytes([sequence]))


def with_check_sum(frame: bytes) -> bytes:
    """Return the frame followed by its check sum of two bytes.

    The check sum is the CRC of ITU-T with the generator x^16 + x^12 + x^5 + 1, lowest bit first (7.2.1.9).
    ``crc_hqx`` computes it with the highest bit first, hence from mirrored bytes.
    """
    return frame + crc_hqx(frame.translate(_MIRRORED), 0).to_bytes(2, "big").translate(_MIRRORED)
