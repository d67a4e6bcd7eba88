"""WORTH: the collector requests only those pieces of an image that add coverage, most gain per byte first.

This joins two halves of the thesis, its collection scheme GREEDY and images that are sent in pieces; it is
ours, and not of Bruno & Nurchis (SPEC 6.2). Gain, coverage and the least gain of T_v / 2 are GREEDY's, of
pieces of road in place of whole cells. With one piece to an image it is GREEDY.
"""

from __future__ import annotations

from collections import defaultdict
from heapq import heapify, heappop, heappush
from itertools import groupby
from typing import NamedTuple

import numpy as np

from network_sim.config import SchemeConfig
from network_sim.street.pieces import Cuts, Part
from network_sim.street.schemes.greedy import Coverage
from network_sim.street.schemes.scheme import Scheme
from network_sim.types import to_ns


class Offer(NamedTuple):
    """The consecutive pieces of an image that are worth most."""

    per_byte: float
    """Gain in ns per byte of request and answer."""
    first: int
    """First of the pieces."""
    stop: int
    """The piece after the last one."""


def best_run(gains_ns: list[int], least_ns: float, cuts: Cuts) -> Offer | None:
    """Return the consecutive pieces of an image with the most gain per byte; None if no piece is worth it.

    Only runs that end at the image's border or at a piece that adds less than ``least_ns`` are compared: a
    request names the first and the last piece, and none between them is covered.

    Args:
        gains_ns: (P,) what each piece adds.
        least_ns: least gain of a piece.
        cuts: costs of pieces.
    """
    best: Offer | None = None
    for adds, run in groupby(range(len(gains_ns)), key=lambda piece: gains_ns[piece] >= least_ns):
        if adds:
            pieces = list(run)
            first, stop = pieces[0], pieces[-1] + 1
            per_byte = sum(gains_ns[first:stop]) / cuts.costs_bytes[first][stop]
            if best is None or per_byte > best.per_byte:
                best = Offer(per_byte, first, stop)
    return best


def select_pieces(
    coverage: Coverage, pieces: list[list[int]], captured_ns: list[int], k: int | None, cuts: Cuts
) -> list[Part]:
    """Choose parts of the images by gain per byte, and count them as covered.

    After each choice, the images that share a piece of road with it are judged again, so the choice is what
    judging all of them again would give.

    Args:
        coverage: Coverage so far; the chosen pieces are added to it.
        pieces: (T, P) pieces of road that each offered image shows; those below 0 show none.
        captured_ns: (T,) capture times of the offered images.
        k: Most images of which parts are chosen; None sets no limit.
        cuts: costs of pieces.

    Returns:
        Parts by falling gain per byte, at most one of each image; of equal ones the first offered comes
        first. Each piece adds at least half of the validity.
    """
    least_ns = coverage.validity_ns / 2
    showing: defaultdict[int, list[tuple[int, int]]] = defaultdict(list)
    gains_ns: list[list[int]] = []
    offers: dict[int, Offer] = {}
    for index, (row, taken_ns) in enumerate(zip(pieces, captured_ns, strict=True)):
        gains_ns.append([coverage.gain_ns(piece, taken_ns) if piece >= 0 else 0 for piece in row])
        if offer := best_run(gains_ns[-1], least_ns, cuts):
            offers[index] = offer
            for place, piece in enumerate(row):
                showing[piece].append((index, place))
    heap = [(-offer.per_byte, index) for index, offer in offers.items()]
    heapify(heap)
    chosen: list[Part] = []
    while heap and (k is None or len(chosen) < k):
        bound, index = heappop(heap)
        if index not in offers or offers[index].per_byte != -bound:
            continue  # judged again since, or chosen
        _, first, stop = offers.pop(index)
        shows = tuple(pieces[index][first:stop])
        chosen.append(Part(index, shows, first, stop))
        changed = set()
        for piece in shows:
            coverage.add(piece, captured_ns[index])
            for other, place in showing[piece]:
                if other in offers:
                    gains_ns[other][place] = coverage.gain_ns(piece, captured_ns[other])
                    changed.add(other)
        for other in changed:
            offer = best_run(gains_ns[other], least_ns, cuts)
            if offer is None:
                del offers[other]
            elif offer != offers[other]:
                offers[other] = offer
                heappush(heap, (-offer.per_byte, other))
    return chosen


class Worth(Scheme):
    """The scheme WORTH, which counts requested pieces as covered until they are reported missing."""

    by_pieces = True

    def __init__(self, config: SchemeConfig) -> None:
        """Start with nothing covered."""
        self.coverage = Coverage(to_ns(config.validity_s))
        self.k = config.k
        self._cuts = Cuts(config)

    def parts(self, shown: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[Part]:
        """Return the parts to request, most gain per byte first, of images that show pieces (T, P)."""
        return select_pieces(self.coverage, shown.tolist(), captured_ns.tolist(), self.k, self._cuts)

    def missed(self, cell: int, captured_ns: int) -> None:
        """Remove a requested piece that did not arrive from the coverage."""
        self.coverage.remove(cell, captured_ns)
