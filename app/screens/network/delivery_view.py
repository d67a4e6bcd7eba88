"""Results of a delivery for the Network screen: the places of the nodes, and the data at each moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.compute.records import Stage
from app.compute.state import Sent
from app.screens.network.view import NetworkView
from pipeline.types import BoolArray, ByteArray, FloatArray

PICTURE_PX = 160
"""Width of the pictures on the frusta."""


@dataclass(frozen=True, slots=True)
class CameraNode:
    """One camera of the rig, or one keyframe of the walking camera of a recording."""

    name: str
    T_world_camera: FloatArray
    """(4, 4) pose believed before registration."""
    fov_rad: float
    """Vertical field of view."""
    aspect: float
    """Width over height."""
    total_bytes: int
    """Size of its encoded images."""
    row: int
    """Index of its node in the network; -1 if it is down. All keyframes of a recording have node 0."""
    ready_ns: int = 0
    """When a keyframe was taken, since the recording's first frame."""
    left_out_tiles: int = 0
    left_out_bytes: int = 0
    """Tiles that it did not send because another camera shows them, and their bytes."""


@dataclass(frozen=True, slots=True)
class NodeMoment:
    """One node's data at the sink at a moment."""

    delivered_bytes: int
    color_share: float
    """Share of its pixels with colour, 0 to 1."""
    depth_share: float
    """Share of its measured pixels with depth, 0 to 1."""
    coarse_share: float
    """Share of its pixels with coarse depth only, 0 to 1."""
    picture: ByteArray
    """(h, w, 3) the arrived picture: colour, or depth if that came first, or dark."""
    points_m: FloatArray
    """(N, 3) float32 arrived measured points, thinned, camera frame."""
    colors: ByteArray
    """(N, 3) RGB."""
    T_world_camera: FloatArray
    """(4, 4) registered pose, or the believed one."""
    energy_j: float
    """Energy that its node's radio, computer and camera have used; 0 if it is down."""


@dataclass(frozen=True, slots=True)
class MomentView:
    """The data that has arrived at one time, and the surface that it gives."""

    t_ns: int
    sent_bytes: int
    """Bytes sent on the air, with headers and retransmissions."""
    delivered_bytes: int
    """Bytes of the images at the sink, each counted once."""
    packets_lost: int
    """Number of failed attempts to send a packet."""
    radio_j: float
    energy_j: float
    """Energy of all nodes' radios, computers and cameras; ``radio_j`` is that of the radios alone."""
    nodes: tuple[NodeMoment, ...]
    glb: bytes
    """The surface; empty if there is none yet."""
    triangles: int
    no_hit_share: float | None
    """Share of the rays of all cameras that meet no triangle, 0 to 1; None without a surface."""
    f_score: float | None
    """F-score at 5 cm, 0 to 1; None without a surface or without ground truth."""


@dataclass(frozen=True, slots=True)
class Lossless:
    """The surface's quality when all images arrive."""

    no_hit_share: float
    f_score: float | None


@dataclass(frozen=True, slots=True)
class DeliveryView:
    """A rig's images sent through a network."""

    sent: Sent
    run: NetworkView
    nodes: tuple[CameraNode, ...]
    stage: Stage
    """Viewpoint from which the room and its cameras are visible."""
    times_ns: tuple[int, ...]
    """Times of all moments, computed or not."""
    arrived_ns: NDArray[np.int64]
    """(T,) times, at most some hundreds."""
    arrived_bytes: NDArray[np.int64]
    """(T,) bytes of the images that are at the sink by then."""
    moments: tuple[MomentView, ...] = ()
    """Computed moments by time."""
    lossless: Lossless | None = None
    """None while it is computed, or if there is no surface without losses either."""
    left_out: tuple[str, ...] = ()
    """A sentence on the tiles that were left out, and one on each sender's; empty if every node sends all."""
    ordered: tuple[str, ...] = ()
    """The same on the order in which the sink requested the tiles; empty in the coding's own order."""
    walk: str = ""
    """How the camera of a recording sends its keyframes, in a sentence; empty for a rig."""

    @property
    def node_names(self) -> tuple[str, ...]:
        """Names of the nodes, those that are down included; the camera of a recording is one."""
        return self.run.names[:1] if self.walk else tuple(node.name for node in self.nodes)

    def image_row(self, node: int, image: int) -> int | None:
        """Return the row in ``nodes`` of an image that a node of the network took; None if it is unknown."""
        if self.walk:
            return image if 0 <= image < len(self.nodes) else None
        return next((row for row, one in enumerate(self.nodes) if one.row == node), None)

    @property
    def senders(self) -> tuple[CameraNode, ...]:
        """The nodes that are not down, or the keyframes of a recording."""
        return tuple(node for node in self.nodes if node.row >= 0)

    @property
    def total_bytes(self) -> int:
        """Size of all nodes' images, including those of failed nodes."""
        return sum(node.total_bytes for node in self.nodes)

    @property
    def left_out_bytes(self) -> int:
        """Bytes of all tiles that were left out."""
        return sum(node.left_out_bytes for node in self.nodes)

    def moment_at(self, t_ns: int) -> MomentView | None:
        """Return the last computed moment up to this time."""
        return next((one for one in reversed(self.moments) if one.t_ns <= t_ns), None)


@dataclass(frozen=True, slots=True)
class PacketView:
    """The part of an image that is lost without one packet, if all others arrive."""

    row: int
    """Index of the node in the rig."""
    depth: BoolArray
    """(H, W) pixels whose depth is then missing, or only coarse."""
    color: BoolArray
    """(H, W) pixels whose colour is then missing, or coarse."""
    picture: ByteArray
    """(h, w, 3) the node's own picture with these pixels highlighted."""
    points_m: FloatArray
    """(N, 3) float32 points of the pixels with depth, camera frame."""
