"""Images in the network: file sizes, fragments, and a record of all images and packets."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from network_sim.types import Cause, EventKind, Packet, PacketKind
from packetmesh.errors import InputError

if TYPE_CHECKING:
    import simpy

    from network_sim.config import NodesConfig
    from network_sim.trace.log import Recorder

ImageFormat = Literal["ppm", "pgm", "jpeg", "png"]
REQUEST_BYTES = 4
"""Bytes for the image id and the packet's number in each packet of a request."""


def ppm_bytes(width_px: int, height_px: int) -> int:
    """Return the bytes of a binary PPM file (P6) with 8 bits per channel."""
    return len(f"P6\n{width_px} {height_px}\n255\n") + 3 * width_px * height_px


def pgm_bytes(width_px: int, height_px: int) -> int:
    """Return the bytes of a binary PGM file (P5) with 16 bits, such as a depth image in millimetres."""
    return len(f"P5\n{width_px} {height_px}\n65535\n") + 2 * width_px * height_px


def encoded_bytes(image: np.ndarray, file_format: ImageFormat, quality: int = 90) -> int:
    """Return the bytes of an image as a file.

    Args:
        image: (H, W, 3) uint8 colour, or (H, W) uint16 depth, which only pgm and png can store.
        file_format: File format; for JPEG and PNG the image is encoded to find its size.
        quality: JPEG quality, 1 to 100.

    Raises:
        InputError: the format cannot store such an image.
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


def request_packets_bytes(config: NodesConfig, node: int) -> list[int]:
    """Return the data bytes of each packet of the sink's request to a node."""
    room = max(1, config.payload_bytes - config.header_bytes - REQUEST_BYTES)
    whole, rest = divmod(config.request_bytes_by_node[node], room)
    return [REQUEST_BYTES + size for size in [room] * whole + [rest] * bool(rest or not whole)]


class Fragments:
    """The fragments of an image that one node has."""

    __slots__ = ("missing_count", "present")

    def __init__(self, count: int) -> None:
        """Start with none of ``count`` fragments."""
        self.present = bytearray(count)
        self.missing_count = count

    def add(self, index: int) -> bool:
        """Add a fragment; returns whether it is new."""
        if self.present[index]:
            return False
        self.present[index] = 1
        self.missing_count -= 1
        return True

    def missing(self, of_first: int | None = None) -> list[int]:
        """Return the indices of the missing fragments, or of those among the first, in rising order."""
        return [index for index, present in enumerate(self.present[:of_first]) if not present]


