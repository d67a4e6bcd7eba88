"""NB-IoT: the uplink of modules of category NB1 on one carrier of 180 kHz.

A node gets 12, 6, 3 or 1 of the carrier's twelve subcarriers of 15 kHz, so that 1, 2, 4 or 12 nodes send at
once. It has one block under way: its grant takes a subframe (NPDCCH), eight subframes pass, it sends
(NPUSCH, format 1), and three subframes later it listens for the next grant (3GPP TS 36.213, 16.5.1, 16.6).
1000 bits in 1 + 8 + 4 + 3 ms on all subcarriers are the 62.5 kbit/s of category NB1.
"""

from __future__ import annotations

from functools import partial

from network_sim.config import MacConfig
from network_sim.mac.cellular import SUBFRAME_NS, Carrier

HEADER_BYTES = 4
"""MAC 1, RLC in acknowledged mode 2, PDCP with 7 bits of sequence number 1 (36.321, 36.322, 36.323)."""
SUBCARRIERS = 12
UNIT_SUBFRAMES = {1: 8, 3: 4, 6: 2, 12: 1}
"""Subframes of a resource unit by subcarriers (36.211, Table 10.1.2.3-1)."""
UNITS = (1, 2, 3, 4, 5, 6, 8, 10)
"""Resource units that a grant can have (36.213, Table 16.5.1.1-2)."""
SINGLE_BITS = (144, 328, 504, 680, 872, 1000)
"""Bits of a block in 1, 2, ... units at I_TBS 10, the most of one subcarrier (36.213, Table 16.5.1.2-2)."""
MULTI_BITS = (208, 440, 680, 1000)
"""The same at I_TBS 12, the most of several subcarriers."""
GRANT_SUBFRAMES = 1
DELAY_SUBFRAMES = 8
"""Shortest time from the end of a grant to its block (36.213, Table 16.5.1-1)."""
LISTEN_SUBFRAMES = 3
"""Time after a block in which a node need not listen (36.213, 16.6)."""


def block_ns(size_bytes: int, tones: int) -> int:
    """Return the time on the air of a block in the fewest resource units that hold it.

    Args:
        size_bytes: bytes of the block, headers included; at most 125.
        tones: its subcarriers.
    """
    sizes_bits = SINGLE_BITS if tones == 1 else MULTI_BITS
    units = next(units for units, bits in zip(UNITS, sizes_bits, strict=False) if bits >= 8 * size_bytes)
    return units * UNIT_SUBFRAMES[tones] * SUBFRAME_NS


def carrier(mac: MacConfig) -> Carrier:
    """Return the carrier, of which a node gets ``mac.tones`` subcarriers."""
    grant_ns = (GRANT_SUBFRAMES + DELAY_SUBFRAMES) * SUBFRAME_NS
    again_ns = LISTEN_SUBFRAMES * SUBFRAME_NS + grant_ns
    return Carrier(
        block_ns=partial(block_ns, tones=mac.tones),
        header_bytes=HEADER_BYTES,
        lanes=SUBCARRIERS // mac.tones,
        burst_blocks=1,
        gap_ns=again_ns,
        repeat_ns=again_ns,
        request_ns=grant_ns,
    )
