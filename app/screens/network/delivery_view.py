"""What the Network screen gets of a delivery: who stands where, and what has arrived at each moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.compute.state import Sent
from app.drawing.cameras import Stage
from app.screens.network.view import NetworkView
from pipeline.types import BoolArray, ByteArray, FloatArray

PICTURE_PX = 160
"""Width of the pictures on the frusta."""


@dataclass(frozen=True, slots=True)
class CameraNode:
    """One camera of the rig."""

    name: str
    T_world_camera: FloatArray
    """(4, 4) as believed before anything is registered."""
    fov_rad: float
    """Vertical field of view."""
    aspect: float
    """Width over height."""
    total_bytes: int
    """Of its encoded images."""
    row: int
    """Its number in the network; -1 if it is down."""


@dataclass(frozen=True, slots=True)
class NodeMoment:
    """One node as the sink knows it at a moment."""

    delivered_bytes: int
    color_share: float
    """Of its pixels, 0 to 1."""
    depth_share: float
    """Of its measured pixels, 0 to 1."""
    coarse_share: float
    """Of its pixels, 0 to 1: depth known coarsely only."""
    picture: ByteArray
    """(h, w, 3) as far as it has arrived: colour, or depth where that came first, or dark."""
    points_m: FloatArray
    """(N, 3) float32 of measured depth that has arrived, thinned, camera frame."""
    colors: ByteArray
    """(N, 3)."""
    T_world_camera: FloatArray
    """(4, 4) registered, or as believed."""
    energy_j: float
    """That its radio and the computer that carries it have used; 0 if it is down."""


@dataclass(frozen=True, slots=True)
class MomentView:
    """What has arrived at one time, and what it is good for."""

    t_ns: int
    sent_bytes: int
    delivered_bytes: int
    packets_lost: int
    radio_j: float
    energy_j: float
    nodes: tuple[NodeMoment, ...]
    glb: bytes
    """The surface; empty where there is none yet."""
    triangles: int
    no_hit_share: float | None
    f_score: float | None
    """At 5 cm, 0 to 1; None without a surface or without a truth."""


@dataclass(frozen=True, slots=True)
class Lossless:
    """What the images are good for when all of them arrive."""

    no_hit_share: float
    f_score: float | None


@dataclass(frozen=True, slots=True)
class DeliveryView:
    """A rig's images sent through a network."""

    sent: Sent
    run: NetworkView
    nodes: tuple[CameraNode, ...]
    stage: Stage
    """Where to stand to see the room and its cameras."""
    times_ns: tuple[int, ...]
    """Of all moments, computed or not."""
    arrived_ns: NDArray[np.int64]
    """(T,) times, some hundreds at most."""
    arrived_bytes: NDArray[np.int64]
    """(T,) of the images that are at the sink by then."""
    moments: tuple[MomentView, ...] = ()
    """By time; while it is computed, those that are there."""
    lossless: Lossless | None = None
    """None while it is computed, or if there is no surface without losses either."""

    @property
    def total_bytes(self) -> int:
        """Of all nodes' images, those of failed nodes included."""
        return sum(node.total_bytes for node in self.nodes)

    def moment_at(self, t_ns: int) -> MomentView | None:
        """The nearest earlier moment that is there."""
        return next((one for one in reversed(self.moments) if one.t_ns <= t_ns), None)


@dataclass(frozen=True, slots=True)
class PacketView:
    """What one packet says of an image."""

    row: int
    """Of the node in the rig."""
    depth: BoolArray
    """(H, W) pixels whose depth it tells by itself."""
    color: BoolArray
    picture: ByteArray
    """(h, w, 3) the node's own picture with these pixels lit up."""
    points_m: FloatArray
    """(N, 3) float32 of the pixels with depth, camera frame."""
