"""Poses that come with a recording, compared with the motion that its depth shows.

Programs write poses from camera to world or from world to camera, with the camera's axes of OpenCV (y down, z
forward) or of OpenGL (y up, z backward). Files rarely say which.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import inverse, rotation_angle_rad
from pipeline.recording.recording import Recording
from pipeline.recording.tracking import TRACKING, registered
from pipeline.registration.organised import organised
from pipeline.types import FloatArray

PAIRS, APART = 12, 3
"""Most pairs of frames that are compared, and their distance in frames."""
LEAST_PAIRS = 3
LEAST_M, LEAST_DEG = 0.01, 1.0
"""Pairs that moved by less than both say nothing."""
NEAR_M, NEAR_DEG = 0.03, 2.0
"""Median differences of poses that agree with the depth."""
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
CONVENTIONS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "from camera to world": lambda T: T,
    "from camera to world with OpenGL's axes": lambda T: T @ OPENGL,
    "from world to camera": inverse,
    "from world to camera with OpenGL's axes": lambda T: inverse(T) @ OPENGL,
}
"""What a written pose means, and how it becomes one from camera to world with OpenCV's axes."""


@dataclass(frozen=True, slots=True)
class Given:
    """Poses to start from."""

    T_world_camera: tuple[FloatArray, ...] | None
    """(4, 4) poses of the colour camera; None if there are none or they contradict the depth."""
    notes: tuple[str, ...] = ()


def checked_poses(recording: Recording) -> Given:
    """Return a recording's poses in the convention that fits its depth, or none if no convention fits."""
    written = recording.T_world_camera
    if written is None:
        return Given(None)
    seen = _motions(recording)
    if len(seen) < LEAST_PAIRS:
        return Given(written)
    errors = {name: _error(seen, [read(T) for T in written]) for name, read in CONVENTIONS.items()}
    best = min(errors, key=lambda name: errors[name][0] / NEAR_M + errors[name][1] / NEAR_DEG)
    expected, (shift_m, turn_deg) = next(iter(CONVENTIONS)), errors[best]
    if _agrees(errors[expected]):
        return Given(written)
    if _agrees(errors[best]):
        read = CONVENTIONS[best]
        note = f"The poses of {recording.name} fit its depth only as transforms {best}: they were taken so"
        return Given(tuple(read(T) for T in written), (note,))
    note = (
        f"The poses of {recording.name} contradict its depth, by {100.0 * shift_m:.0f} cm and "
        f"{turn_deg:.0f}° in {APART} frames (median): they were not used"
    )
    return Given(None, (note,))


def _agrees(error: tuple[float, float]) -> bool:
    return error[0] <= NEAR_M and error[1] <= NEAR_DEG


def _motions(recording: Recording) -> list[tuple[int, int, FloatArray]]:
    """Return pairs of frames and the colour camera's motion between them, as far as the depth shows one."""
    found: list[tuple[int, int, FloatArray]] = []
    last = len(recording.times_s) - APART
    for first in np.unique(np.linspace(0, last - 1, PAIRS).round().astype(int)) if last > 0 else ():
        views = [recording.view(k) for k in (int(first), int(first) + APART)]
        target, source = (organised(view.depth, view.camera) for view in views)
        if not len(target) or not len(source):
            continue
        one = registered(source, target, TRACKING, np.eye(4))
        if one is not None and one.holds:
            T = views[0].T_color_depth @ one.T_target_source @ inverse(views[1].T_color_depth)
            if np.linalg.norm(T[:3, 3]) >= LEAST_M or _turn_deg(T) >= LEAST_DEG:
                found.append((int(first), int(first) + APART, T))
    return found


def _error(seen: list[tuple[int, int, FloatArray]], T_world_camera: list[FloatArray]) -> tuple[float, float]:
    """Return the median difference of poses' motions from those seen, metres and degrees."""
    apart = [inverse(T) @ inverse(T_world_camera[i]) @ T_world_camera[j] for i, j, T in seen]
    shifts_m = [float(np.linalg.norm(T[:3, 3])) for T in apart]
    return float(np.median(shifts_m)), float(np.median([_turn_deg(T) for T in apart]))


def _turn_deg(T: FloatArray) -> float:
    return float(np.degrees(rotation_angle_rad(T[:3, :3])))
