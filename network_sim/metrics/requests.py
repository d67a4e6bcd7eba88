"""The sink's requests for the bytes after the first ones of images: their time, basis and arrival."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from network_sim.fixed.images import request_packets_bytes
from network_sim.metrics.arrivals import arrivals
from network_sim.trace.log import NetworkTrace
from network_sim.types import EventKind, PacketKind, to_ns


@dataclass(frozen=True, slots=True)
class Requested:
    """The requests of a run with ``nodes.first_bytes_by_node``."""

    requested_ns: int | None
    """Time of the first request; None if the sink has sent none."""
    first_arrived: tuple[bool, ...]
    """By node: whether the sink had all its first bytes when it began to compute the requests."""
    answered: tuple[bool, ...]
    """By node: whether it has received its whole request."""


def requested(trace: NetworkTrace) -> Requested:
    """Return the requests of a run.

    Raises:
        InputError: the run kept no log of its packets.
    """
    config, came = trace.config.nodes, arrivals(trace)
    packets = trace.events.where(trace.events.packet_kind == PacketKind.REQUEST)
    sent, heard = packets.of(EventKind.ENQUEUE), packets.of(EventKind.RECEIVE)
    if not len(sent):
        none = (False,) * config.count
        return Requested(None, none, none)
    requested_ns = int(sent.t_ns.min())
    early = came.t_ns <= requested_ns - to_ns(config.request_after_s)
    first_arrived, answered = [], []
    for node, first_bytes in enumerate(config.first_bytes_by_node):
        mine = early & (came.node == node) & (came.first_byte < first_bytes)
        first_arrived.append(bool(came.byte_count[mine].sum() >= first_bytes))
        numbers = np.unique(heard.first_byte[heard.peer == node])
        answered.append(len(numbers) == len(request_packets_bytes(config, node)))
    return Requested(requested_ns, tuple(first_arrived), tuple(answered))
