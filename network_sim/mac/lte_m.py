"""LTE-M: the uplink of modules of category M1, which share one narrowband of six resource blocks.

A subframe carries a transport block of one node: 1000 bits, the most of category M1 (3GPP TS 36.306, Table
4.1-2), which are five resource blocks at I_TBS 11 (36.213, Table 7.1.7.2.1-1). A grant is followed by its
block, and a block by its next grant, four subframes later, so that a lost block is repeated eight subframes
after it was sent. A half-duplex module listens to three grants, switches, sends three blocks and switches
again: 3000 bits in 8 ms are its 375 kbit/s. A full-duplex module can send in every subframe: 1 Mbit/s.
"""

from __future__ import annotations

from network_sim.config import MacConfig
from network_sim.mac.cellular import SUBFRAME_NS, Carrier

HEADER_BYTES = 5
"""MAC 1, RLC in acknowledged mode 2, PDCP with 12 bits of sequence number 2 (36.321, 36.322, 36.323)."""
PROCESSES = 3
"""Blocks that a half-duplex module sends in a row."""
ANSWER_SUBFRAMES = 4
"""Subframes from a grant to its block, and from a block to its next grant."""


def carrier(mac: MacConfig) -> Carrier:
    """Return the narrowband, for half- or full-duplex modules."""
    return Carrier(
        block_ns=lambda size_bytes: SUBFRAME_NS,
        header_bytes=HEADER_BYTES,
        lanes=1,
        burst_blocks=1 if mac.full_duplex else PROCESSES,
        gap_ns=0 if mac.full_duplex else (2 * ANSWER_SUBFRAMES - PROCESSES) * SUBFRAME_NS,
        repeat_ns=(2 * ANSWER_SUBFRAMES - 1) * SUBFRAME_NS,
        request_ns=2 * ANSWER_SUBFRAMES * SUBFRAME_NS,
    )
