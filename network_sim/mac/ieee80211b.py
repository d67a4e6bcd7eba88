"""IEEE 802.11b: direct sequence spread spectrum with long preambles (SPEC 6.3)."""

from __future__ import annotations

from network_sim.config import MacConfig
from network_sim.mac.phy import ACK_BYTES, ATTEMPTS, Answer, PhysicalLayer, Waveform
from network_sim.radio.propagation import IEEE80211B

SLOT_NS = 20_000
SIFS_NS = 10_000
DIFS_NS = SIFS_NS + 2 * SLOT_NS
PLCP_NS = 192_000
"""Long preamble and PLCP header."""
PROPAGATION_NS = 1_000
"""Bianchi's propagation delay between two stations; frame and reply together take twice as long."""
HEADER_BYTES = 28 + 8
"""Size of the MAC header with check sum, and of LLC/SNAP."""
CONTROL_BPS = 2e6
"""Rate of acknowledgements, RTS and CTS, except in a network of 1 Mb/s, which sends these at 1 Mb/s too."""
SYMBOLS: dict[float, tuple[float, int]] = {
    1e6: (1000.0, 1),
    2e6: (1000.0, 2),
    5.5e6: (8000 / 11, 4),
    11e6: (8000 / 11, 8),
}
"""Duration of a symbol in ns and its bits, by rate: 11 chips of 1/11 us, or 8 with complementary codes."""


def waveform(rate_bps: float) -> Waveform:
    """Return how frames are sent at 1, 2, 5.5 or 11 Mb/s."""
    return Waveform(IEEE80211B[rate_bps][0], PLCP_NS, *SYMBOLS[rate_bps])


EIFS_NS = SIFS_NS + waveform(1e6).air_ns(ACK_BYTES) + DIFS_NS


def physical_layer(mac: MacConfig) -> PhysicalLayer:
    """Return the physical layer with data frames at ``mac.rate_bps``."""
    control = waveform(min(mac.rate_bps, CONTROL_BPS))
    ack = Answer(ACK_BYTES, control.air_ns(ACK_BYTES))
    return PhysicalLayer(
        slot_ns=SLOT_NS,
        sifs_ns=SIFS_NS,
        difs_ns=DIFS_NS,
        propagation_ns=PROPAGATION_NS,
        min_window=32,
        max_window=1024,
        attempts=ATTEMPTS,
        header_bytes=HEADER_BYTES,
        data=waveform(mac.rate_bps),
        control=control,
        cts=ack,
        ack=ack,
        block_ack=None,
        aggregation=None,
        eifs_ns=EIFS_NS,
        answer_begins_ns=PLCP_NS,
    )
