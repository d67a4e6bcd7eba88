"""Config of vehicles with cameras: the schemes that choose images, and the streets (SPEC 6.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from packetmesh.checks import above, at_least
from packetmesh.errors import InputError

SchemeName = Literal["baseline", "greedy", "pdc", "pdc-received", "worth"]

RANGE_BYTES = 2
"""Bytes of a request that name an image's first and last piece."""
MOST_PIECES = 64


@dataclass(frozen=True, slots=True)
class SchemeConfig:
    """Which images of passing vehicles are collected (SPEC 6.2, Table 4.7)."""

    name: SchemeName = "baseline"
    """Upload everything (baseline), ask for the images that add coverage (greedy), ask only for the pieces
    of images that add coverage (worth), or ask for each image with a probability that falls with how many are
    offered (pdc) or received (pdc-received)."""
    k: int | None = None
    """Most images that a request of greedy or worth asks for; None does not limit it."""
    pieces: int = 5
    """Equal pieces of an image, each of which shows as many parts of scheme.cell_m of road ahead; worth asks
    for some of them. The coverage of pieces is measured for all schemes."""
    piece_header_bytes: int = 40
    """Bytes that an image adds to each of its datagrams when only some of its pieces are sent."""
    r_low: float = 3.0
    """Images of a cell in a control period up to which pdc asks for all."""
    r_high: float = 8.0
    """Images of a cell in a control period from which pdc asks only for what covers it once."""
    validity_s: float = 10.0
    """Time for which an image covers its cell (T_v)."""
    observation_s: float = 600.0
    """Time over which pdc counts offered images (T_obs)."""
    control_s: float = 60.0
    """Interval at which pdc sets its probabilities (S)."""
    sample_s: float = 2.0
    """Time between images of a vehicle."""
    buffer_images: int = 200
    """Images that a vehicle keeps; a full buffer drops the oldest."""
    image_bytes: int = 1000
    """Size of an image."""
    tag_bytes: int = 40
    """Size of an image's tag in a summary."""
    id_bytes: int = 8
    """Size of an image's id in a request."""
    datagram_bytes: int = 1472
    """Most bytes of a UDP datagram."""
    cell_m: float = 100.0
    """Length of a cell, a piece of road."""
    directed_cells: bool = True
    """Whether a piece of road is another cell in the other direction; the numbers that SPEC 6.2 gives
    without a radio are those of one cell for both."""
    summary_interval_s: float = 10.0
    """Least time between two summaries to the same access point."""
    headers_bytes: int = 28
    """IP and UDP headers of each datagram."""

    def __post_init__(self) -> None:
        for key in ("validity_s", "observation_s", "control_s", "sample_s", "cell_m", "summary_interval_s"):
            above(f"scheme.{key}", getattr(self, key), 0.0)
        for key in ("k", "pieces", "buffer_images", "image_bytes", "tag_bytes", "id_bytes"):
            at_least(f"scheme.{key}", getattr(self, key), 1)
        for key in ("headers_bytes", "piece_header_bytes"):
            at_least(f"scheme.{key}", getattr(self, key), 0)
        least_bytes = max(self.tag_bytes, self.id_bytes + RANGE_BYTES, self.piece_header_bytes + 1)
        at_least("scheme.datagram_bytes", self.datagram_bytes, least_bytes)
        if self.pieces > min(self.image_bytes, MOST_PIECES):
            raise InputError(
                f"scheme.pieces is {self.pieces}; try at most {MOST_PIECES}, and no "
                "more than an image has bytes"
            )
        at_least("scheme.r_low", self.r_low, 0.0)
        above("scheme.r_high", self.r_high, self.r_low)


@dataclass(frozen=True, slots=True)
class StreetConfig:
    """A square grid of streets with access points at the roadside (SPEC 6.2)."""

    vehicles: int = 60
    """Vehicles with a camera."""
    blocks: int = 5
    """Blocks along each side: one less than there are crossings."""
    block_m: float = 200.0
    """Side of a block."""
    speed_mps: float = 10.0
    """Speed of every vehicle."""
    access_points: int = 4
    """Access points, which are the sinks."""

    def __post_init__(self) -> None:
        for key in ("vehicles", "blocks", "access_points"):
            at_least(f"street.{key}", getattr(self, key), 1)
        above("street.block_m", self.block_m, 0.0)
        above("street.speed_mps", self.speed_mps, 0.0)
        if self.access_points > (self.blocks + 1) ** 2:
            raise InputError(
                f"street.access_points is {self.access_points}, more than there are crossings; "
                f"try at most {(self.blocks + 1) ** 2}"
            )
