"""What one node can send over unslotted IEEE 802.15.4, in closed form (SPEC 6.1).

Source: B. Latré et al., "Maximum throughput and minimum delay in IEEE 802.15.4", MSN 2005.
"""

from __future__ import annotations

from network_sim.mac.ieee802154 import (
    ACK_NS,
    BACKOFF_NS,
    BYTE_NS,
    CCA_NS,
    CHECKED_BYTES,
    MIN_BE,
    PHY_BYTES,
    TURNAROUND_NS,
    spacing_ns,
)
from network_sim.types import NS_PER_S

SHORT_ADDRESS_BYTES = 6
"""A network and two short addresses; none are 0 bytes, one network and two long addresses are 18."""
LINK_BPS = 8 * NS_PER_S / BYTE_NS
"""Bit rate on the air: 250 kbit/s."""


def maximum_throughput_bps(payload_bytes: int, *, address_bytes: int = 0, ack: bool = False) -> float:
    """Latré's maximum throughput of one sender that nobody disturbs.

    Mean first backoff + frame + (turnaround + acknowledgement) + interframe space. It leaves out the channel
    assessment and the turnaround after it; ``saturated_node_bps`` has them.

    Args:
        payload_bytes: Payload of each frame.
        address_bytes: Addresses in each frame.
        ack: Frames are acknowledged.

    Returns:
        Payload bits a second.
    """
    return 8 * payload_bytes * NS_PER_S / _cycle_ns(payload_bytes, address_bytes, ack)


def saturated_node_bps(payload_bytes: int, *, ack: bool = True) -> float:
    """Throughput of one sender with short addresses that always has a frame, as it is simulated.

    Args:
        payload_bytes: Payload of each frame.
        ack: Frames are acknowledged.

    Returns:
        Payload bits a second.
    """
    cycle_ns = _cycle_ns(payload_bytes, SHORT_ADDRESS_BYTES, ack) + CCA_NS + TURNAROUND_NS
    return 8 * payload_bytes * NS_PER_S / cycle_ns


def _cycle_ns(payload_bytes: int, address_bytes: int, ack: bool) -> float:
    frame_bytes = payload_bytes + address_bytes + CHECKED_BYTES
    answer_ns = TURNAROUND_NS + ACK_NS if ack else 0
    backoff_ns = (2**MIN_BE - 1) / 2 * BACKOFF_NS
    return backoff_ns + (PHY_BYTES + frame_bytes) * BYTE_NS + answer_ns + spacing_ns(frame_bytes)
