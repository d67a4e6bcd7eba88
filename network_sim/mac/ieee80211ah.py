"""IEEE 802.11ah below 1 GHz: 1 or 2 MHz, one spatial stream, MCS 0 to 7, and 10 at 1 MHz (SPEC 6.3).

Answers are preambles only (NDP): CTS, acknowledgement and block acknowledgement. Left out: the short guard
interval, restricted access windows, the short MAC header (PV1), and the duty cycle that Europe demands.
"""

from __future__ import annotations

from network_sim.config import MacConfig
from network_sim.mac.phy import (
    AIFS_SLOTS,
    ATTEMPTS,
    BEST_EFFORT_WINDOWS,
    QOS_HEADER_BYTES,
    Aggregation,
    Answer,
    PhysicalLayer,
    Waveform,
)
from network_sim.radio.ofdm import MCS_TWICE, SCHEMES, OfdmModulation
from network_sim.radio.propagation import ofdm_modulation
from network_sim.settings.mac import AH_SUBFRAMES

SLOT_NS, SIFS_NS = 52_000, 160_000
"""IEEE 802.11-2020, Table 23-39 (mem)."""
SUBCARRIERS = {1e6: 24, 2e6: 52}
"""Data subcarriers by bandwidth (Table 23-5)."""
SYMBOL_NS = 40_000
"""32 us and a guard interval of 8 us (Table 23-5)."""
PREAMBLE_SYMBOLS = {1e6: 14, 2e6: 6}
"""STF, LTF1 and SIG: 4, 4 and 6 symbols at 1 MHz, 2, 2 and 2 at 2 MHz, short format (Table 23-5)."""
EXTRA_BITS = 8 + 6
"""Service and tail bits (23.4.3)."""
MOST_SYMBOLS = 511
"""Longest A-MPDU: the Length field has 9 bits and counts symbols (23.3.8)."""
MOST_PLAIN_BYTES = 511
"""Longest frame of one packet without delimiter: the same field counts bytes."""


def waveform(name: OfdmModulation, bandwidth_hz: float) -> Waveform:
    """Return how frames are sent: TXTIME = preamble + 40 us ceil((8 length + 8 + 6) / N_DBPS) (23.4.3)."""
    return Waveform(
        name,
        preamble_ns=PREAMBLE_SYMBOLS[bandwidth_hz] * SYMBOL_NS,
        symbol_ns=SYMBOL_NS,
        bits_per_symbol=SCHEMES[name].bits_per_symbol(SUBCARRIERS[bandwidth_hz]),
        extra_bits=EXTRA_BITS,
    )


def physical_layer(mac: MacConfig) -> PhysicalLayer:
    """Return the physical layer with data frames of ``mac.mcs`` in a channel of ``mac.bandwidth_hz``."""
    bandwidth_hz = mac.bandwidth_hz
    data = waveform(ofdm_modulation(mac), bandwidth_hz)
    twice = mac.mcs == MCS_TWICE
    ndp = Answer(0, data.preamble_ns)
    aifs_ns = SIFS_NS + AIFS_SLOTS * SLOT_NS
    most_bytes = (MOST_SYMBOLS * data.bits_per_symbol - EXTRA_BITS) // 8
    packets = mac.ampdu_packets or AH_SUBFRAMES[bandwidth_hz]
    return PhysicalLayer(
        slot_ns=SLOT_NS,
        sifs_ns=SIFS_NS,
        difs_ns=aifs_ns,
        propagation_ns=0,
        min_window=BEST_EFFORT_WINDOWS[0],
        max_window=BEST_EFFORT_WINDOWS[1],
        attempts=ATTEMPTS,
        header_bytes=QOS_HEADER_BYTES,
        data=data,
        control=waveform("2 x bpsk 1/2" if twice else "bpsk 1/2", bandwidth_hz),
        cts=ndp,
        ack=ndp,
        block_ack=ndp,
        aggregation=Aggregation(
            packets,
            min(mac.ampdu_bytes or most_bytes, most_bytes),
            data.air_ns(most_bytes),
            always=False,
            most_plain_bytes=MOST_PLAIN_BYTES,
        ),
        eifs_ns=SIFS_NS + ndp.duration_ns + aifs_ns,
        answer_begins_ns=data.preamble_ns,
    )
