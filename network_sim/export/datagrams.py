"""Contents of packets as bytes: a datagram where the configured headers have room for one, else raw data.

A simulated packet has a size and no content. Here it gets a line of text on its content, followed by zeros.
"""

from __future__ import annotations

from struct import Struct

IPV4_BYTES = 28
"""Size of an IPv4 header and a UDP header."""
LOWPAN_BYTES = 10
"""Size of the compressed IPv6 and UDP headers of ``lowpan_datagram``."""
PORT = 61616
"""UDP port of both ends: the first of those that 6LoWPAN shortens to 4 bits."""

_TTL = 64
_UDP = 17
_IPV4 = Struct(">BBHHHBBH4s4s").pack
_DO_NOT_FRAGMENT = 0x4000
_IPHC = bytes([0b011_11_1_10, 0b00_10_00_10])
"""Traffic class left out, next header compressed, hop limit 64; both addresses in 16 bits."""
_UDP_NHC = bytes([0b11110_0_11, 0])
"""Both ports in 4 bits, check sum in full."""


def padded(text: str, size_bytes: int) -> bytes:
    """Return a text, cut or filled with zeros to this size.

    Texts start with #: readers of IEEE 802.15.4 guess by the first bits of a payload what it is, and #
    belongs to none of the protocols that they know.
    """
    return text.encode()[:size_bytes].ljust(size_bytes, b"\0")


def ipv4_datagram(source: int, destination: int, number: int, data: bytes) -> bytes:
    """Return a UDP datagram over IPv4 (RFC 768, RFC 791).

    Args:
        source: number of the node that made the packet; its address is 10.0.x.x.
        destination: number of the packet's last node.
        number: number of the packet, for the identification.
        data: what the datagram carries.
    """
    ends = b"\x0a\x00" + source.to_bytes(2, "big"), b"\x0a\x00" + destination.to_bytes(2, "big")
    total = IPV4_BYTES + len(data)
    fields = (0x45, 0, total, number & 0xFFFF, _DO_NOT_FRAGMENT, _TTL, _UDP)
    header = _IPV4(*fields, _check_sum(_IPV4(*fields, 0, *ends)), *ends)
    return header + _udp(ends[0] + ends[1], data)


def lowpan_datagram(source: int, destination: int, data: bytes) -> bytes:
    """Return a UDP datagram over IPv6 with the compressed headers of 6LoWPAN (RFC 6282, 3.1 and 4.3).

    Args:
        source: number of the node that made the packet; its address is fe80::ff:fe00:x.
        destination: number of the packet's last node.
        data: what the datagram carries.
    """
    ends = source.to_bytes(2, "big"), destination.to_bytes(2, "big")
    prefix = bytes.fromhex("fe80000000000000000000fffe00")
    udp = _udp(prefix + ends[0] + prefix + ends[1], data)
    return _IPHC + ends[0] + ends[1] + _UDP_NHC + udp[6:8] + data


def _udp(addresses: bytes, data: bytes) -> bytes:
    """Return UDP header and data; the check sum covers both addresses, the protocol and the length."""
    length = (8 + len(data)).to_bytes(2, "big")
    ports = PORT.to_bytes(2, "big") * 2
    covered = addresses + bytes([0, _UDP]) + length + ports + length + b"\0\0" + data
    return ports + length + (_check_sum(covered) or 0xFFFF).to_bytes(2, "big") + data


def _check_sum(data: bytes) -> int:
    """Return the complement of the sum of 16-bit words with end-around carry (RFC 1071).

    2^16 is 1 modulo 2^16 - 1, so that the sum is the remainder of the bytes as one number; a sum that is
    divisible is 0xFFFF, as the data are not all zero.
    """
    padded_data = data + b"\0" if len(data) % 2 else data
    return 0xFFFF - (int.from_bytes(padded_data, "big") % 0xFFFF or 0xFFFF)
