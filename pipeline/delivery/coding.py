"""A coding turns a node's images into bytes, and the bytes that arrived into what the sink knows of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.types import BoolArray, ByteArray

DepthArray = NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class Images:
    """What a node sends: its colour and depth images as its camera gives them."""

    rgb: ByteArray
    """(H, W, 3)."""
    depth: DepthArray
    """(H, W) in whole units of the camera, usually millimetres; 0 where it measured nothing."""


@dataclass(frozen=True, slots=True)
class Received:
    """What the bytes that arrived say about a node's images; nothing is guessed."""

    rgb: ByteArray
    """(H, W, 3), zero where nothing is known."""
    rgb_known: BoolArray
    """(H, W) where the colour is known, finely or coarsely."""
    depth: DepthArray
    """(H, W) as ``Images.depth``, 0 where nothing is known or was measured."""
    coarse: DepthArray
    """(H, W) depth known from a base layer only, 0 where the image itself arrived: a guess, not measured."""

    @staticmethod
    def nothing(shape: tuple[int, int]) -> Received:
        """Of images of (H, W) pixels nothing is known; decoders fill its arrays."""
        return Received(
            rgb=np.zeros((*shape, 3), np.uint8),
            rgb_known=np.zeros(shape, np.bool_),
            depth=np.zeros(shape, np.uint16),
            coarse=np.zeros(shape, np.uint16),
        )


class Coding(Protocol):
    """One way to write a node's images as bytes."""

    @property
    def name(self) -> str:
        """As in ``--coding``."""
        ...

    @property
    def title(self) -> str:
        """A few words for people."""
        ...

    def encode(self, images: Images, packet_bytes: int) -> bytes:
        """The bytes of a frame in the order in which they are sent.

        Args:
            images: colour and depth of one instant.
            packet_bytes: how many of them a packet carries; packet ``i`` has those from ``i * packet_bytes``.
        """
        ...

    def decode(
        self, data: ByteArray, arrived: BoolArray, shape: tuple[int, int], packet_bytes: int
    ) -> Received:
        """What can be read of a frame of which some packets are missing.

        Args:
            data: (S,) all of its bytes, zero where they have not arrived.
            arrived: (S,) which of them have.
            shape: (H, W) of both images.
            packet_bytes: as in ``encode``.

        Returns:
            Exactly the images, where a coding is lossless and everything has arrived.
        """
        ...
