"""IEEE 802.11ax at 2.4 GHz: 20 MHz, one spatial stream, one station a frame (HE SU), MCS 0 to 11 (SPEC 6.3).

Stations contend as in 802.11n. Left out: frames of several stations at once (OFDMA, triggered by the access
point), spatial reuse, and the packet extension, which a receiver may ask for (0 to 16 us).
"""

from __future__ import annotations

from network_sim.config import MacConfig
from network_sim.mac.phy import SIGNAL_EXTENSION_NS, Aggregation, PhysicalLayer, Waveform, wlan_2_4_ghz
from network_sim.radio.ofdm import SCHEMES
from network_sim.radio.propagation import ofdm_modulation

SUBCARRIERS = 234
"""Data subcarriers of 242 (IEEE 802.11ax-2021, Table 27-15)."""
SYMBOL_NS = 12_800
"""Without the guard interval."""
PREAMBLE_NS = 36_000
"""Legacy preamble and signal 20 us, repeated signal 4, HE-SIG-A 8, HE-STF 4; HE-LTF follows (Table 27-12)."""
TRAINING_NS = {0.8: 6_400, 1.6: 6_400, 3.2: 12_800}
"""HE-LTF without its guard interval: 2x, and 4x with the longest guard interval, as every station must
(27.1.1)."""
SERVICE_BITS, TAIL_BITS = 16, 6
LDPC_FROM_MCS = 10
"""From this MCS on the code is LDPC, which has no tail bits (27.3.12.5)."""
MOST_BYTES = 6_500_631
MOST_PACKETS = 64
MOST_NS = 5_484_000
"""Longest frame (aPPDUMaxTime, Table 27-54)."""


def waveform(mac: MacConfig) -> Waveform:
    """Return how data frames are sent.

    TXTIME = preamble + T_SYM N_SYM + signal extension, with N_SYM = ceil((8 length + 16 + 6) / N_DBPS) and
    symbols of 12.8 us and the guard interval (27.4.3, equation 27-135, without packet extension; an extra
    symbol of LDPC is left out).
    """
    name, guard_us = ofdm_modulation(mac), mac.guard_us or 0.8
    guard_ns = round(1000 * guard_us)
    return Waveform(
        name,
        PREAMBLE_NS + TRAINING_NS[guard_us] + guard_ns,
        symbol_ns=SYMBOL_NS + guard_ns,
        bits_per_symbol=SCHEMES[name].bits_per_symbol(SUBCARRIERS),
        extra_bits=SERVICE_BITS + (0 if mac.mcs >= LDPC_FROM_MCS else TAIL_BITS),
        extension_ns=SIGNAL_EXTENSION_NS,
    )


def physical_layer(mac: MacConfig) -> PhysicalLayer:
    """Return the physical layer with data frames of ``mac.mcs``."""
    packets, most_bytes = mac.ampdu_packets or MOST_PACKETS, min(mac.ampdu_bytes or MOST_BYTES, MOST_BYTES)
    return wlan_2_4_ghz(waveform(mac), mac.mcs, Aggregation(packets, most_bytes, MOST_NS, always=True))
