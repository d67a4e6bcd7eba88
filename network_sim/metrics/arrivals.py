"""Arrival times of image fragments, and bytes, losses and energy spent until any moment of a run.

A fragment is identified by its bytes [first_byte, first_byte + byte_count) of an image.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from network_sim.metrics.metrics import camera_nodes, energy
from network_sim.trace.log import Events, NetworkTrace
from network_sim.trace.states import State, disjoint
from network_sim.types import NS_PER_S, EventKind, PacketKind
from packetmesh.errors import InputError

Place = Literal["sink", "cloud"]
IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Arrivals:
    """Columns (A,) of the first arrival of each fragment, sorted by time."""

    t_ns: IntArray
    image: IntArray
    node: IntArray
    """Node whose camera took the image."""
    first_byte: IntArray
    byte_count: IntArray
    """The fragment is bytes [first_byte, first_byte + byte_count) of its image."""

    def __len__(self) -> int:
        return len(self.t_ns)


@dataclass(frozen=True, slots=True)
class Spent:
    """Bytes, losses and energy of a run until given moments: arrays of one shape, or single numbers."""

    sent_bytes: IntArray
    """Bytes of all frames that had begun, including headers and retries, excluding replies and the uplink."""
    lost: IntArray
    """Failed attempts to send a packet, including those on the uplink."""
    radio_j: FloatArray
    """Energy of the radios of all camera nodes."""
    platform_j: FloatArray
    """Energy of the computers and cameras of all camera nodes."""


def arrivals(trace: NetworkTrace, at: Place = "sink") -> Arrivals:
    """Find the first arrival of each image fragment at the sink, or at the cloud behind it.

    Raises:
        InputError: the run kept no log of its packets, or has no such node.

    >>> import packetmesh as pm
    >>> config = pm.with_settings(pm.NETWORK_PRESETS["thesis-link"], ["nodes.image_bytes=2000"])
    >>> came = pm.arrivals(pm.simulate(config))
    >>> len(came), int(came.byte_count.sum())
    (54, 6000)
    """
    log = _log(trace)
    if at not in trace.names:
        places = " or ".join(name for name in trace.names if name in ("sink", "cloud"))
        raise InputError(f"This run has no {at}; try {places or 'a collection, not a street grid'}")
    came = log.of(EventKind.DELIVER)
    came = came.where((came.peer == trace.names.index(at)) & (came.packet_kind == PacketKind.IMAGE))
    fragment = (came.image.astype(np.int64) << 32) | came.first_byte
    first = np.sort(np.unique(fragment, return_index=True)[1])
    taken = log.of(EventKind.CAPTURE)
    camera = np.zeros(int(taken.image.max(initial=-1)) + 1, np.int64)
    camera[taken.image] = taken.node
    image = came.image[first].astype(np.int64)
    return Arrivals(
        t_ns=came.t_ns[first],
        image=image,
        node=camera[image],
        first_byte=came.first_byte[first].astype(np.int64),
        byte_count=came.size_bytes[first].astype(np.int64) - trace.config.nodes.header_bytes,
    )


def energy_by_node_j(trace: NetworkTrace, t_ns: ArrayLike) -> FloatArray:
    """Return (M, N) joules of each node, radio and platform, from the run's start until each of M moments.

    Sinks, access points and the cloud have mains power; their values are 0.

    Raises:
        InputError: the run kept no log of its packets.
    """
    log, moments = _log(trace), np.clip(np.asarray(t_ns, np.int64), 0, trace.horizon_ns)
    spent_j = np.zeros((len(moments), len(trace.names)))
    for node in np.flatnonzero(camera_nodes(trace)):
        alone = np.arange(len(trace.names)) == node
        times = _radio_times(trace, log, moments, alone)
        spent_j[:, node] = energy.joules(times, trace.config.energy).total_j
    return spent_j


def until(trace: NetworkTrace, t_ns: ArrayLike) -> Spent:
    """Compute bytes, losses and energy from the run's start, warm-up included, until each given moment.

    All moments together take one pass over the log: pass them in one call.

    Args:
        trace: trace of a run that kept its log.
        t_ns: moments, of any shape; moments after the end of the run count as its end.

    Raises:
        InputError: the run kept no log of its packets.
    """
    log, moments = _log(trace), np.clip(np.ravel(np.asarray(t_ns, np.int64)), 0, trace.horizon_ns)
    frames, lost = log.of(EventKind.AIR), log.of(EventKind.LOSS)
    sent_bytes = np.append(0, np.cumsum(frames.size_bytes, dtype=np.int64))
    times = _radio_times(trace, log, moments, camera_nodes(trace))
    spent = energy.joules(times, trace.config.energy)
    shape = np.shape(t_ns)
    return Spent(
        sent_bytes=sent_bytes[np.searchsorted(frames.t_ns, moments, side="right")].reshape(shape)[()],
        lost=np.searchsorted(lost.t_ns, moments, side="right").reshape(shape)[()],
        radio_j=spent.radio_j.reshape(shape)[()],
        platform_j=(spent.platform_j + spent.platform_sleep_j).reshape(shape)[()],
    )


def _log(trace: NetworkTrace) -> Events:
    if trace.config.run.keep != "all":
        raise InputError(f"The run kept no log of its packets (run.keep={trace.config.run.keep}); try all")
    return trace.events


def _radio_times(
    trace: NetworkTrace, log: Events, moments: IntArray, camera: NDArray[np.bool_]
) -> energy.RadioTimes:
    """Sum the time of the nodes ``camera`` (N,) in each state until each moment. Where states overlap,
    sending has priority over sleeping, and both over receiving, as in ``network_sim.trace.states``.
    """
    on_air = log.of(EventKind.AIR, EventKind.ACK)
    spans = {
        State.SENDING: np.column_stack((on_air.node, on_air.t_ns, on_air.t_ns + on_air.duration_ns)),
        State.ASLEEP: _asleep(log.of(EventKind.DOWN, EventKind.UP), trace.horizon_ns),
        State.RECEIVING: np.column_stack((on_air.peer, on_air.t_ns, on_air.t_ns + on_air.duration_ns)),
    }
    together, before_ns = np.zeros((0, 3), np.int64), np.zeros(len(moments), np.int64)
    states_ns = np.zeros((len(moments), len(State)), np.int64)
    for state, of_state in spans.items():
        of_state = of_state[(of_state[:, 0] >= 0) & camera[of_state[:, 0]]]
        together = disjoint(np.concatenate((together, of_state)))
        until_ns = _passed_ns(together, moments)
        states_ns[:, state], before_ns = until_ns - before_ns, until_ns
    return energy.radio_times(states_ns, int(camera.sum()) * moments / NS_PER_S)


def _asleep(changes: Events, horizon_ns: int) -> IntArray:
    """Return (I, 3) node, start and end of each span in which a node was down."""
    down_since_ns: dict[int, int] = {}
    spans = []
    rows = (changes.node, changes.t_ns, changes.kind)
    for node, t_ns, kind in zip(*(column.tolist() for column in rows), strict=True):
        if kind == EventKind.DOWN:
            down_since_ns.setdefault(node, t_ns)
        elif node in down_since_ns:
            spans.append((node, down_since_ns.pop(node), t_ns))
    spans += [(node, since_ns, horizon_ns) for node, since_ns in down_since_ns.items()]
    return np.array(spans, np.int64).reshape(-1, 3)


def _passed_ns(spans: IntArray, moments: IntArray) -> IntArray:
    """Sum the parts of all spans (I, 3) before each moment t (K,): sum of t - start, less sum of t - end.

    Either sum may exceed 2^63 and wrap around; their difference is still correct.
    """
    passed_ns = np.zeros(len(moments), np.int64)
    for sign, column in ((1, spans[:, 1]), (-1, spans[:, 2])):
        ordered = np.sort(column)
        count = np.searchsorted(ordered, moments)
        passed_ns += sign * (count * moments - np.append(0, np.cumsum(ordered))[count])
    return passed_ns
