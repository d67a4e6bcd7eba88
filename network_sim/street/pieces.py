"""Pieces of an image, and the bytes of a request for some of them and of the answer (ours, SPEC 6.2).

An image shows ``scheme.cell_m`` of road ahead of its vehicle, the nearest first. Its pieces are as many bytes
each, and each shows as much road. Consecutive pieces are one range of bytes of the image.
"""

from __future__ import annotations

from typing import NamedTuple

from network_sim.config import SchemeConfig
from network_sim.settings.street import RANGE_BYTES


class Part(NamedTuple):
    """The part of an offered image that a scheme asks for."""

    row: int
    """Position of the image in the summary."""
    shows: tuple[int, ...]
    """Cells, or pieces of road, that count as covered by it."""
    first: int = 0
    """First of its pieces."""
    stop: int | None = None
    """Piece after its last one; None is the whole image."""


class Cuts:
    """Edges of the pieces of images, and the bytes of some consecutive pieces."""

    def __init__(self, config: SchemeConfig) -> None:
        """Compute the edges of the pieces."""
        self._config = config
        self.pieces = config.pieces
        self.edges = [config.image_bytes * piece // config.pieces for piece in range(config.pieces + 1)]
        """First byte of each piece, and the image's size."""
        ends = range(config.pieces + 1)
        self.costs_bytes = [[self._cost_bytes(first, stop) for stop in ends] for first in ends]
        """Costs of pieces [first, stop): the request's bytes, and the datagrams with all their headers."""

    def header_bytes(self, first: int, stop: int) -> int:
        """Return the bytes that pieces [first, stop) add to each datagram: 0 for a whole image."""
        return 0 if stop - first == self.pieces else self._config.piece_header_bytes

    def datagrams(self, first: int, stop: int) -> list[tuple[int, int]]:
        """Return the first byte and the image's bytes of each datagram with pieces [first, stop)."""
        most = self._config.datagram_bytes - self.header_bytes(first, stop)
        start, end = self.edges[first], self.edges[stop]
        return [(byte, min(most, end - byte)) for byte in range(start, end, most)]

    def _cost_bytes(self, first: int, stop: int) -> int:
        header_bytes = self._config.headers_bytes + self.header_bytes(first, stop)
        answer_bytes = self.edges[stop] - self.edges[first] + header_bytes * len(self.datagrams(first, stop))
        return self._config.id_bytes + RANGE_BYTES + answer_bytes
