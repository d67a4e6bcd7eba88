"""The words of the simulator: packets, what happens to them, and why they are lost; times in nanoseconds.

Integers keep the order of events exact: two backoffs that end in the same slot end at the same instant, and
the same seed gives the same trace to the byte.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

NS_PER_S = 1_000_000_000
BEGIN_WITHIN_NS = 10_000_000
"""Nodes that send from the start begin at random within this time. An exchange of IEEE 802.15.4 takes whole
backoff periods: begun at once, all nodes would count on one grid for ever, as if they were synchronised."""


def to_ns(seconds: float) -> int:
    """The nearest whole nanosecond."""
    return round(seconds * NS_PER_S)


def to_s(nanoseconds: int) -> float:
    """Seconds of a number of nanoseconds."""
    return nanoseconds / NS_PER_S


class PacketKind(IntEnum):
    """What a packet carries."""

    IMAGE = 0
    """A fragment of an image, or a whole small one."""
    SUMMARY = 1
    """Tags of images that a node offers."""
    REQUEST = 2
    """Ids of images that the collector wants."""
    STATUS = 3
    """Which fragments of an image the sink still lacks."""


class EventKind(IntEnum):
    """What a line of the trace says."""

    CAPTURE = 0
    """A camera took an image: ``size_bytes`` as encoded."""
    ENQUEUE = 1
    """A packet entered a node's buffer."""
    AIR = 2
    """A frame was on the air from ``t_ns`` for ``duration_ns``, sent by ``node`` to ``peer``."""
    ACK = 3
    """The same of an acknowledgement, RTS or CTS: bytes on the air without a payload."""
    LOSS = 4
    """An attempt failed at its end, for ``cause``; another may follow."""
    DELIVER = 5
    """A packet has reached ``peer``, the next node on its way; ``t_ns`` is when its frame ended."""
    DROP = 6
    """A packet was given up by ``node``, for ``cause``."""
    ARRIVE = 7
    """An image is complete at its destination."""
    EXPIRE = 8
    """An image is incomplete at its deadline, or was thrown out of a camera's buffer, for ``cause``."""
    DOWN = 9
    """A node failed or went to sleep."""
    UP = 10
    """It is back."""
    JOIN = 11
    """A vehicle came within range of the access point ``peer``."""
    LEAVE = 12
    """It left it."""
    RECEIVE = 13
    """A packet has reached its last node; ``node`` is its source, ``peer`` that node."""


class Cause(IntEnum):
    """Why an attempt failed, or a packet or image was given up."""

    NONE = 0
    COLLISION = 1
    """Another transmission overlapped and was not weak enough to be captured."""
    NOISE = 2
    """Bit errors: the signal was too near the noise."""
    RANGE = 3
    """The signal was below the receive threshold."""
    CHANNEL = 4
    """The channel was busy at every allowed look (CSMA failure)."""
    RETRIES = 5
    """Every allowed retransmission failed."""
    BUFFER = 6
    """The buffer was full."""
    DEADLINE = 7
    """It was too late."""
    NODE_DOWN = 8
    """The sender or receiver was down."""
    NO_ROUTE = 9
    """No path of links leads to the sink."""
    UPLINK = 10
    """Lost between sink and cloud."""
    ACK_LOST = 11
    """The frame arrived, its acknowledgement did not."""


class Packet(NamedTuple):
    """What a node hands down to be carried to a neighbour, and the neighbour hands on.

    A named tuple, as millions of them are made: a frozen dataclass takes four times as long.
    """

    id: int
    kind: PacketKind
    source: int
    destination: int
    """The last node of its way."""
    size_bytes: int
    """Payload of the medium access: application bytes with the headers of every layer above it."""
    created_ns: int
    image: int = -1
    first_byte: int = 0
    byte_count: int = 0
    """Which bytes of its image it carries."""


class Delivery(NamedTuple):
    """What came of handing a packet to the medium access."""

    ok: bool
    cause: Cause
    """Why not; ``NONE`` if it was delivered."""
    attempts: int
    """Frames sent for it."""
