"""Moments of a delivery: the sink's reconstruction at each moment, and the network's cost until then."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

from network_sim.types import to_s
from packetmesh.errors import ReconstructionError
from packetmesh.progress import Progress
from pipeline.delivery.coding import Received
from pipeline.delivery.memory import Memory, places_by_depth
from pipeline.delivery.sending import Sending, arrived_bytes, frames_at_sink, received_at
from pipeline.delivery.sink import heard
from pipeline.placement.outcome import whole_placement
from pipeline.sources import LoadedRig
from pipeline.spec import REBUILD, Spec
from pipeline.stages import compared, run, with_rays, yardstick_of_rig
from pipeline.surface.truth import Yardstick
from pipeline.types import BoolArray, ByteArray, FloatArray, RgbdFrame, Rig, SurfaceResult


@dataclass(frozen=True, slots=True)
class NodeArrival:
    """Shares of a node's image, or of one keyframe of a recording, that the sink has received."""

    name: str
    total_bytes: int
    delivered_bytes: int
    color_share: float
    """Share of its pixels with colour, 0 to 1."""
    depth_share: float
    """Share of its measured pixels whose depth has arrived, 0 to 1."""
    coarse_share: float
    """Share of its pixels whose depth is only coarsely known, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Moment:
    """State of a delivery at one time."""

    t_s: float
    """Time since a rig's cameras began, or since the first frame of a recording."""
    sent_bytes: int
    """Bytes sent over the air, retransmissions included."""
    delivered_bytes: int
    """Bytes of the images at the sink, each counted once."""
    packets_lost: int
    """Number of failed attempts to send a packet."""
    radio_j: float
    """Energy of all nodes' radios until then."""
    energy_j: float
    """Energy of all nodes' radios, computers and cameras until then."""
    nodes: tuple[NodeArrival, ...]
    """One for each image: of a rig's nodes, or the keyframes that the camera of a recording sends."""
    T_world_camera: dict[str, FloatArray]
    """(4, 4) registered poses of the images that have been received and placed by then."""
    surface: SurfaceResult | None
    """Surface measured by the rays and the depth of all cameras, received or not; None if nothing can be
    reconstructed."""
    truth: dict[str, float] | None
    """Comparison of the surface with the truth, if both exist."""


Rebuilt = tuple[SurfaceResult | None, dict[str, float] | None, dict[str, FloatArray]]
"""Surface of a moment, its comparison with the truth, and the nodes' poses."""
NOTHING: Rebuilt = None, None, {}


class Rebuilder:
    """Reconstructs moments of a delivery, fastest in order of time, because unchanged results are kept."""

    def __init__(self, sending: Sending) -> None:
        self.sending = sending
        self._memory = Memory(places_by_depth(sending.spec.spec.config, sending.rig))
        self._yardstick = yardstick_of_rig(sending.rig)
        self._rebuilt = NOTHING

    def moment(self, index: int) -> Generator[Progress, None, Moment]:
        """Reconstruct the moment at ``sending.times_ns[index]``."""
        received = received_at(self.sending, int(self.sending.times_ns[index]))
        frames = frames_at_sink(self.sending, received)
        if self._memory.look_at([frame for frame in frames if heard(frame)]):
            self._rebuilt = yield from _rebuilt(self.sending, frames, self._memory, self._yardstick)
        return _moment(self.sending, index, received, self._rebuilt)


def _moment(sending: Sending, index: int, received: Sequence[Received], rebuilt: Rebuilt) -> Moment:
    t_ns, (surface, truth, poses) = int(sending.times_ns[index]), rebuilt
    there, spent = arrived_bytes(sending, t_ns), sending.spent
    nodes = tuple(
        _arrival(frame, stream, bytes_there, one)
        for frame, stream, bytes_there, one in zip(
            sending.rig.frames, sending.streams, there, received, strict=True
        )
    )
    return Moment(
        t_s=to_s(t_ns),
        sent_bytes=int(spent.sent_bytes[index]),
        delivered_bytes=sum(node.delivered_bytes for node in nodes),
        packets_lost=int(spent.lost[index]),
        radio_j=float(spent.radio_j[index]),
        energy_j=float(spent.radio_j[index] + spent.platform_j[index]),
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
    sending: Sending, frames: Sequence[RgbdFrame], memory: Memory, yardstick: Yardstick | None
) -> Generator[Progress, None, Rebuilt]:
    present = [index for index, frame in enumerate(frames) if heard(frame)]
    if not present:
        return NOTHING
    spec = spec_of(sending, frames, present)
    try:
        results = yield from run(spec, memory, REBUILD)
    except ReconstructionError:  # a few points may have no surface yet
        return NOTHING
    placement = results["placement"].value
    everyone = whole_placement(sending.rig, present, placement)
    surface = with_rays(results["after"].value, sending.rig, everyone)
    poses = {
        frames[index].name: pose
        for index, pose in placement.placed(list(zip(present, placement.T_world_camera, strict=True)))
    }
    return surface, compared(sending.rig, everyone, surface, yardstick), poses


def lossless_spec(sending: Sending) -> Spec:
    """Return the spec of the chain for the images before coding; of a walk, only its keyframes are sent."""
    if sending.rig.walk is None:
        return sending.spec.spec
    return spec_of(sending, sending.rig.frames, range(len(sending.rig.frames)))


def spec_of(sending: Sending, frames: Sequence[RgbdFrame], present: Sequence[int]) -> Spec:
    """Return the spec of the chain for the nodes that have been received."""
    given = sending.spec.spec
    rig = Rig(sending.rig.name, tuple(frames[index] for index in present))
    return Spec(LoadedRig(rig), given.preset, given.config)
