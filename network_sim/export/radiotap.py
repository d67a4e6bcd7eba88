"""Radiotap headers: how each frame of a capture of IEEE 802.11 was sent (radiotap.org, version 0).

Every frame ends with its check sum. All data frames are of one spatial stream.
"""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct

from network_sim.config import MacConfig
from network_sim.mac.ieee80211b import CONTROL_BPS
from network_sim.mac.phy import answer_rate_bps
from network_sim.radio.ofdm import MCS_TWICE

_FLAGS, _RATE, _CHANNEL, _MCS, _AMPDU, _HE = 1 << 1, 1 << 2, 1 << 3, 1 << 19, 1 << 20, 1 << 23
_WITH_CHECK_SUM = 0x10
_RATE_STEP_BPS = 500_000
_HEAD = Struct("<BBHI").pack
_AH_MHZ, _900_MHZ_OFDM = 915, 0x44
_TLVS = 1 << 28
"""The fields that follow have a type, a length and a value."""
_S1G_TYPE, _S1G_SHORT, _S1G_2_MHZ = 32, 1, 1 << 8
_S1G_KNOWN = 0b110101
"""Format, guard interval, bandwidth and MCS are known."""
_MCS_KNOWN = 0x7F
"""All of it is known: 20 MHz, one stream, mixed format, no STBC, convolutional code."""
_SHORT_GUARD = 1 << 2
_HE_KNOWN = 1 << 5 | 1 << 14
"""MCS and bandwidth are known (data1)."""
_HE_GUARD_KNOWN = 1 << 1
"""Guard interval is known (data2)."""
_HE_GUARDS = {0.8: 0, 1.6: 1, 3.2: 2}

DataHeader = Callable[[int, int], bytes]
"""Returns the header of a packet, from the number of its data frame and the number of packets in it."""


def rate_header(rate_bps: float) -> bytes:
    """Return the header of a frame that is sent at this rate."""
    return _header(_FLAGS | _RATE, bytes([_WITH_CHECK_SUM, round(rate_bps / _RATE_STEP_BPS)]))


def control_header(mac: MacConfig) -> bytes:
    """Return the header of RTS and answers."""
    if mac.kind == "ieee80211b":
        return rate_header(min(mac.rate_bps, CONTROL_BPS))
    if mac.kind == "ieee80211ah":
        return _ah_header(mac, MCS_TWICE if mac.mcs == MCS_TWICE else 0)
    return rate_header(answer_rate_bps(mac.mcs))


def data_header(mac: MacConfig) -> DataHeader:
    """Return the function that gives the header of each packet."""
    if mac.kind == "ieee80211b":
        plain = rate_header(mac.rate_bps)
        return lambda serial, packets: plain
    if mac.kind == "ieee80211ah":
        same = _ah_header(mac, mac.mcs)
        return lambda serial, packets: same
    return (_n_header if mac.kind == "ieee80211n" else _ax_header)(mac)


def _n_header(mac: MacConfig) -> DataHeader:
    """Flags, then the MCS field; in an A-MPDU, padded to four bytes, its number."""
    mcs = bytes([_WITH_CHECK_SUM, _MCS_KNOWN, _SHORT_GUARD if mac.guard_us == 0.4 else 0, mac.mcs])
    plain = _header(_FLAGS | _MCS, mcs)
    return lambda serial, packets: (
        plain if packets == 1 else _header(_FLAGS | _MCS | _AMPDU, mcs + _ampdu(serial))
    )


def _ax_header(mac: MacConfig) -> DataHeader:
    """Flags, padded to four bytes, the A-MPDU's number, and the HE field."""
    guard = _HE_GUARDS[mac.guard_us or 0.8]
    data3, data5 = mac.mcs << 8, guard << 4
    he = Struct("<6H").pack(_HE_KNOWN, _HE_GUARD_KNOWN, data3, 0, data5, 0)
    flags = bytes([_WITH_CHECK_SUM, 0, 0, 0])
    return lambda serial, packets: _header(_FLAGS | _AMPDU | _HE, flags + _ampdu(serial) + he)


def _ampdu(serial: int) -> bytes:
    """Return the field that joins the packets of an A-MPDU."""
    return Struct("<IHBB").pack(serial & 0xFFFFFFFF, 0, 0, 0)


def _ah_header(mac: MacConfig, mcs: int) -> bytes:
    """Flags, padded to two bytes, the channel, and, padded to four bytes, the S1G field as type, length,
    value."""
    narrow = mac.bandwidth_hz == 1e6
    data1 = (0 if narrow else _S1G_SHORT) | (0 if narrow else _S1G_2_MHZ) | mcs << 12
    s1g = Struct("<5H").pack(_S1G_TYPE, 6, _S1G_KNOWN, data1, 0)
    channel = Struct("<HH").pack(_AH_MHZ, _900_MHZ_OFDM)
    return _header(
        _FLAGS | _CHANNEL | _TLVS, bytes([_WITH_CHECK_SUM, 0]) + channel + bytes(2) + s1g + bytes(2)
    )


def _header(present: int, fields: bytes) -> bytes:
    return _HEAD(0, 0, 8 + len(fields), present) + fields
