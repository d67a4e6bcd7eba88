"""Images as the network sees them: their size, their fragments, and what has arrived of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from network_sim.types import Cause, EventKind, Packet, PacketKind
from packetmesh.errors import InputError

if TYPE_CHECKING:
    import simpy

    from network_sim.trace import Recorder

ImageFormat = Literal["ppm", "pgm", "jpeg", "png"]


def ppm_bytes(width_px: int, height_px: int) -> int:
    """Size of a binary PPM file (P6) with 8 bits a channel."""
    return len(f"P6\n{width_px} {height_px}\n255\n") + 3 * width_px * height_px


def pgm_bytes(width_px: int, height_px: int) -> int:
    """Size of a binary PGM file (P5) with 16 bits, such as a depth image in millimetres."""
    return len(f"P5\n{width_px} {height_px}\n65535\n") + 2 * width_px * height_px


def encoded_bytes(image: np.ndarray, file_format: ImageFormat, quality: int = 90) -> int:
    """Size of this very image as a file.

    Args:
        image: (H, W, 3) uint8 colour, or (H, W) uint16 depth, which only pgm and png can hold.
        file_format: JPEG and PNG are really encoded.
        quality: Of JPEG, 1 to 100.

    Raises:
        InputError: the format cannot hold such an image.
    """
    depth = image.ndim == 2 and image.dtype == np.uint16
    color = image.ndim == 3 and image.shape[2] == 3 and image.dtype == np.uint8
    possible = ("pgm", "png") if depth else ("ppm", "jpeg", "png") if color else ()
    if file_format not in possible:
        raise InputError(
            f"An image of shape {image.shape} and type {image.dtype} is no {file_format}; "
            "try (H, W, 3) uint8 as ppm, jpeg or png, or (H, W) uint16 as pgm or png"
        )
    height_px, width_px = image.shape[:2]
    if file_format == "ppm":
        return ppm_bytes(width_px, height_px)
    if file_format == "pgm":
        return pgm_bytes(width_px, height_px)
    import cv2

    options = [cv2.IMWRITE_JPEG_QUALITY, quality] if file_format == "jpeg" else []
    return len(cv2.imencode(f".{file_format}", image, options)[1])


class Fragments:
    """Which fragments of an image one place has."""

    __slots__ = ("lacking", "present")

    def __init__(self, count: int) -> None:
        """None of ``count`` yet."""
        self.present = bytearray(count)
        self.lacking = count

    def add(self, index: int) -> bool:
        """Take a fragment; whether it is new."""
        if self.present[index]:
            return False
        self.present[index] = 1
        self.lacking -= 1
        return True

    def missing(self) -> list[int]:
        """What is lacking, in order."""
        return [index for index, present in enumerate(self.present) if not present]


@dataclass(slots=True)
class Image:
    """One image, or colour and depth of one instant, on its way."""

    id: int
    node: int
    captured_ns: int
    size_bytes: int
    data_bytes: int
    """Most bytes of it in a packet."""
    at_sink: Fragments = field(init=False)
    at_cloud: Fragments = field(init=False)
    packets: int = 0
    """How many of its packets are waiting or on their way."""
    sent_once: bool = False
    """Its camera sends no more of it: when its packets have ended, so has it."""
    lost_for: Cause = Cause.NONE
    """Why the last lost packet of it was lost."""
    closed: bool = False
    """It has arrived or was given up."""
    heard_ns: int = 0
    """When the sink last got something new of it, or asked for it."""

    def __post_init__(self) -> None:
        self.at_sink, self.at_cloud = Fragments(self.count), Fragments(self.count)

    @property
    def count(self) -> int:
        """How many fragments it has."""
        return -(-self.size_bytes // self.data_bytes)

    def index_of(self, packet: Packet) -> int:
        """Which fragment a packet carries."""
        return packet.first_byte // self.data_bytes


class Book:
    """Numbers images and packets, records what becomes of them, and knows when nothing is left to happen."""

    def __init__(
        self, env: simpy.Environment, recorder: Recorder, data_bytes: int, header_bytes: int
    ) -> None:
        """``data_bytes`` of an image fit into a packet, beside ``header_bytes``."""
        self.env = env
        self.images: list[Image] = []
        self.cameras = 0
        """Cameras that will take further images."""
        self.ended = env.event()
        """Every image has arrived or was given up, and no packet is left."""
        self._recorder = recorder
        self._data_bytes = data_bytes
        self._header_bytes = header_bytes
        self._open = 0
        self._under_way = 0
        self._packets = 0

    def capture(self, node: int, size_bytes: int) -> Image:
        """A camera took an image."""
        image = Image(len(self.images), node, int(self.env.now), size_bytes, self._data_bytes)
        self.images.append(image)
        self._open += 1
        self._recorder.add(image.captured_ns, EventKind.CAPTURE, node, image=image.id, size_bytes=size_bytes)
        return image

    def close(self, image: Image, at: int, cause: Cause = Cause.NONE) -> None:
        """The image is complete at the node ``at``, or given up for ``cause``; the first word counts."""
        if image.closed:
            return
        image.closed = True
        self._open -= 1
        kind = EventKind.EXPIRE if cause else EventKind.ARRIVE
        self._recorder.add(
            int(self.env.now), kind, image.node, at, image=image.id, size_bytes=image.size_bytes, cause=cause
        )
        self.look_for_end()

    def fragment(self, image: Image, index: int, source: int, destination: int) -> Packet:
        """A packet with a fragment of an image."""
        first_byte = index * image.data_bytes
        count = min(image.data_bytes, image.size_bytes - first_byte)
        image.packets += 1
        return self._packet(PacketKind.IMAGE, source, destination, count, image.id, first_byte)

    def message(self, source: int, destination: int, data_bytes: int, image: int) -> Packet:
        """A packet that says what the sink lacks of an image."""
        return self._packet(PacketKind.STATUS, source, destination, data_bytes, image, 0)

    def _packet(
        self, kind: PacketKind, source: int, destination: int, count: int, image: int, first_byte: int
    ) -> Packet:
        self._under_way += 1
        self._packets += 1
        return Packet(
            self._packets - 1,
            kind,
            source,
            destination,
            self._header_bytes + count,
            int(self.env.now),
            image,
            first_byte,
            count,
        )

    def entered(self, packet: Packet, node: int) -> None:
        """A packet came to a node's buffer."""
        self._record(EventKind.ENQUEUE, packet, node, -1)

    def dropped(self, packet: Packet, node: int, cause: Cause) -> None:
        """A node gave a packet up."""
        self._record(EventKind.DROP, packet, node, -1, cause)
        self.gone(packet, cause)

    def received(self, packet: Packet, at: int) -> None:
        """A packet has reached its last node."""
        self._record(EventKind.RECEIVE, packet, packet.source, at)
        self.gone(packet, Cause.NONE)

    def gone(self, packet: Packet, cause: Cause) -> None:
        """A packet has ended, and whoever ended it has said so."""
        self._under_way -= 1
        if packet.kind is PacketKind.IMAGE:
            image = self.images[packet.image]
            image.packets -= 1
            if cause:
                image.lost_for = cause
            self.look_for_loss(image)
        self.look_for_end()

    def look_for_loss(self, image: Image) -> None:
        """Give an image up if the rest of it cannot come any more."""
        if image.sent_once and not image.packets and not image.closed:
            self.close(image, -1, image.lost_for)

    def look_for_end(self) -> None:
        """Say so if nothing is left to happen."""
        if not (self._under_way or self._open or self.cameras or self.ended.triggered):
            self.ended.succeed()

    def _record(
        self, kind: EventKind, packet: Packet, node: int, peer: int, cause: Cause = Cause.NONE
    ) -> None:
        self._recorder.add_packet(int(self.env.now), kind, packet, node, peer, packet.size_bytes, cause)
