"""The parts of a simulated run that the Network screen draws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.drawing.levels import Levels, levels_of
from app.screens.network.view import Curve, NetworkView, Pieces, Series, What
from network_sim.config import NetworkConfig
from network_sim.mac import FRAME_HEADER_BYTES
from network_sim.metrics.coverage import piece_coverage, road_coverage
from network_sim.metrics.energy import cumulative_radio_j
from network_sim.metrics.metrics import camera_nodes, metrics
from network_sim.street.street import street_of
from network_sim.trace.frames import fates
from network_sim.trace.log import Events, NetworkTrace
from network_sim.types import NS_PER_S, EventKind, PacketKind, to_ns
from pipeline.types import FloatArray

MOST_PIECES = 500_000
"""Most pieces of a timeline; later ones are left out, and the screen shows a note."""
INTERVALS = 60
"""Number of intervals of each curve."""
TRACK_S = 1.0
"""Time between two stored places of a vehicle; it drives straight between crossings."""
INSTANTS = {
    EventKind.CAPTURE: What.CAPTURE,
    EventKind.ARRIVE: What.ARRIVE,
    EventKind.LOSS: What.LOSS,
    EventKind.DROP: What.DROP,
    EventKind.EXPIRE: What.EXPIRE,
}


def run_view(trace: NetworkTrace, elapsed_s: float) -> NetworkView:
    """Return the view of a run; ``elapsed_s`` is the time of its simulation."""
    start_ns = min(to_ns(trace.config.run.warmup_s), trace.horizon_ns)
    pieces = pieces_of(trace, start_ns)
    kept_until_ns = trace.horizon_ns
    if len(pieces) > MOST_PIECES:
        kept_until_ns = int(pieces.start_ns[MOST_PIECES])
        pieces = pieces.where(np.arange(MOST_PIECES))
    track_s, tracks_m = _tracks(trace)
    lane_nodes, levels = _levels(trace, pieces)
    return NetworkView(
        config=trace.config,
        names=trace.names,
        roles=trace.roles,
        track_s=track_s,
        tracks_m=tracks_m,
        start_ns=start_ns,
        end_ns=trace.horizon_ns,
        pieces=pieces,
        lane_nodes=lane_nodes,
        levels=levels,
        kept_until_ns=kept_until_ns,
        series=series_of(trace, start_ns),
        metrics=metrics(trace),
        elapsed_s=elapsed_s,
        packets=trace.counters.created,
        roads=road_coverage(trace) or piece_coverage(trace),
        header_bytes=_header_bytes(trace.config),
    )


def _header_bytes(config: NetworkConfig) -> int:
    above = config.nodes.header_bytes if config.scenario == "collection" else 0
    return above + FRAME_HEADER_BYTES.get(config.mac.kind, 0)


# The timeline.


def _levels(trace: NetworkTrace, pieces: Pieces) -> tuple[tuple[int, ...], Levels]:
    """Return the nodes that have a row (senders and cameras), and the frames in these rows."""
    frames = pieces.where(pieces.what == What.AIR)
    sends = np.isin(np.arange(len(trace.names)), frames.node)
    nodes = np.flatnonzero(sends | camera_nodes(trace))
    row = np.searchsorted(nodes, frames.node)
    return tuple(nodes.tolist()), levels_of(frames.start_ns, frames.end_ns, row, frames.cause, len(nodes))


def pieces_of(trace: NetworkTrace, start_ns: int) -> Pieces:
    """Return the pieces that end at ``start_ns`` or later, by their start."""
    events, nodes = trace.events, len(trace.names)
    losses = events.of(EventKind.LOSS)
    frames = events.of(EventKind.AIR)
    parts = [
        _pieces(frames, What.AIR, frames.t_ns + frames.duration_ns, fates(frames, losses)),
        _waits(events, nodes, trace.horizon_ns),
        _downtimes(events, trace.horizon_ns),
    ]
    answers = events.of(EventKind.ACK)
    parts.append(_pieces(answers, What.ACK, answers.t_ns + answers.duration_ns))
    for kind, what in INSTANTS.items():
        some = events.of(kind)
        parts.append(_pieces(some, what, some.t_ns))
    together = Pieces(
        *(np.concatenate(columns) for columns in zip(*(_columns(part) for part in parts), strict=True))
    )
    together = together.where(together.end_ns >= start_ns)
    return together.where(np.argsort(together.start_ns, kind="stable"))


def _columns(pieces: Pieces) -> list[NDArray[np.generic]]:
    return [getattr(pieces, name) for name in Pieces.__slots__]


def _pieces(
    events: Events, what: What, end_ns: NDArray[np.int64], cause: NDArray[np.int8] | None = None
) -> Pieces:
    return Pieces(
        start_ns=events.t_ns,
        end_ns=end_ns,
        packet=events.packet,
        image=events.image,
        first_byte=events.first_byte,
        size_bytes=events.size_bytes,
        node=events.node,
        peer=events.peer,
        what=np.full(len(events), what, np.int8),
        cause=events.cause if cause is None else cause,
        carries=events.packet_kind,
    )


def _waits(events: Events, nodes: int, horizon_ns: int) -> Pieces:
    """Return the waits: from entering a buffer to the packet's first frame there, or to its drop."""
    entered = events.of(EventKind.ENQUEUE)
    ended = events.of(EventKind.AIR, EventKind.DROP)
    keys, first = np.unique(ended.packet.astype(np.int64) * nodes + ended.node, return_index=True)
    end_ns = np.full(len(entered), horizon_ns, np.int64)
    if len(keys):
        entry_keys = entered.packet.astype(np.int64) * nodes + entered.node
        at = np.minimum(np.searchsorted(keys, entry_keys), len(keys) - 1)
        found = keys[at] == entry_keys
        end_ns[found] = ended.t_ns[first[at[found]]]
    waits = _pieces(entered, What.WAIT, end_ns)
    return waits.where(waits.end_ns > waits.start_ns)


