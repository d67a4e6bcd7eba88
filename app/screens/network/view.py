"""A run as the Network screen shows it: columns of numbers, only as many as are drawn."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.drawing.levels import Levels
from network_sim.config import NetworkConfig
from network_sim.metrics.coverage import RoadCoverage
from network_sim.metrics.metrics import Metric
from pipeline.types import FloatArray


class What(IntEnum):
    """The event of a timeline's piece. Those from ``LOSS`` on are instants."""

    WAIT = 0
    """A packet waited in the node's buffer for its first frame."""
    DOWN = 1
    """The node had failed or slept."""
    AIR = 2
    """A frame was on the air."""
    ACK = 3
    """An acknowledgement, or a request or clearance to send."""
    CAPTURE = 4
    """The camera took an image."""
    ARRIVE = 5
    """An image of the node was complete at its destination."""
    LOSS = 6
    """An attempt failed."""
    DROP = 7
    """A packet was given up."""
    EXPIRE = 8
    """An image was given up or thrown away."""


FAILURES = (What.LOSS, What.DROP, What.EXPIRE)


@dataclass(frozen=True, slots=True)
class Pieces:
    """Columns (P,) of the pieces of a timeline, by their start."""

    start_ns: NDArray[np.int64]
    end_ns: NDArray[np.int64]
    """Equal to the start for instants."""
    packet: NDArray[np.int32]
    image: NDArray[np.int32]
    first_byte: NDArray[np.int32]
    size_bytes: NDArray[np.int32]
    node: NDArray[np.int16]
    peer: NDArray[np.int16]
    """The other end of a frame; -1 without one."""
    what: NDArray[np.int8]
    """``What``."""
    cause: NDArray[np.int8]
    """``Cause`` of a failure; for a frame, why its receiver did not get it."""
    carries: NDArray[np.int8]
    """``PacketKind``."""

    def __len__(self) -> int:
        return len(self.start_ns)

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Pieces:
        """Return the pieces selected by a mask (P,) or an array of indices."""
        return Pieces(*(getattr(self, field.name)[chosen] for field in fields(self)))


Curve = Literal["delivery", "delay", "throughput", "energy"]


@dataclass(frozen=True, slots=True)
class Series:
    """One quantity over the simulated time."""

    t_s: FloatArray
    """(T,) middles of the intervals, or their ends for cumulative quantities."""
    values: FloatArray
    """(T,) values, NaN where there is none."""


@dataclass(frozen=True, slots=True)
class NetworkView:
    """A simulated run."""

    config: NetworkConfig
    names: tuple[str, ...]
    """Names of the N nodes, access points, sink and cloud."""
    roles: tuple[str, ...]
    track_s: FloatArray
    """(K,) times of ``tracks_m``; a single one if nothing moves."""
    tracks_m: NDArray[np.float32]
    """(K, N, 2) metres east and north."""
    start_ns: int
    """End of the warm-up, at which the timeline starts."""
    end_ns: int
    pieces: Pieces
    lane_nodes: tuple[int, ...]
    """Nodes that have a row on the timeline: cameras, and all other senders."""
    levels: Levels
    """Frames for the rows of the timeline; an index counts the ``What.AIR`` pieces in their order."""
    kept_until_ns: int
    """End of the stored pieces if the run had more than are kept; otherwise ``end_ns``."""
    series: dict[Curve, Series]
    metrics: dict[str, Metric]
    """Metrics of the whole run by name."""
    elapsed_s: float
    """Time of the simulation on this machine."""
    packets: int
    """Number of packets created."""
    roads: RoadCoverage | None
    """Coverage of the streets by the images; None without streets."""
    header_bytes: int
    """Header bytes of a frame with image bytes: of the medium access and all layers above."""
    label: str = ""
    """The screen's label for it if two are compared."""

    def positions_m(self, t_ns: int) -> FloatArray:
        """Return (N, 2) positions at ``t_ns``, metres east and north."""
        if len(self.track_s) == 1:
            return self.tracks_m[0].astype(float)
        at = float(np.interp(t_ns / 1e9, self.track_s, np.arange(len(self.track_s))))
        before = min(int(at), len(self.track_s) - 2)
        share = at - before
        return (1.0 - share) * self.tracks_m[before] + share * self.tracks_m[before + 1]
