"""IEEE 802.11n at 2.4 GHz: 20 MHz, one spatial stream, HT-mixed format, MCS 0 to 7 (SPEC 6.3)."""

from __future__ import annotations

from network_sim.config import MacConfig
from network_sim.mac.phy import SIGNAL_EXTENSION_NS, Aggregation, PhysicalLayer, Waveform, wlan_2_4_ghz
from network_sim.radio.ofdm import SCHEMES
from network_sim.radio.propagation import ofdm_modulation

SUBCARRIERS = 52
"""Data subcarriers (IEEE 802.11-2020, Table 19-6)."""
PREAMBLE_NS = 36_000
"""Legacy preamble and signal 20 us, HT-SIG 8, HT-STF 4, HT-LTF 4 (Table 19-6)."""
EXTRA_BITS = 16 + 6
MOST_BYTES = 65_535
MOST_PACKETS = 64
MOST_NS = 10_000_000
"""Longest frame (aPPDUMaxTime of the mixed format, Table 19-25)."""


def waveform(mac: MacConfig) -> Waveform:
    """Return how data frames are sent.

    TXTIME = preamble + 4 us ceil(T_SYM N_SYM / 4 us) + signal extension, with N_SYM = ceil((8 length + 16 +
    6) / N_DBPS), and symbols of 4 us, or 3.6 us with the short guard interval (19.4.3, equations 19-90 and
    19-91).
    """
    name = ofdm_modulation(mac)
    return Waveform(
        name,
        PREAMBLE_NS,
        symbol_ns=3_600 if mac.guard_us == 0.4 else 4_000,
        bits_per_symbol=SCHEMES[name].bits_per_symbol(SUBCARRIERS),
        extra_bits=EXTRA_BITS,
        step_ns=4_000,
        extension_ns=SIGNAL_EXTENSION_NS,
    )


def physical_layer(mac: MacConfig) -> PhysicalLayer:
    """Return the physical layer with data frames of ``mac.mcs``."""
    packets, most_bytes = mac.ampdu_packets or MOST_PACKETS, min(mac.ampdu_bytes or MOST_BYTES, MOST_BYTES)
    return wlan_2_4_ghz(waveform(mac), mac.mcs, Aggregation(packets, most_bytes, MOST_NS, always=False))
