"""Poses that come with a recording, compared with the motion that its depth shows.

Programs write poses from camera to world or from world to camera, with the camera's axes of OpenCV (y down, z
forward), of OpenGL (y up, z backward) or of a robot's body in ROS (x forward, z up), and in metres or smaller
units. Files rarely say which.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import inverse, rigid, rotation_angle_rad
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
NEAR_ONE = 0.1
"""Factors of the positions nearer to 1 (or, as a share, to a unit's) are no other unit (or are this unit)."""
UNITS = {100.0: "centimetres", 1000.0: "millimetres"}
"""Units of positions by their number in a metre."""
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
ROS_BODY = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""(4, 4) pose of OpenCV's axes in those of a body in ROS (REP 103)."""
CONVENTIONS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "from camera to world": lambda T: T,
    "from camera to world with OpenGL's axes": lambda T: T @ OPENGL,
    "from camera to world with the axes of a body in ROS": lambda T: T @ ROS_BODY,
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
    found = _agreeing(recording.name, seen, written)
    if found is not None:
        return found
    factor = _factor(seen, written)
    if factor is None:
        shift_m, turn_deg = _apart(seen, written)
        note = (
            f"The poses of {recording.name} contradict its depth, by {100.0 * shift_m:.0f} cm and "
            f"{turn_deg:.0f}° in {APART} frames (median): they were not used"
        )
        return Given(None, (note,))
    unit = next((one for one in UNITS if abs(factor / one - 1.0) <= NEAR_ONE), None)
    if unit is not None:
        found = _agreeing(recording.name, seen, [_shrunk(T, unit) for T in written], UNITS[unit])
        if found is not None:
            return found
    note = (
        f"The poses of {recording.name} contradict its depth: their camera moves {factor:.3g} times as far "
        "as the depth shows. They were not used; check their unit, and --depth-scale"
    )
    return Given(None, (note,))


def _agreeing(
    name: str,
    seen: Sequence[tuple[int, int, FloatArray]],
    written: Sequence[FloatArray | None],
    unit: str = "metres",
) -> Given | None:
    """Return poses in metres in the convention that agrees with the motions seen; None if none does.

    A convention other than the first is taken if it is better by ``BETTER``. A note says what is not as
    expected: the convention, or the ``unit`` in which the positions were.
    """
    limit = _limit(seen)
    apart = {how: _apart(seen, _read(written, read)) for how, read in CONVENTIONS.items()}
    size = {how: float(np.sum(one / limit)) for how, one in apart.items()}
    best, expected = min(size, key=lambda how: size[how]), next(iter(CONVENTIONS))
    best = best if size[best] < BETTER * size[expected] else expected
    if (apart[best] > limit).any():
        return None
    reading = [] if best == expected else [f"as {best}"]
    reading += [] if unit == "metres" else [f"in {unit}"]
    if not reading:
        return Given(tuple(written))
    how = " and ".join(reading)
    note = f"The poses of {name} agree with its depth only if read {how}: they were read so"
    return Given(_read(written, CONVENTIONS[best]), (note,))


def _factor(
    seen: Sequence[tuple[int, int, FloatArray]], written: Sequence[FloatArray | None]
) -> float | None:
    """Return the factor by which positions are larger than those that the depth shows.

    None if in no convention the poses agree with the depth after a division by it.
    """
    for read in CONVENTIONS.values():
        poses = _read(written, read)
        shifts = [(inverse(_at(poses, i)) @ _at(poses, j), T) for i, j, T in seen]
        shown = [(own[:3, 3], T[:3, 3]) for own, T in shifts if np.linalg.norm(T[:3, 3]) >= LEAST_M]
        if len(shown) < LEAST_PAIRS:
            continue
        factor = float(np.median([own_m @ true_m / (true_m @ true_m) for own_m, true_m in shown]))
        if factor <= 0.0 or abs(factor - 1.0) <= NEAR_ONE:
            continue
        off = [np.linalg.norm(own_m / factor - true_m) / np.linalg.norm(true_m) for own_m, true_m in shown]
        turned_deg = [_turn_deg(inverse(T) @ own) for own, T in shifts]
        if np.median(off) <= NEAR_SHARE and np.median(turned_deg) <= _limit(seen)[1]:
            return factor
    return None


def _at(poses: Sequence[FloatArray | None], index: int) -> FloatArray:
    """Return the pose of a frame that has one."""
    T = poses[index]
    assert T is not None
    return T


def _shrunk(T: FloatArray | None, factor: float) -> FloatArray | None:
    """Return a pose with its position divided by ``factor``."""
    return None if T is None else rigid(T[:3, :3], T[:3, 3] / factor)


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
    return _size([inverse(T) @ inverse(_at(T_world_camera, i)) @ _at(T_world_camera, j) for i, j, T in seen])


def _size(motions: Sequence[FloatArray]) -> FloatArray:
    """Return (2,) median shift, metres, and turn, degrees, of (4, 4) motions."""
    sizes = [(np.linalg.norm(T[:3, 3]), _turn_deg(T)) for T in motions]
    median: FloatArray = np.median(np.array(sizes), axis=0)
    return median


def _turn_deg(T: FloatArray) -> float:
    return float(np.degrees(rotation_angle_rad(T[:3, :3])))