def _downtimes(events: Events, horizon_ns: int) -> Pieces:
    changes = events.of(EventKind.DOWN, EventKind.UP)
    end_ns = np.full(len(changes), horizon_ns, np.int64)
    last: dict[int, int] = {}
    for row, (node, kind) in enumerate(zip(changes.node.tolist(), changes.kind.tolist(), strict=True)):
        if kind == EventKind.UP and node in last:
            end_ns[last.pop(node)] = changes.t_ns[row]
        elif kind == EventKind.DOWN:
            last.setdefault(node, row)
    times = _pieces(changes, What.DOWN, end_ns)
    return times.where(changes.kind == EventKind.DOWN)


# The curves.


def series_of(trace: NetworkTrace, start_ns: int) -> dict[Curve, Series]:
    """Return every curve over the time after the warm-up."""
    edges_s = np.linspace(start_ns, trace.horizon_ns, INTERVALS + 1) / NS_PER_S
    middles_s = (edges_s[:-1] + edges_s[1:]) / 2.0
    images = trace.events.where(trace.events.packet_kind == PacketKind.IMAGE)
    received, dropped = images.of(EventKind.RECEIVE), images.of(EventKind.DROP)
    got, lost = _binned(received, edges_s), _binned(dropped, edges_s)
    bits = _binned(received, edges_s, 8.0 * received.size_bytes)
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "delivery": Series(middles_s, 100.0 * got / (got + lost)),
            "delay": Series(middles_s, _delays_s(trace.events, edges_s)),
            "throughput": Series(middles_s, bits / np.diff(edges_s) / 1000.0),
            "energy": _radio_j(trace),
        }


def _binned(events: Events, edges_s: FloatArray, weights: FloatArray | None = None) -> FloatArray:
    return np.histogram(events.t_ns / NS_PER_S, edges_s, weights=weights)[0].astype(float)


def _delays_s(events: Events, edges_s: FloatArray) -> FloatArray:
    """Return the mean delay of the images completed in each interval; NaN without any."""
    taken, arrived = events.of(EventKind.CAPTURE), events.of(EventKind.ARRIVE)
    if not len(arrived):
        return np.full(len(edges_s) - 1, np.nan)
    taken_ns = np.zeros(int(max(taken.image.max(), arrived.image.max())) + 1, np.int64)
    taken_ns[taken.image] = taken.t_ns
    delay_s = (arrived.t_ns - taken_ns[arrived.image]) / NS_PER_S
    return _binned(arrived, edges_s, delay_s) / _binned(arrived, edges_s)


def _radio_j(trace: NetworkTrace) -> Series:
    """Return the energy of the camera nodes' radios since the end of the warm-up."""
    counters = trace.counters
    edges_s = counters.edges_ns[counters.warmup_minutes :] / NS_PER_S
    return Series(edges_s, cumulative_radio_j(counters, camera_nodes(trace), trace.config.energy))


# The places.


def _tracks(trace: NetworkTrace) -> tuple[FloatArray, NDArray[np.float32]]:
    """Return times (K,) and positions (K, N, 2) in metres; one of each if nothing moves."""
    if trace.positions_m is not None:
        return np.zeros(1), trace.positions_m[None].astype(np.float32)
    config = trace.config
    places = street_of(config)
    track_s = np.arange(config.run.warmup_s, trace.horizon_ns / NS_PER_S + TRACK_S, TRACK_S)
    track_s = np.minimum(track_s, trace.horizon_ns / NS_PER_S)
    tracks_m = np.array(
        [[places.position_m(node, to_ns(t_s)) for node in range(places.count)] for t_s in track_s.tolist()],
        np.float32,
    )
    return track_s, tracks_m
