"""Interface of codings: from a node's images to bytes, and from the received bytes to images."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.types import BoolArray, ByteArray

DepthArray = NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class Images:
    """Colour and depth images that a node sends, as its camera delivers them."""

    rgb: ByteArray
    """(H, W, 3)."""
    depth: DepthArray
    """(H, W) in integer units of the camera, usually millimetres; 0 where nothing was measured."""


@dataclass(frozen=True, slots=True)
class Received:
    """Images decoded from the received bytes; pixels whose bytes are missing stay unknown."""

    rgb: ByteArray
    """(H, W, 3), zero where the colour is unknown."""
    rgb_known: BoolArray
    """(H, W) True where the colour is known, finely or coarsely."""
    depth: DepthArray
    """(H, W) as ``Images.depth``, 0 where it is unknown or was not measured."""
    coarse: DepthArray
    """(H, W) approximate depth from a base layer; 0 where the depth itself arrived. It is no measurement."""

    @staticmethod
    def nothing(shape: tuple[int, int]) -> Received:
        """Return an image of (H, W) pixels with nothing known; decoders fill its arrays."""
        return Received(
            rgb=np.zeros((*shape, 3), np.uint8),
            rgb_known=np.zeros(shape, np.bool_),
            depth=np.zeros(shape, np.uint16),
            coarse=np.zeros(shape, np.uint16),
        )


class Coding(Protocol):
    """Encoder and decoder of a node's images."""

    @property
    def name(self) -> str:
        """Name, as in ``--coding``."""
        ...

    @property
    def title(self) -> str:
        """Title of a few words for users."""
        ...

    def encode(self, images: Images, packet_bytes: int) -> bytes:
        """Return the bytes of a frame in the order of sending.

        Args:
            images: colour and depth of one instant.
            packet_bytes: bytes per packet; packet ``i`` carries those from ``i * packet_bytes``.
        """
        ...

    def decode(
        self, data: ByteArray, arrived: BoolArray, shape: tuple[int, int], packet_bytes: int
    ) -> Received:
        """Decode as many pixels as possible of a frame of which some packets are missing.

        Args:
            data: (S,) all bytes of the frame, zero where they have not arrived.
            arrived: (S,) True for bytes that have arrived.
            shape: (H, W) of both images.
            packet_bytes: as in ``encode``.

        Returns:
            The received images; equal to those sent if the coding is lossless and everything arrived.
        """
        ...


def areas_of(shape: tuple[int, ...], side_px: int) -> list[tuple[slice, slice]]:
    """Return the areas of tiles, row after row; those at the right and lower edge may be smaller."""
    return [
        (slice(top, min(top + side_px, shape[0])), slice(left, min(left + side_px, shape[1])))
        for top in range(0, shape[0], side_px)
        for left in range(0, shape[1], side_px)
    ]
