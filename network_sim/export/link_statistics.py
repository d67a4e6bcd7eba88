"""Rate, delay and losses of a node's link, measured on the packets that the node sent during a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from network_sim.trace.log import Events, NetworkTrace
from network_sim.types import NS_PER_S, Cause, EventKind, to_ns

ON_THE_LINK = (Cause.COLLISION, Cause.NOISE, Cause.RANGE, Cause.CHANNEL, Cause.RETRIES, Cause.LINK)
"""Causes of a DROP in which the link lost the packet; in the others it was not sent, or a node was down."""


@dataclass(frozen=True, slots=True)
class Bursts:
    """Losses that come in bursts: the simple Gilbert model, a chain of good and bad packets.

    E. N. Gilbert, "Capacity of a burst-noise channel", Bell System Technical Journal 39, 1960, with no losses
    between bursts and none that arrive within one.
    """

    begin: float
    """Share of the packets after a delivered one that are lost (p)."""
    end: float
    """Share of the packets after a lost one that are delivered (r)."""


@dataclass(frozen=True, slots=True)
class LinkStatistics:
    """A node's link to the next node of its route, as its packets met it.

    A packet occupies the link from when it is queued, or the packet before it has left, until it is delivered
    or given up: waiting for the channel and retransmissions count.
    """

    packets: int
    """Packets that were delivered or lost."""
    rate_bps: float
    """Bits of all packets over the time for which they occupied the link."""
    one_way_s: float
    """Mean time from when a delivered packet occupied the link to its delivery."""
    delay_s: float
    """Mean by which that time exceeds size / rate; 0 if it is shorter."""
    jitter_s: float
    """Standard deviation of that difference."""
    loss: float
    """Share of the packets that were lost, 0 to 1."""
    bursts: Bursts | None
    """Model of the losses; None if they are too few for one, or all packets were lost."""


def link_statistics(trace: NetworkTrace, node: int) -> LinkStatistics | None:
    """Measure the link of a node after the warm-up, from a complete log.

    Packets that waited while any node failed, slept or woke count only as delivered or lost.

    Returns:
        The measured values; None if none of its packets was delivered in that time.
    """
    events = trace.events
    ended = events.where((events.node == node) & (_delivered(events) | _lost(events)))
    entered = events.where((events.node == node) & (events.kind == EventKind.ENQUEUE))
    starts_ns = np.maximum(_entered_ns(ended, entered), np.append(0, ended.t_ns[:-1]))
    changes_ns = events.of(EventKind.DOWN, EventKind.UP).t_ns
    undisturbed = np.searchsorted(changes_ns, starts_ns) == np.searchsorted(changes_ns, ended.t_ns, "right")
    counts = ended.t_ns >= to_ns(trace.config.run.warmup_s)
    arrived = _delivered(ended)
    taken_s = (ended.t_ns - starts_ns) / NS_PER_S
    used = counts & undisturbed
    if not (used & arrived).any():
        return None
    rate_bps = 8.0 * float(ended.size_bytes[used].sum() / taken_s[used].sum())
    one_way_s = taken_s[used & arrived]
    rest_s = one_way_s - 8.0 * ended.size_bytes[used & arrived] / rate_bps
    return LinkStatistics(
        packets=int(counts.sum()),
        rate_bps=rate_bps,
        one_way_s=float(one_way_s.mean()),
        delay_s=max(float(rest_s.mean()), 0.0),
        jitter_s=float(rest_s.std()),
        loss=float(1.0 - arrived[counts].mean()),
        bursts=bursts_of(~arrived[counts]),
    )


def bursts_of(lost: NDArray[np.bool_]) -> Bursts | None:
    """Fit the simple Gilbert model to (N,) packets in order, True for a lost one.

    Returns:
        The shares of transitions, which make the packets most likely; None without a transition of each kind.
    """
    before, after = lost[:-1], lost[1:]
    begins, ends = int((~before & after).sum()), int((before & ~after).sum())
    if not begins or not ends:
        return None
    return Bursts(begins / int((~before).sum()), ends / int(before.sum()))


def _delivered(events: Events) -> NDArray[np.bool_]:
    return events.kind == EventKind.DELIVER


def _lost(events: Events) -> NDArray[np.bool_]:
    return (events.kind == EventKind.DROP) & np.isin(events.cause, np.array(ON_THE_LINK, np.int8))


def _entered_ns(ended: Events, entered: Events) -> NDArray[np.int64]:
    """Return (N,) times at which packets entered the node's buffer; of one that came twice, the last time."""
    order = np.argsort(entered.packet, kind="stable")
    at = np.searchsorted(entered.packet[order], ended.packet, side="right") - 1
    return entered.t_ns[order[at]]