@dataclass(slots=True)
class Image:
    """An image that is sent; colour and depth of one instant are one image."""

    id: int
    node: int
    captured_ns: int
    size_bytes: int
    data_bytes: int
    """Most bytes of the image in one packet."""
    first_bytes: int = 0
    """Bytes that its camera sends before it waits for a request; 0 if it waits for none."""
    at_sink: Fragments = field(init=False)
    at_cloud: Fragments = field(init=False)
    packets: int = 0
    """Number of its packets that are queued or in flight."""
    sending_over: bool = False
    """Its camera sends no more fragments: the image is given up if its last packet does not complete it."""
    loss_cause: Cause = Cause.NONE
    """Cause of its last lost packet."""
    closed: bool = False
    """The image has arrived or was given up."""
    last_news_ns: int = 0
    """Time at which the sink last received a new fragment, or requested the missing ones."""

    def __post_init__(self) -> None:
        self.at_sink, self.at_cloud = Fragments(self.count), Fragments(self.count)

    @property
    def count(self) -> int:
        """Number of fragments of the image."""
        return -(-self.size_bytes // self.data_bytes)

    @property
    def first_count(self) -> int:
        """Number of fragments that are sent before a request."""
        return -(-self.first_bytes // self.data_bytes)

    def index_of(self, packet: Packet) -> int:
        """Return the index of the fragment that a packet carries."""
        return packet.first_byte // self.data_bytes


class Book:
    """Assigns ids to images and packets, records their events, and detects when none of them is left."""

    def __init__(
        self, env: simpy.Environment, recorder: Recorder, data_bytes: int, header_bytes: int
    ) -> None:
        """Start an empty record; a packet carries ``data_bytes`` of an image and ``header_bytes``."""
        self.env = env
        self.images: list[Image] = []
        self.cameras = 0
        """Number of cameras that will take further images."""
        self.ended = env.event()
        """Event that triggers when every image has arrived or was given up, and no packet is left."""
        self._recorder = recorder
        self._data_bytes = data_bytes
        self._header_bytes = header_bytes
        self._open = 0
        self._under_way = 0
        self._packets = 0

    def capture(self, node: int, size_bytes: int, first_bytes: int = 0) -> Image:
        """Create and record an image that a camera took; of it ``first_bytes`` are sent before a request."""
        image = Image(len(self.images), node, int(self.env.now), size_bytes, self._data_bytes, first_bytes)
        self.images.append(image)
        self._open += 1
        self._recorder.add(image.captured_ns, EventKind.CAPTURE, node, image=image.id, size_bytes=size_bytes)
        return image

    def close(self, image: Image, at: int, cause: Cause = Cause.NONE) -> None:
        """Close an image that is complete at node ``at``, or given up for ``cause``; ignored if closed."""
        if image.closed:
            return
        image.closed = True
        self._open -= 1
        kind = EventKind.EXPIRE if cause else EventKind.ARRIVE
        self._recorder.add(
            int(self.env.now), kind, image.node, at, image=image.id, size_bytes=image.size_bytes, cause=cause
        )
        self.end_if_nothing_left()

    def fragment(self, image: Image, index: int, source: int, destination: int) -> Packet:
        """Create a packet with a fragment of an image."""
        first_byte = index * image.data_bytes
        count = min(image.data_bytes, image.size_bytes - first_byte)
        image.packets += 1
        return self._packet(PacketKind.IMAGE, source, destination, count, image.id, first_byte)

    def status_packet(self, source: int, destination: int, data_bytes: int, image: int) -> Packet:
        """Create a STATUS packet, with which the sink requests fragments of an image."""
        return self._packet(PacketKind.STATUS, source, destination, data_bytes, image, 0)

    def request_packet(
        self, source: int, destination: int, data_bytes: int, image: int, number: int
    ) -> Packet:
        """Create a packet of the sink's request for what follows an image's first bytes."""
        return self._packet(PacketKind.REQUEST, source, destination, data_bytes, image, number)

    def _packet(
        self, kind: PacketKind, source: int, destination: int, count: int, image: int, first_byte: int
    ) -> Packet:
        self._under_way += 1
        self._packets += 1
        return Packet(
            self._packets - 1, kind, source, destination, self._header_bytes + count, image, first_byte, count
        )

    def entered(self, packet: Packet, node: int) -> None:
        """Record that a packet entered a node's buffer."""
        self._record(EventKind.ENQUEUE, packet, node, -1)

    def dropped(self, packet: Packet, node: int, cause: Cause) -> None:
        """Record that a node dropped a packet."""
        self._record(EventKind.DROP, packet, node, -1, cause)
        self.gone(packet, cause)

    def received(self, packet: Packet, at: int) -> None:
        """Record that a packet reached its last node."""
        self._record(EventKind.RECEIVE, packet, packet.source, at)
        self.gone(packet, Cause.NONE)

    def gone(self, packet: Packet, cause: Cause) -> None:
        """Count a packet as gone, after its RECEIVE or DROP was recorded."""
        self._under_way -= 1
        if packet.kind is PacketKind.IMAGE:
            image = self.images[packet.image]
            image.packets -= 1
            if cause:
                image.loss_cause = cause
            self.give_up_if_lost(image)
        self.end_if_nothing_left()

    def give_up_if_lost(self, image: Image) -> None:
        """Give up an image if its camera sends no more fragments and no packet of it is left."""
        if image.sending_over and not image.packets and not image.closed:
            self.close(image, -1, image.loss_cause)

    def end_if_nothing_left(self) -> None:
        """Trigger ``ended`` if no image is open, no packet is in flight and no camera is active."""
        if not (self._under_way or self._open or self.cameras or self.ended.triggered):
            self.ended.succeed()

    def _record(
        self, kind: EventKind, packet: Packet, node: int, peer: int, cause: Cause = Cause.NONE
    ) -> None:
        self._recorder.add_packet(int(self.env.now), kind, packet, node, peer, packet.size_bytes, cause)
