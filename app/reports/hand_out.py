"""The data of a delivery's hand-out as plain values, independent of their source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.types import BoolArray, ByteArray, CameraIntrinsics, FloatArray, IntArray, Surface

THUMBNAIL_PX = 192
"""Width of a picture on a frustum."""
FIELD_RAD = np.radians(45.0)
"""Vertical field of view of a picture with aspect ``ASPECT``."""
ASPECT = 4 / 3
TILT_RAD = np.radians(38.0)
"""Downward tilt of the view."""
MARGIN = 1.16
_LIGHT, _DARK, _SQUARE_PX = 150, 105, 6


@dataclass(frozen=True, slots=True)
class HandOutNode:
    """A camera node and its pose."""

    name: str
    intrinsics: CameraIntrinsics
    T_world_camera: FloatArray
    """(4, 4) pose."""


@dataclass(frozen=True, slots=True)
class HandOutMoment:
    """The sink's data at one moment, and the surface computed from it."""

    t_s: float
    sent_bytes: int
    delivered_bytes: int
    packets_lost: int
    energy_j: float
    surface: Surface | None
    """World frame; None if there is none yet."""
    thumbnails: tuple[bytes, ...]
    """For each node its received picture as JPEG (``thumbnail``); empty before anything has arrived."""
    f_score: float | None = None
    """F-score at 5 cm, 0 to 1; None without ground truth or surface."""
    no_hit_share: float | None = None
    """Share of the cameras' rays without a surface, 0 to 1."""


@dataclass(frozen=True, slots=True)
class FramesOnAir:
    """Columns (N,) of the frames that the nodes sent."""

    node: IntArray
    """Index in ``HandOut.nodes`` of the sender."""
    start_s: FloatArray
    end_s: FloatArray
    cause: IntArray
    """Index in ``causes`` of the cause of the loss; 0 if the frame arrived."""
    causes: tuple[str, ...]
    """Causes in words; the first stands for frames that arrived and is not shown. At most 256."""


@dataclass(frozen=True, slots=True)
class HandOut:
    """A delivery for viewers without PacketMesh.

    Raises:
        InputError: there is no node or no moment, or a moment lacks a picture of a node.
    """

    title: str
    sentence: str
    """Sentence that describes the picture."""
    nodes: tuple[HandOutNode, ...]
    moments: tuple[HandOutMoment, ...]
    """Moments in order of time."""
    frames: FramesOnAir
    end_s: float
    """End of the network's clock, which starts at 0."""
    lossless_f_score: float | None = None
    """F-score if everything had arrived."""

    def __post_init__(self) -> None:
        if not self.nodes or not self.moments:
            missing = "moment" if self.nodes else "node"
            raise InputError(f"The hand-out {self.title!r} has no {missing}; give at least one")
        for moment in self.moments:
            if len(moment.thumbnails) != len(self.nodes):
                raise InputError(
                    f"The hand-out {self.title!r} has {len(moment.thumbnails)} pictures at {moment.t_s:g} s, "
                    f"but {len(self.nodes)} nodes; give one for each, empty where nothing arrived"
                )


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """The first viewpoint of a hand-out."""

    eye_m: FloatArray
    """(3,)."""
    middle_m: FloatArray
    """(3,) look-at point."""
    up: FloatArray
    """(3,) unit vector."""

    def record(self) -> dict[str, list[float]]:
        """Return the viewpoint as JSON values for a page."""
        return {"eye_m": self.eye_m.tolist(), "middle_m": self.middle_m.tolist(), "up": self.up.tolist()}


def thumbnail(rgb: ByteArray, known: BoolArray) -> bytes:
    """Return a received picture as a small JPEG; missing parts are a grey checkerboard.

    Args:
        rgb: (H, W, 3).
        known: (H, W) whether the colour has arrived.

    Returns:
        Bytes of the JPEG file; empty if nothing has arrived.
    """
    if not known.any():
        return b""
    size = (THUMBNAIL_PX, max(1, round(THUMBNAIL_PX * rgb.shape[0] / rgb.shape[1])))
    share = cv2.resize(known.astype(np.float32), size, interpolation=cv2.INTER_AREA)[..., None]
    seen = cv2.resize((rgb * known[..., None]).astype(np.float32), size, interpolation=cv2.INTER_AREA)
    row, column = np.indices(share.shape[:2]) // _SQUARE_PX
    squares = np.where((row + column) % 2, np.float32(_DARK), np.float32(_LIGHT))[..., None]
    picture = np.clip(seen + (1.0 - share) * squares, 0, 255).astype(np.uint8)
    _, jpeg = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 80])
    return jpeg.tobytes()


def viewpoint(hand_out: HandOut) -> Viewpoint:
    """Return a viewpoint behind and above the first camera that shows the last surface and all cameras."""
    poses = [node.T_world_camera for node in hand_out.nodes]
    surfaces = [moment.surface for moment in hand_out.moments if moment.surface is not None]
    seen_m = [surface.vertices_m for surface in surfaces if len(surface.triangles)]
    return viewpoint_of(poses, seen_m[-1] if seen_m else np.zeros((0, 3)))


def viewpoint_of(
    poses: Sequence[FloatArray], points_m: FloatArray, cameras_in_sight: bool = True
) -> Viewpoint:
    """Return the viewpoint, on the first camera's side and above, that shows (N, 3) points and, unless
    ``cameras_in_sight`` is false, the cameras; poses are (4, 4) T_world_camera."""
    up = _up(np.mean([-pose[:3, 1] for pose in poses], axis=0))
    first = poses[0]
    if not len(points_m):
        points_m = first[None, :3, 3] + 2.0 * first[None, :3, 2]
    level = first[:3, 3] - np.median(points_m, axis=0)
    level -= (level @ up) * up
    back = level / max(float(np.linalg.norm(level)), 1e-9) * np.cos(TILT_RAD) + up * np.sin(TILT_RAD)
    back /= np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(back, right), back])
    cameras_m = [pose[:3, 3] for pose in poses if cameras_in_sight]
    place_m = np.vstack([points_m, *cameras_m]) @ axes.T
    slope = np.tan(0.5 * FIELD_RAD) / MARGIN * np.array([ASPECT, 1.0])
    # Shift the four side planes of the view frustum until each touches the outermost point on its side.
    high_m, low_m = (sign * (sign * place_m[:, :2] + slope * place_m[:, 2:]).max(axis=0) for sign in (1, -1))
    far_m = float(((high_m - low_m) / (2.0 * slope)).max())
    eye_m = axes.T @ np.append(0.5 * (high_m + low_m), far_m)
    middle_m = axes.T @ np.append(0.5 * (high_m + low_m), np.median(place_m[:, 2]))
    return Viewpoint(eye_m, middle_m, up)


def _up(direction: FloatArray) -> FloatArray:
    """Return the world axis nearest to a direction: cameras look down or up a little."""
    axis = int(np.argmax(np.abs(direction)))
    return np.eye(3)[axis] * (1.0 if direction[axis] >= 0.0 else -1.0)
