"""Types of packets, events and loss causes, and conversions to and from integer nanoseconds.

Integer times keep the order of events exact: two backoffs that expire in the same slot expire at the same
instant, and the same seed gives the same trace to the byte.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

NS_PER_S = 1_000_000_000
BEGIN_WITHIN_NS = 10_000_000
"""Nodes begin to send at a random time within this span, in LoRa within the time between two packets. An
exchange of IEEE 802.15.4 takes whole backoff periods: nodes that began at the same instant would stay
synchronised for ever."""


def to_ns(seconds: float) -> int:
    """Convert seconds to the nearest whole nanosecond."""
    return round(seconds * NS_PER_S)


def to_s(nanoseconds: int) -> float:
    """Convert nanoseconds to seconds."""
    return nanoseconds / NS_PER_S


class PacketKind(IntEnum):
    """Kind of a packet, by its content."""

    IMAGE = 0
    """A fragment of an image, or a whole small one."""
    SUMMARY = 1
    """Tags of images that a node offers."""
    REQUEST = 2
    """Request of the collector: ids of images, or in a collection the bytes after the first ones of an
    image."""
    STATUS = 3
    """Fragments of an image that the sink is missing."""


class EventKind(IntEnum):
    """Kind of an event in the trace."""

    CAPTURE = 0
    """A camera took an image: ``size_bytes`` as encoded."""
    ENQUEUE = 1
    """A packet entered a node's buffer."""
    AIR = 2
    """A frame was on the air from ``t_ns`` for ``duration_ns``, sent by ``node`` to ``peer``."""
    ACK = 3
    """An acknowledgement, RTS or CTS (a frame without payload) was on the air; columns as for AIR."""
    LOSS = 4
    """A transmission attempt failed, for ``cause``; a retry may follow. ``t_ns`` is the attempt's end."""
    DELIVER = 5
    """A packet has reached ``peer``, the next node on its route; ``t_ns`` is the end of its frame."""
    DROP = 6
    """``node`` dropped a packet, for ``cause``."""
    ARRIVE = 7
    """An image is complete at its destination."""
    EXPIRE = 8
    """An image was given up, for ``cause``: incomplete at its deadline, or dropped from a camera's buffer."""
    DOWN = 9
    """A node failed or went to sleep."""
    UP = 10
    """A node recovered or woke up."""
    JOIN = 11
    """A vehicle came within range of the access point ``peer``."""
    LEAVE = 12
    """A vehicle left the range of the access point ``peer``."""
    RECEIVE = 13
    """A packet has reached its destination ``peer``; ``node`` is its source."""


class Cause(IntEnum):
    """Why an attempt failed, or a packet or image was given up."""

    NONE = 0
    COLLISION = 1
    """Another transmission overlapped and was too strong for this one to be captured."""
    NOISE = 2
    """Bit errors: the signal-to-noise ratio was too low."""
    RANGE = 3
    """The signal was below the receive threshold."""
    CHANNEL = 4
    """The channel was busy at every clear channel assessment (CSMA failure)."""
    RETRIES = 5
    """Every allowed retransmission failed."""
    BUFFER = 6
    """The buffer was full."""
    DEADLINE = 7
    """The deadline had passed."""
    NODE_DOWN = 8
    """The sender or receiver was down."""
    NO_ROUTE = 9
    """No path of links leads to the sink."""
    UPLINK = 10
    """Lost between sink and cloud."""
    ACK_LOST = 11
    """The frame arrived, its acknowledgement did not."""
    LINK = 12
    """Lost on the link, by the configured loss share or by a recorded link."""


class Packet(NamedTuple):
    """A packet that nodes forward from one to the next.

    It is a named tuple because a run creates millions of them: a frozen dataclass takes four times as long.
    """

    id: int
    kind: PacketKind
    source: int
    destination: int
    """The last node of its route."""
    size_bytes: int
    """Payload of the medium access: application bytes with the headers of every layer above it."""
    image: int = -1
    first_byte: int = 0
    byte_count: int = 0
    """The packet carries bytes [first_byte, first_byte + byte_count) of its image."""


class Delivery(NamedTuple):
    """Result of ``Mac.send`` for one packet."""

    ok: bool
    """Whether the packet was delivered, as far as its sender knows."""
    cause: Cause
    """Why the packet was not delivered; ``NONE`` if it was."""
    attempts: int
    """Number of attempts to send the packet: data frames, and RTS frames that no data frame followed."""
    under_way: bool = False
    """True if the packet is still on its way; the medium access reports later whether it arrived."""
