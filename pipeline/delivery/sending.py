"""Transmission of a rig's images: the bytes of every image, and the times at which they reach the sink."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from network_sim.config import NetworkConfig
from network_sim.metrics.arrivals import Arrivals, Spent, arrivals, until
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.trace.log import NetworkTrace
from packetmesh.errors import InputError
from pipeline.delivery import coding_named
from pipeline.delivery.coding import Coding, Received
from pipeline.delivery.leaving_out import (
    LeftOut,
    Order,
    Ordered,
    check_can_request,
    send_requested,
    tiles_of,
)
from pipeline.delivery.plan import network_of, placed
from pipeline.delivery.sink import frame_at_sink, images_of
from pipeline.delivery.tiled import Tiled
from pipeline.delivery.walked import CAMERA, check_sends_all, walk_network
from pipeline.spec import Spec
from pipeline.types import BoolArray, ByteArray, RgbdFrame, Rig

MOMENTS = 40


@dataclass(frozen=True, slots=True)
class DeliverySpec:
    """Everything that determines a delivery and its reconstructions."""

    spec: Spec
    """The rig, and the settings of its reconstruction."""
    network: NetworkConfig = field(default_factory=lambda: PRESETS["office"])
    coding: str = "exact"
    """Name in ``pipeline.delivery.CODINGS``."""
    moments: int = MOMENTS
    down: tuple[str, ...] = ()
    """Names of failed nodes, which send nothing."""
    leave_out_seen: bool = False
    """Whether nodes leave out tiles that another camera shows, which the sink tells them."""
    order: Order = "own"
    """Order of the depth tiles: the coding's own, or that of their worth, which the sink requests."""

    @property
    def requests(self) -> bool:
        """Whether the sink requests what follows the base layers."""
        return self.leave_out_seen or self.order == "worth"

    def __post_init__(self) -> None:
        if self.moments < 1:
            raise InputError(f"{self.moments} moments show nothing; try at least 1")
        if self.order not in get_args(Order):
            raise InputError(
                f"There is no order '{self.order}' of tiles; try one of {', '.join(get_args(Order))}"
            )
        if self.requests:
            coding_named(self.coding)
            check_can_request(self.coding, self.network, self.leave_out_seen)


@dataclass(frozen=True, slots=True)
class Sending:
    """The sent images and their times of arrival.

    Each camera of a rig sends one image. The camera of a recording sends all images, its keyframes, in order.
    """

    spec: DeliverySpec
    rig: Rig
    coding: Coding
    streams: tuple[ByteArray, ...]
    """(S,) bytes of each image."""
    trace: NetworkTrace
    arrivals: Arrivals
    """Of all images; ``node`` is the image's index in the rig, also where one camera sends all."""
    times_ns: NDArray[np.int64]
    """(M,) times of the moments."""
    spent: Spent
    """(M,) bytes, losses and energy until each moment."""
    left_out: LeftOut | None = None
    """Tiles that were not sent because another camera shows them; None if nodes send all."""
    ordered: Ordered | None = None
    """Order of the depth tiles that the sink requested; None if they are sent in the coding's own order."""

    @property
    def packet_bytes(self) -> int:
        """Bytes of a stream per packet."""
        return packet_bytes_of(self.trace.config)

    @property
    def ready_s(self) -> tuple[float, ...]:
        """Time at which each image of a recording was taken, from its first frame; empty for a rig."""
        return self.trace.config.nodes.image_times_s

    def decoded(self, node: int, there: BoolArray) -> Received:
        """Decode an image from the bytes of its stream that are ``there`` (S,)."""
        data, shape = np.where(there, self.streams[node], 0), self.rig.frames[node].rgb.shape
        size = shape[0], shape[1]
        if not isinstance(self.coding, Tiled):
            return self.coding.decode(data, there, size, self.packet_bytes)
        missing = None if self.left_out is None else tiles_of(self.left_out.tiles[node], size, self.coding)
        worth = None if self.ordered is None else self.ordered.worth[node]
        order = None if worth is None else worth.order
        return self.coding.decode(data, there, size, self.packet_bytes, missing, order)


