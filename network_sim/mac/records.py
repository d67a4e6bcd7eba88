"""What happens to a packet, as a line of the trace."""

from __future__ import annotations

from typing import TYPE_CHECKING

from network_sim.types import Cause, EventKind, Packet

if TYPE_CHECKING:
    from network_sim.trace import Recorder


def record_packet(
    recorder: Recorder,
    now_ns: int,
    kind: EventKind,
    packet: Packet,
    node: int,
    peer: int,
    size_bytes: int,
    cause: Cause = Cause.NONE,
    duration_ns: int = 0,
) -> None:
    """Record what ``node`` did with a packet for ``peer``; ``size_bytes`` with the headers if on the air."""
    recorder.add(
        now_ns,
        kind,
        node,
        peer,
        packet.id,
        packet.image,
        packet.first_byte,
        size_bytes,
        cause,
        duration_ns,
        packet.kind,
    )
