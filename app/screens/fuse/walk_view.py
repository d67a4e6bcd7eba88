"""A walking camera as the Fuse screen shows it: poses, keyframes, loops, the map by frame, and pictures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.types import ByteArray, FloatArray, IntArray

MOTIONS = 6
"""Number of independent motions of a camera: three turns and three shifts."""


@dataclass(frozen=True, slots=True)
class LoopView:
    """A registration of two keyframes that closes a loop."""

    source: int
    """Frame number of a keyframe; it is not always the later one."""
    target: int
    moved_m: float
    """Distance of the source's position in the target by this registration from that by tracking alone."""
    turned_rad: float
    """Angle between these two poses."""
    left_m: float
    """The same distance between this registration and the final poses; ``left_rad`` is their angle."""
    left_rad: float
    overlap_share: float
    agreeing_share: float
    """Share of the points that both images show which both measured at about the same depth."""
    held: int
    """Number of the six motions of the camera that the registration fixes."""
    used: bool
    """False if it contradicts the other registrations."""

    @property
    def frames(self) -> tuple[int, int]:
        """Frame numbers of the earlier and the later keyframe."""
        return min(self.source, self.target), max(self.source, self.target)


@dataclass(frozen=True, slots=True)
class Pictures:
    """Small pictures of a recording's frames."""

    frames: IntArray
    """(P,) ascending numbers of the frames that have one."""
    files: tuple[bytes, ...]
    """(P,) JPEG files."""

    def of(self, frame: int) -> bytes | None:
        """Return the JPEG file of a frame, or of the last frame before it that has one; None if none has."""
        at = int(np.searchsorted(self.frames, frame, side="right")) - 1
        return self.files[at] if at >= 0 else None


NO_PICTURES = Pictures(np.zeros(0, int), ())


@dataclass(frozen=True)
class WalkView:
    """A recording after tracking, of F frames, small enough for a browser."""

    times_s: FloatArray
    """(F,) from the first frame on."""
    T_world_camera: FloatArray
    """(F, 4, 4) final poses; NaN where the camera was lost."""
    T_world_tracked: FloatArray
    """(F, 4, 4) poses by tracking alone."""
    keyframes: tuple[int, ...]
    loops: tuple[LoopView, ...]
    """By how far they moved the camera, farthest first; those that contradict come last."""
    lost: tuple[tuple[int, int], ...]
    """First and last frame of each span without poses."""
    path_m: float
    points_m: FloatArray
    """(N, 3) float32 points of the map, ordered by the frame that measured each first."""
    colors: ByteArray
    """(N, 3) RGB."""
    until: IntArray
    """(F,) number of these points that each frame and those before it measured."""
    spacing_m: float
    """Approximate distance between neighbouring points."""
    map_points: int
    """Points of the whole map."""
    fov_rad: float
    """Vertical field of view."""
    aspect: float
    """Width over height of an image."""

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.times_s)

    @property
    def lost_frames(self) -> int:
        """Number of frames without a pose."""
        return sum(last - first + 1 for first, last in self.lost)

    @cached_property
    def drift_m(self) -> FloatArray:
        """(F,) distance between the position by tracking alone and the final one; NaN where it was lost."""
        apart: FloatArray = np.linalg.norm(self.tracked_m - self.at_m, axis=1)
        return apart

    @property
    def at_m(self) -> FloatArray:
        """(F, 3) final positions."""
        return self.T_world_camera[:, :3, 3]

    @property
    def tracked_m(self) -> FloatArray:
        """(F, 3) positions by tracking alone."""
        return self.T_world_tracked[:, :3, 3]

    @property
    def times_ns(self) -> NDArray[np.int64]:
        """(F,) times in nanoseconds."""
        return np.rint(1e9 * self.times_s).astype(np.int64)

    @property
    def used_loops(self) -> int:
        """Number of loops that do not contradict the others."""
        return sum(loop.used for loop in self.loops)

    @property
    def last(self) -> int:
        """Number of the last frame with a pose."""
        return int(np.flatnonzero(np.isfinite(self.drift_m))[-1])

    def frame_at(self, t_ns: int) -> int:
        """Return the frame at a time: the last one taken by then."""
        return max(int(np.searchsorted(self.times_ns, t_ns, side="right")) - 1, 0)