def send(spec: DeliverySpec, rig: Rig) -> Sending:
    """Encode all images and run the network that carries them.

    Args:
        spec: what is sent, and how.
        rig: the spec's rig, as stage ``rig`` gives it.

    Raises:
        InputError: as for ``iterate_delivery``.
    """
    coding = coding_named(spec.coding)
    packet_bytes = packet_bytes_of(spec.network)
    senders, left_out, ordered = senders_of(rig, spec.down), None, None
    if rig.walk is not None:
        check_sends_all(rig, spec.leave_out_seen, spec.order)
        encoded = tuple(coding.encode(images_of(frame), packet_bytes) for frame in rig.frames)
        trace = simulate(walk_network(rig, [len(data) for data in encoded], spec.network))
    elif spec.requests and isinstance(coding, Tiled):
        config, network = spec.spec.config, placed(rig, spec.network, senders)
        sent = send_requested(rig, coding, senders, network, config, spec.leave_out_seen, spec.order)
        encoded, trace, left_out, ordered = sent.streams, sent.trace, sent.left_out, sent.ordered
    else:
        network = placed(rig, spec.network, senders)
        encoded = tuple(coding.encode(images_of(frame), packet_bytes) for frame in rig.frames)
        part = Rig(rig.name, tuple(rig.frames[node] for node in senders))
        trace = simulate(network_of(part, [len(encoded[node]) for node in senders], network))
    streams = tuple(np.frombuffer(data, np.uint8) for data in encoded)
    came = arrivals(trace)
    came = replace(came, node=came.image if rig.walk is not None else np.array(senders)[came.node])
    times_ns = moment_times_ns(came, trace, spec.moments)
    spent = until(trace, times_ns)
    return Sending(spec, rig, coding, streams, trace, came, times_ns, spent, left_out, ordered)


def nodes_of(rig: Rig) -> tuple[str, ...]:
    """Return the names of the rig's nodes in a network; the camera of a recording is one."""
    return (CAMERA,) if rig.walk is not None else tuple(frame.name for frame in rig.frames)


def senders_of(rig: Rig, down: Sequence[str]) -> list[int]:
    """Return the indices of the nodes that send (``nodes_of``), in their order in the network.

    Raises:
        InputError: a node that is down is not in the rig, or none is left.
    """
    names = nodes_of(rig)
    for name in down:
        if name not in names:
            raise InputError(f"There is no node '{name}' that could be down; try one of {', '.join(names)}")
    senders = [node for node, name in enumerate(names) if name not in down]
    if not senders:
        raise InputError("All nodes are down, so nothing is sent; leave at least one of them running")
    return senders


def packet_bytes_of(network: NetworkConfig) -> int:
    """Return the bytes of a node's images per packet."""
    return network.nodes.payload_bytes - network.nodes.header_bytes


def moment_times_ns(came: Arrivals, trace: NetworkTrace, count: int) -> NDArray[np.int64]:
    """Return (M,) times at which equal shares of all bytes that ever arrive have arrived.

    Args:
        came: arrivals at the sink.
        trace: trace of the run; if nothing arrives, its end is the only moment.
        count: number of moments; fewer if several coincide.
    """
    if not len(came.t_ns):
        return np.array([trace.horizon_ns])
    total = np.cumsum(came.byte_count, dtype=np.int64)
    thresholds = np.ceil(total[-1] * np.arange(1, count + 1) / count)
    return np.unique(came.t_ns[np.searchsorted(total, thresholds)])


def arrived_bytes(sending: Sending, t_ns: int) -> list[BoolArray]:
    """Return each image's (S,) mask of the bytes of its stream that have reached the sink by ``t_ns``."""
    came, marks = sending.arrivals, []
    there = came.t_ns <= t_ns
    for node, stream in enumerate(sending.streams):
        mine = there & (came.node == node)
        edges = np.zeros(len(stream) + 1, np.int32)
        np.add.at(edges, came.first_byte[mine], 1)
        np.add.at(edges, came.first_byte[mine] + came.byte_count[mine], -1)
        marks.append(np.cumsum(edges)[:-1] > 0)
    return marks


def received_at(sending: Sending, t_ns: int) -> list[Received]:
    """Decode each node's images from the bytes that have reached the sink by ``t_ns``."""
    return [sending.decoded(node, there) for node, there in enumerate(arrived_bytes(sending, t_ns))]


def frames_at_sink(sending: Sending, received: Sequence[Received]) -> list[RgbdFrame]:
    """Return every node's frame from its received images."""
    return [frame_at_sink(*both) for both in zip(sending.rig.frames, received, strict=True)]
