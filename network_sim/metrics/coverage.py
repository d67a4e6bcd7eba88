"""Road coverage: which road cells cameras saw in each time span, and which of these sights arrived.

A sight is a pair of a road cell (SPEC 6.2) and a time span of ``scheme.validity_s``. Sights of pieces of road
are finer: an image shows several, and parts of an image cover only theirs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from network_sim.street.mobility import pieces_of_block, routes_of
from network_sim.street.pieces import Cuts
from network_sim.street.snapshots import shown_pieces
from network_sim.trace.log import Events, NetworkTrace
from network_sim.types import EventKind, to_ns

NEVER_NS = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True)
class RoadCoverage:
    """The sights of a run after its warm-up, one per row."""

    cell: NDArray[np.int64]
    """(S,) cell of each sight, also of one of a piece of road."""
    seen_ns: NDArray[np.int64]
    """(S,) time of the first image of each sight."""
    covered_ns: NDArray[np.int64]
    """(S,) time of the first arrival of an image of it; ``NEVER_NS`` if none arrived."""
    arrived: int
    """Number of images, or of pieces of images, that arrived."""

    def counts(self, t_ns: int, cells: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Count the sights of each cell until ``t_ns``: (cells,) all, and (cells,) with an arrived image."""
        seen, covered = self.seen_ns <= t_ns, self.covered_ns <= t_ns
        return np.bincount(self.cell[seen], minlength=cells), np.bincount(self.cell[covered], minlength=cells)


def road_coverage(trace: NetworkTrace) -> RoadCoverage | None:
    """Find the sights of cells; None if no image of a road was taken, or image events were not kept.

    An image covers its whole cell here, so a run whose images arrive in pieces has none.
    """
    taken = _taken(trace)
    if not len(taken) or trace.config.scheme.name == "worth":
        return None
    arrival_ns = _arrivals_ns(trace, taken)[taken.image]
    return _sights(trace, taken.peer.astype(np.int64), taken.t_ns, arrival_ns, 1)


def piece_coverage(trace: NetworkTrace) -> RoadCoverage | None:
    """Find the sights of pieces of road, ``scheme.pieces`` to a cell; None as for cells, for any scheme.

    An image shows as many pieces, ahead of its vehicle (``network_sim.street.snapshots.shown_pieces``).
    """
    taken = _taken(trace)
    if not len(taken):
        return None
    scheme, routes = trace.config.scheme, routes_of(trace.config)
    pieces = np.empty((len(taken), scheme.pieces), np.int64)
    for vehicle in np.unique(taken.node):
        mine = taken.node == vehicle
        pieces[mine] = shown_pieces(routes, scheme, int(vehicle), taken.t_ns[mine])
    arrival_ns = _arrivals_ns(trace, taken)
    came, edges = trace.events.of(EventKind.ARRIVE), np.array(Cuts(scheme).edges)
    first, end = np.zeros((2, len(arrival_ns)), np.int64)
    first[came.image], end[came.image] = came.first_byte, came.first_byte + came.size_bytes
    first, end = first[taken.image, None], end[taken.image, None]
    here = (first <= edges[:-1]) & (edges[1:] <= end)
    arrival_ns = np.where(here, arrival_ns[taken.image, None], NEVER_NS)
    shown = pieces >= 0
    taken_ns = np.broadcast_to(taken.t_ns[:, None], pieces.shape)
    return _sights(trace, pieces[shown], taken_ns[shown], arrival_ns[shown], scheme.pieces)


def _taken(trace: NetworkTrace) -> Events:
    taken = trace.events.of(EventKind.CAPTURE)
    return taken.where((taken.peer >= 0) & (taken.t_ns >= to_ns(trace.config.run.warmup_s)))


def _arrivals_ns(trace: NetworkTrace, taken: Events) -> NDArray[np.int64]:
    """Return the arrival time of every image by its number; ``NEVER_NS`` if it did not arrive."""
    came = trace.events.of(EventKind.ARRIVE)
    arrival_ns = np.full(int(max(taken.image.max(), came.image.max(initial=0))) + 1, NEVER_NS)
    np.minimum.at(arrival_ns, came.image, came.t_ns)
    return arrival_ns


def _sights(
    trace: NetworkTrace,
    place: NDArray[np.int64],
    taken_ns: NDArray[np.int64],
    arrival_ns: NDArray[np.int64],
    pieces: int,
) -> RoadCoverage:
    """Return the sights of (N,) cells, or of their pieces if these are several, at these times."""
    window = taken_ns // to_ns(trace.config.scheme.validity_s)
    windows = int(window.max()) + 1
    sights, sight = np.unique(place * windows + window, return_inverse=True)
    seen_ns, covered_ns = np.full((2, len(sights)), NEVER_NS)
    np.minimum.at(seen_ns, sight, taken_ns)
    np.minimum.at(covered_ns, sight, arrival_ns)
    arrived = int((arrival_ns != NEVER_NS).sum())
    return RoadCoverage(_cells(trace, sights // windows, pieces), seen_ns, covered_ns, arrived)


def _cells(trace: NetworkTrace, place: NDArray[np.int64], pieces: int) -> NDArray[np.int64]:
    """Return the cells of pieces of road."""
    street, cell_m = trace.config.street, trace.config.scheme.cell_m
    a_block, cells_a_block = pieces_of_block(street, cell_m / pieces), pieces_of_block(street, cell_m)
    way, piece = np.divmod(place, a_block)
    return way * cells_a_block + np.minimum(piece // pieces, cells_a_block - 1)
