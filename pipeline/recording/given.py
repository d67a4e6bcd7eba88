"""Poses that come with a recording, compared with the motion that its depth shows.

Programs write poses from camera to world or from world to camera, with the camera's axes of OpenCV (y down, z
forward) or of OpenGL (y up, z backward). Files rarely say which.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import inverse, rotation_angle_rad
from pipeline.recording.recording import Recording, spread
from pipeline.recording.tracking import TRACKING, registered
from pipeline.registration.organised import organised
from pipeline.types import FloatArray

PAIRS, APART = 12, 3
"""Most pairs of frames that are compared, and their distance in frames."""
LEAST_PAIRS = 3
"""With fewer pairs, poses are not compared."""
LEAST_M, LEAST_DEG = 0.01, 1.0
"""Pairs whose motion is below both are ignored."""
NEAR_M, NEAR_DEG, NEAR_SHARE = 0.01, 0.5, 0.25
"""Largest median difference of poses that agree with the depth; this share of the motion is added."""
BETTER = 0.5
"""Another convention is taken if its differences are below this share of the expected one's."""
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
CONVENTIONS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "from camera to world": lambda T: T,
    "from camera to world with OpenGL's axes": lambda T: T @ OPENGL,
    "from world to camera": inverse,
    "from world to camera with OpenGL's axes": lambda T: inverse(T) @ OPENGL,
}
"""Possible meanings of a written pose, each with its conversion to T_world_camera with OpenCV's axes."""


@dataclass(frozen=True, slots=True)
class Given:
    """Poses to start from."""

    T_world_camera: tuple[FloatArray | None, ...] | None
    """(4, 4) poses of the colour camera, None where unknown; None if there are none or they contradict the
    depth."""
    notes: tuple[str, ...] = ()


def checked_poses(recording: Recording) -> Given:
    """Return a recording's poses in the convention that agrees with its depth; none if no convention does.

    Where fewer than ``LEAST_PAIRS`` pairs of frames can be compared, the poses are returned as they are.
    """
    written = recording.T_world_camera
    if written is None:
        return Given(None)
    seen = _motions(recording, written)
    if len(seen) < LEAST_PAIRS:
        note = (
            f"The poses of {recording.name} were not compared with its depth: the camera moves too little "
            "or too much from frame to frame"
        )
        return Given(written, (note,))
    apart = {name: _apart(seen, _read(written, read)) for name, read in CONVENTIONS.items()}
    limit = _limit(seen)
    size = {name: float(np.sum(one / limit)) for name, one in apart.items()}
    best, expected = min(size, key=lambda name: size[name]), next(iter(CONVENTIONS))
    best = best if size[best] < BETTER * size[expected] else expected
    if (apart[best] <= limit).all():
        if best == expected:
            return Given(written)
        note = f"The poses of {recording.name} agree with its depth only if read as {best}: they were read so"
        return Given(_read(written, CONVENTIONS[best]), (note,))
    shift_m, turn_deg = apart[best]
    note = (
        f"The poses of {recording.name} contradict its depth, by {100.0 * shift_m:.0f} cm and "
        f"{turn_deg:.0f}° in {APART} frames (median): they were not used"
    )
    return Given(None, (note,))


def _read(
    written: Sequence[FloatArray | None], read: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray | None, ...]:
    """Return written poses in a convention."""
    return tuple(None if T is None else read(T) for T in written)


def _limit(seen: Sequence[tuple[int, int, FloatArray]]) -> FloatArray:
    """Return (2,) largest median differences, metres and degrees, of poses that agree with motions."""
    motion = _size([T for _, _, T in seen])
    return np.array([NEAR_M, NEAR_DEG]) + NEAR_SHARE * motion


def _motions(recording: Recording, written: Sequence[FloatArray | None]) -> list[tuple[int, int, FloatArray]]:
    """Return (i, j, (4, 4) T_i_j of the colour camera) of frames with poses whose depth images register."""
    found: list[tuple[int, int, FloatArray]] = []
    firsts = [k for k, T in enumerate(written[:-APART]) if T is not None and written[k + APART] is not None]
    for first in spread(firsts, PAIRS):
        views = [recording.view(k) for k in (first, first + APART)]
        target, source = (organised(view.depth, view.camera) for view in views)
        if not len(target) or not len(source):
            continue
        one = registered(source, target, TRACKING, np.eye(4))
        if one is not None and one.holds:
            T = views[0].T_color_depth @ one.T_target_source @ inverse(views[1].T_color_depth)
            if np.linalg.norm(T[:3, 3]) >= LEAST_M or _turn_deg(T) >= LEAST_DEG:
                found.append((first, first + APART, T))
    return found


def _apart(
    seen: Sequence[tuple[int, int, FloatArray]], T_world_camera: Sequence[FloatArray | None]
) -> FloatArray:
    """Return (2,) median differences of poses' motions from those seen, metres and degrees."""
    apart = []
    for i, j, T in seen:
        one, other = T_world_camera[i], T_world_camera[j]
        assert one is not None
        assert other is not None
        apart.append(inverse(T) @ inverse(one) @ other)
    return _size(apart)


def _size(motions: Sequence[FloatArray]) -> FloatArray:
    """Return (2,) median shift, metres, and turn, degrees, of (4, 4) motions."""
    sizes = [(np.linalg.norm(T[:3, 3]), _turn_deg(T)) for T in motions]
    median: FloatArray = np.median(np.array(sizes), axis=0)
    return median


def _turn_deg(T: FloatArray) -> float:
    return float(np.degrees(rotation_angle_rad(T[:3, :3])))
