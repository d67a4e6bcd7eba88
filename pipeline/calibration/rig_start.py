"""Initial poses of cameras: cameras that see the board together are linked, and boards without a mark are
oriented consistently (SPEC 1.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.bundle import Bundle, Sighting
from pipeline.calibration.estimate import View, place, rms_px
from pipeline.calibration.lens import Optics
from pipeline.kernels.geometry import apply, inverse, rotation_angle_rad
from pipeline.types import FloatArray

MOST_TRIED = 12
"""Largest number of moments of which each gives a relative pose of two cameras to test on all their common
moments."""
APART_RAD = np.radians(20.0)
"""Difference of rotation above which two poses mean different orientations of the board."""
LOST_PX = 20.0
"""Median RMS above which no orientation of the board explains the views."""
TELLING = 1.5
"""Least ratio of another orientation's error to the best one's for a decision."""


@dataclass(frozen=True, slots=True)
class Look:
    """A sighting with the board's pose from its image alone."""

    sighting: Sighting
    T_camera_board: FloatArray
    """(4, 4) pose of the board from this image."""
    oriented: bool
    """Whether a mark shows the orientation of the board."""


def look(sighting: Sighting, optics: Optics, oriented: bool) -> Look:
    """Estimate the pose of the board from one image.

    Raises:
        ReconstructionError: no pose explains the image.
    """
    view = View(f"moment {sighting.moment}", sighting.points_px, sighting.board_m)
    placed = place(view, optics.matrix, optics.distortion, optics.lens)
    return Look(sighting, placed.T_camera_board, oriented)


def start(
    looks: Sequence[Look], optics: Sequence[Optics], names: Sequence[str], turns: Sequence[FloatArray]
) -> tuple[Bundle, tuple[Sighting, ...]]:
    """Estimate approximate poses of cameras and boards; give the board one orientation at each moment.

    Cameras are linked in the order of the number of moments that they share with linked ones.

    Args:
        looks: sightings of all cameras; their moments are numbered from 0 without gaps.
        optics: lens of every camera.
        names: names of the cameras, for error messages.
        turns: (4, 4) motions after which the board looks the same, the identity first.

    Raises:
        InputError: no shared moments link some cameras.
        ReconstructionError: the orientation of the boards is undetermined.
    """
    count = len(optics)
    of: list[dict[int, Look]] = [
        {one.sighting.moment: one for one in looks if one.sighting.camera == camera}
        for camera in range(count)
    ]
    T_camera_first = {0: np.eye(4)}
    while len(T_camera_first) < count:
        links = [(a, b) for a in T_camera_first for b in range(count) if b not in T_camera_first]
        a, b = max(links, key=lambda link: len(of[link[0]].keys() & of[link[1]].keys()))
        pairs = [(of[a][moment], of[b][moment]) for moment in sorted(of[a].keys() & of[b].keys())]
        if not pairs:
            raise InputError(_unlinked(sorted(T_camera_first), names))
        T_a_b = _linked(pairs, optics[b], turns, f"{names[a]} and {names[b]}")
        T_camera_first[b] = inverse(T_a_b) @ T_camera_first[a]
    cameras = [T_camera_first[camera] for camera in range(count)]
    moments = 1 + max(one.sighting.moment for one in looks)
    boards, sightings = [], []
    for moment in range(moments):
        T_first_board, turned = _agreed([one[moment] for one in of if moment in one], optics, cameras, turns)
        boards.append(T_first_board)
        sightings += turned
    return Bundle(tuple(optics), tuple(cameras), tuple(boards)), tuple(sightings)


def _unlinked(linked: Sequence[int], names: Sequence[str]) -> str:
    others = " and ".join(name for index, name in enumerate(names) if index not in linked)
    never = "never sees" if len(names) - len(linked) == 1 else "never see"
    those = " or ".join(names[index] for index in linked)
    return (
        f"{others} {never} the board at a moment at which {those} does; hold it where their views overlap, "
        "and give images of the same moment the same number"
    )


def _linked(
    pairs: Sequence[tuple[Look, Look]], optics_b: Optics, turns: Sequence[FloatArray], who: str
) -> FloatArray:
    """Return the (4, 4) T_a_b, of one moment and orientation, that explains all moments best.

    Raises:
        ReconstructionError: another orientation explains them nearly as well.
    """
    every = -(-len(pairs) // MOST_TRIED)
    tried = [
        a.T_camera_board @ turn @ inverse(b.T_camera_board)
        for a, b in pairs[::every]
        for turn in _possible((a, b), turns)
    ]
    errors_px = np.array([_error_px(T_a_b, pairs, optics_b, turns) for T_a_b in tried])
    best = tried[int(errors_px.argmin())]
    apart = np.array([rotation_angle_rad(T[:3, :3].T @ best[:3, :3]) > APART_RAD for T in tried])
    decided = all(a.oriented and b.oriented for a, b in pairs) or errors_px.min() > LOST_PX
    if not decided and (errors_px[apart] < TELLING * errors_px.min()).any():
        raise ReconstructionError(
            f"{who} see the board together too rarely to tell which way up it was held; show it to both more "
            "often, tilted differently, or use a board with a mark (packetmesh target)"
        )
    return best


def _possible(seen: Sequence[Look], turns: Sequence[FloatArray]) -> Sequence[FloatArray]:
    """Return the possible rotations of the board between these looks."""
    return turns[:1] if all(one.oriented for one in seen) else turns


def _error_px(
    T_a_b: FloatArray, pairs: Sequence[tuple[Look, Look]], optics_b: Optics, turns: Sequence[FloatArray]
) -> float:
    """Return the median over moments of camera b's RMS, pixels, with the board's pose from camera a."""
    errors = [
        min(
            _off_px(b.sighting, optics_b, inverse(T_a_b) @ a.T_camera_board @ turn)
            for turn in _possible((a, b), turns)
        )
        for a, b in pairs
    ]
    return float(np.median(errors))


def _off_px(sighting: Sighting, optics: Optics, T_camera_board: FloatArray) -> float:
    return rms_px(sighting.points_px - optics.project(sighting.board_m, T_camera_board))


def _agreed(
    seen: Sequence[Look],
    optics: Sequence[Optics],
    T_camera_first: Sequence[FloatArray],
    turns: Sequence[FloatArray],
) -> tuple[FloatArray, list[Sighting]]:
    """Return (4, 4) T_first_board of a moment, and its sightings with one orientation of the board."""
    best: tuple[float, FloatArray, list[Sighting]] | None = None
    for anchor in [one for one in seen if one.oriented] or seen:
        T_first_board = inverse(T_camera_first[anchor.sighting.camera]) @ anchor.T_camera_board
        turned, squares = [], 0.0
        for one in seen:
            camera = one.sighting.camera
            T = T_camera_first[camera] @ T_first_board
            errors_px = [_off_px(one.sighting, optics[camera], T @ turn) for turn in _possible([one], turns)]
            turn = turns[int(np.argmin(errors_px))]
            turned.append(replace(one.sighting, board_m=apply(turn, one.sighting.board_m)))
            squares += min(errors_px) ** 2
        if best is None or squares < best[0]:
            best = squares, T_first_board, turned
    assert best is not None
    return best[1:]
