"""stub"""

from dataclasses import dataclass

import numpy as np

from network_sim.types import *


@dataclass
class Arrivals:
    t_ns: object
    image: object
    node: object
    first_byte: object
    byte_count: object


@dataclass
class Spent:
    sent_bytes: int
    lost: int
    radio_j: float
    platform_j: float


def arrivals(trace):
    e = trace.events
    sink = trace.names.index("sink")
    d = e.where((e.kind == EventKind.DELIVER) & (e.peer == sink) & (e.packet_kind == PacketKind.IMAGE))
    key = d.image.astype(np.int64) * (1 << 32) + d.first_byte
    _, first = np.unique(key, return_index=True)
    first.sort()
    d = d.where(first)
    cap = e.of(EventKind.CAPTURE)
    node = np.zeros(int(cap.image.max()) + 1, int)
    node[cap.image] = cap.node
    return Arrivals(
        d.t_ns,
        d.image,
        node[d.image],
        d.first_byte.astype(np.int64),
        (d.size_bytes - trace.config.nodes.header_bytes).astype(np.int64),
    )


def until(trace, t_ns):
    e = trace.events
    b = e.t_ns <= t_ns
    return Spent(
        int(e.size_bytes[b & (e.kind == EventKind.AIR)].sum()),
        int((b & (e.kind == EventKind.LOSS)).sum()),
        0.0,
        0.0,
    )
