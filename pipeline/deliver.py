"""From a rig's cameras through a network to a surface: what the sink can rebuild at each moment (SPEC 6.5).

Every node sends its own colour and depth image, encoded for real. At each moment the sink decodes exactly
the bytes that have arrived by then, and the usual chain makes of them what it can.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from network_sim.arrivals import Arrivals, arrivals, until
from network_sim.config import PRESETS, NetworkConfig
from network_sim.simulate import simulate
from network_sim.trace import NetworkTrace
from network_sim.types import to_s
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import Progress, drain
from pipeline import geometry
from pipeline.delivery import coding_named
from pipeline.delivery.coding import Coding, Received
from pipeline.delivery.memory import Memory
from pipeline.delivery.plan import network_of
from pipeline.delivery.sink import frame_at_sink, heard, images_of
from pipeline.nodes import Placement
from pipeline.reconstruct import Reconstruction, iterate_reconstruction
from pipeline.sources import LoadedRig
from pipeline.spec import Spec, StageName
from pipeline.stages import compared, run, with_rays
from pipeline.types import BoolArray, ByteArray, FloatArray, RgbdFrame, Rig, SurfaceResult

MOMENTS = 40
REBUILT: tuple[StageName, ...] = ("rig", "inferred", "nodes", "placement", "clouds", "after")
"""The stages of a moment."""


@dataclass(frozen=True, slots=True)
class DeliverySpec:
    """Everything that decides what is delivered, and what is made of it."""

    spec: Spec
    """The rig, and the settings of its reconstruction."""
    network: NetworkConfig = field(default_factory=lambda: PRESETS["office"])
    coding: str = "raw"
    """A name of ``pipeline.delivery.CODINGS``."""
    moments: int = MOMENTS
    down: tuple[str, ...] = ()
    """Names of nodes that have failed and send nothing."""


@dataclass(frozen=True, slots=True)
class NodeArrival:
    """How much of one node's images the sink knows."""

    name: str
    total_bytes: int
    delivered_bytes: int
    color_share: float
    """Of its pixels with colour, 0 to 1."""
    depth_share: float
    """Of its measured pixels, those whose depth has arrived, 0 to 1."""
    coarse_share: float
    """Of its pixels, those whose depth is known coarsely only, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Moment:
    """What has arrived at one time, and what it is good for."""

    t_s: float
    """Since the first image was taken."""
    sent_bytes: int
    """On the air, frames that were sent again included."""
    delivered_bytes: int
    """Of the images at the sink, each counted once."""
    packets_lost: int
    """Attempts that failed."""
    radio_j: float
    """Energy of all nodes' radios until then."""
    energy_j: float
    """The same with the computers and cameras that carry them."""
    nodes: tuple[NodeArrival, ...]
    T_world_camera: dict[str, FloatArray]
    """(4, 4) registered poses of the nodes that were heard by then."""
    surface: SurfaceResult | None
    """Measured by the rays of all cameras, heard or not; None where nothing can be rebuilt."""
    truth: dict[str, float] | None
    """The surface compared with the truth, where there are both."""


Rebuilt = tuple[SurfaceResult | None, dict[str, float] | None, dict[str, FloatArray]]
"""The surface of a moment, its comparison with the truth, and where the nodes stand."""
NOTHING: Rebuilt = None, None, {}


@dataclass(frozen=True, slots=True)
class Sending:
    """The images on their way: what every node sends, and when which bytes of it arrive."""

    spec: DeliverySpec
    rig: Rig
    coding: Coding
    streams: tuple[ByteArray, ...]
    """(S,) bytes of each node."""
    trace: NetworkTrace
    arrivals: Arrivals
    times_ns: NDArray[np.int64]
    """(M,) of the moments."""

    @property
    def packet_bytes(self) -> int:
        """How many bytes of a stream a packet carries."""
        return packet_bytes_of(self.trace.config)


@dataclass(frozen=True, slots=True)
class Delivery:
    """A rig's images sent through a network."""

    sending: Sending
    moments: tuple[Moment, ...]
    last: Reconstruction | None
    """Of what had arrived in the end; None where that was too little."""
    lossless: Reconstruction
    """Of the images as they were taken."""


