"""Frames of a run that were on the air, in the order of time, for captures."""

from __future__ import annotations

from collections.abc import Iterator

from network_sim.export.contents import OnAir
from network_sim.trace.log import NetworkTrace
from network_sim.types import EventKind

Frames = Iterator[tuple[int, bytes]]
"""Start of each frame in ns, and its bytes."""
_BLOCK = 65536


def rows(trace: NetworkTrace) -> Iterator[OnAir]:
    """Yield each frame on the air, and each failure or falling asleep of a node, in the order of time."""
    events = trace.events.of(EventKind.AIR, EventKind.ACK, EventKind.DOWN)
    for start in range(0, len(events), _BLOCK):
        part = slice(start, start + _BLOCK)
        columns = (getattr(events, name)[part].tolist() for name in OnAir._fields)
        yield from map(OnAir._make, zip(*columns, strict=True))