def deliver(spec: DeliverySpec) -> Delivery:
    """The fold of ``iterate_delivery``."""
    return drain(iterate_delivery(spec))


def iterate_delivery(spec: DeliverySpec) -> Generator[Moment, None, Delivery]:
    """Send a rig's images and rebuild the scene from what has arrived at each moment.

    Args:
        spec: the rig, the network, the coding, and how many moments.

    Yields:
        The moments by time.

    Raises:
        InputError: the rig, the network or the coding cannot be used; the message says why.
    """
    sending, moments = send(spec), []
    for step in rebuild(sending, sending.times_ns.tolist()):
        if isinstance(step, Moment):
            moments.append(step)
            yield step
    lossless = drain(iterate_reconstruction(spec.spec))
    last = _last(sending, lossless)
    return Delivery(sending, tuple(moments), last, lossless)


def rebuild(sending: Sending, times_ns: Iterable[int]) -> Generator[Progress | Moment, None, None]:
    """The moments at some times, in this order; between them the progress of the chain.

    Next to each other in time they share the most work.
    """
    memory, rebuilt = Memory(sending.spec.spec.config.fusion.align_nodes_with == "sensor"), NOTHING
    for t_ns in times_ns:
        received = received_at(sending, t_ns)
        frames = frames_at_sink(sending, received)
        if memory.look_at([frame for frame in frames if heard(frame)]):
            rebuilt = yield from _rebuilt(sending, frames, memory)
        yield _moment(sending, t_ns, received, rebuilt)


def send(spec: DeliverySpec) -> Sending:
    """Encode every node's images and run the network that carries them.

    Raises:
        InputError: as ``iterate_delivery``.
    """
    coding, rig = coding_named(spec.coding), spec.spec.source.load()
    packet_bytes = packet_bytes_of(spec.network)
    streams = tuple(
        np.frombuffer(coding.encode(images_of(frame), packet_bytes), np.uint8) for frame in rig.frames
    )
    senders = senders_of(rig, spec.down)
    part = Rig(rig.name, tuple(rig.frames[node] for node in senders))
    trace = simulate(network_of(part, [len(streams[node]) for node in senders], spec.network))
    came = arrivals(trace)
    came = replace(came, node=np.array(senders)[came.node])
    return Sending(spec, rig, coding, streams, trace, came, moment_times_ns(came, trace, spec.moments))


def senders_of(rig: Rig, down: Sequence[str]) -> list[int]:
    """Which of a rig's nodes send, by their order in the network.

    Raises:
        InputError: a node that is down is not one of the rig's, or none is left.
    """
    names = [frame.name for frame in rig.frames]
    for name in down:
        if name not in names:
            raise InputError(f"There is no node '{name}' that could be down; try one of {', '.join(names)}")
    senders = [node for node, name in enumerate(names) if name not in down]
    if not senders:
        raise InputError("All nodes are down, so nothing is sent; leave at least one of them running")
    return senders


def packet_bytes_of(network: NetworkConfig) -> int:
    """How many bytes of a node's images a packet carries."""
    return network.nodes.payload_bytes - network.nodes.header_bytes


def moment_times_ns(came: Arrivals, trace: NetworkTrace, count: int) -> NDArray[np.int64]:
    """(M,) times after which equal shares of the bytes that ever arrive have arrived.

    Args:
        came: what arrives when.
        trace: of the run; its end is the only moment if nothing arrives.
        count: how many moments; fewer where several would be the same.
    """
    if not len(came.t_ns):
        return np.array([trace.horizon_ns])
    total = np.cumsum(came.byte_count, dtype=np.int64)
    wanted = np.ceil(total[-1] * np.arange(1, count + 1) / count)
    return np.unique(came.t_ns[np.searchsorted(total, wanted)])


def arrived_bytes(sending: Sending, t_ns: int) -> list[BoolArray]:
    """(S,) for each node, which bytes of its stream are at the sink at a time."""
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
    """What the sink can decode of each node's images at a time."""
    return [
        sending.coding.decode(np.where(there, stream, 0), there, frame.rgb.shape[:2], sending.packet_bytes)
        for frame, stream, there in zip(
            sending.rig.frames, sending.streams, arrived_bytes(sending, t_ns), strict=True
        )
    ]


def frames_at_sink(sending: Sending, received: Sequence[Received]) -> list[RgbdFrame]:
    """Every node's frame as far as it has arrived."""
    return [frame_at_sink(*both) for both in zip(sending.rig.frames, received, strict=True)]


def _moment(sending: Sending, t_ns: int, received: Sequence[Received], rebuilt: Rebuilt) -> Moment:
    there, (surface, truth, poses) = arrived_bytes(sending, t_ns), rebuilt
    spent = until(sending.trace, t_ns)
    nodes = tuple(
        _arrival(frame, stream, bytes_there, one)
        for frame, stream, bytes_there, one in zip(
            sending.rig.frames, sending.streams, there, received, strict=True
        )
    )
    return Moment(
        t_s=to_s(t_ns),
        sent_bytes=spent.sent_bytes,
        delivered_bytes=sum(node.delivered_bytes for node in nodes),
        packets_lost=spent.lost,
        radio_j=spent.radio_j,
        energy_j=spent.radio_j + spent.platform_j,
        nodes=nodes,
        T_world_camera=poses,
        surface=surface,
        truth=truth,
    )


def _arrival(frame: RgbdFrame, stream: ByteArray, there: BoolArray, received: Received) -> NodeArrival:
    measured = max(1, int(frame.depth.valid.sum()))
    return NodeArrival(
        name=frame.name,
        total_bytes=len(stream),
        delivered_bytes=int(there.sum()),
        color_share=float(received.rgb_known.mean()),
        depth_share=float((received.depth > 0).sum()) / measured,
        coarse_share=float((received.coarse > 0).mean()),
    )


def _rebuilt(
    sending: Sending, frames: Sequence[RgbdFrame], memory: Memory
) -> Generator[Progress, None, Rebuilt]:
    present = [index for index, frame in enumerate(frames) if heard(frame)]
    if not present:
        return NOTHING
    spec = _spec_of(sending, frames, present)
    try:
        results = yield from run(spec, memory, REBUILT)
    except ReconstructionError:  # a handful of points has no surface yet
        return NOTHING
    placement, surface = results["placement"].value, results["after"].value
    everyone = whole_placement(sending.rig, present, placement)
    if len(present) < len(frames):
        surface = with_rays(surface, sending.rig, everyone)
    poses = {frames[index].name: pose for index, pose in zip(present, placement.T_world_camera, strict=True)}
    return surface, compared(sending.rig, everyone, surface), poses


def _spec_of(sending: Sending, frames: Sequence[RgbdFrame], present: Sequence[int]) -> Spec:
    """The chain on the nodes that were heard."""
    asked = sending.spec.spec
    rig = Rig(sending.rig.name, tuple(frames[index] for index in present))
    return Spec(LoadedRig(rig), asked.preset, asked.config)


def whole_placement(rig: Rig, present: Sequence[int], placement: Placement) -> Placement:
    """The registered nodes, and the others beside the first of them, as the truth or the rig believes."""
    believed = [frame.T_world_camera for frame in rig.frames]
    reference = believed if rig.truth is None else rig.truth.T_world_camera
    T_here_reference = placement.T_world_camera[0] @ geometry.inverse(reference[present[0]])
    poses = [T_here_reference @ pose for pose in reference]
    for index, pose in zip(present, placement.T_world_camera, strict=True):
        poses[index] = pose
    return Placement(placement.registrations, tuple(poses))


def _last(sending: Sending, lossless: Reconstruction) -> Reconstruction | None:
    """The whole chain on what has arrived in the end."""
    frames = frames_at_sink(sending, received_at(sending, int(sending.times_ns[-1])))
    if all(_same(*both) for both in zip(frames, sending.rig.frames, strict=True)):
        return lossless
    present = [index for index, frame in enumerate(frames) if heard(frame)]
    if not present:
        return None
    try:
        return drain(iterate_reconstruction(_spec_of(sending, frames, present)))
    except ReconstructionError:
        return None


def _same(one: RgbdFrame, other: RgbdFrame) -> bool:
    return np.array_equal(one.rgb, other.rgb) and np.array_equal(
        one.depth.z_m, other.depth.z_m, equal_nan=True
    )
