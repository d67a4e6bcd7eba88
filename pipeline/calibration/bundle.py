"""Poses of cameras and boards that best explain all sightings together: a bundle adjustment (Triggs et al.,
"Bundle adjustment: a modern synthesis", 2000), small enough for dense normal equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.calibration.lens import FREE, Optics
from pipeline.geometry import apply, rigid, rotation_exp
from pipeline.types import FloatArray

STEPS = 50
SMALL = 1e-9
"""Radians or metres: a step after which nothing moves any more."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """The board as one camera saw it at one moment."""

    camera: int
    moment: int
    points_px: FloatArray
    """(N, 2)"""
    board_m: FloatArray
    """(N, 3) the same points on the board."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Cameras and boards in the frame of the first camera."""

    T_camera_first: tuple[FloatArray, ...]
    """(4, 4) of every camera; the first is the identity."""
    T_first_board: tuple[FloatArray, ...]
    """(4, 4) of every moment."""

    def T_camera_board(self, sighting: Sighting) -> FloatArray:
        """(4, 4) where the camera of a sighting has its board."""
        return self.T_camera_first[sighting.camera] @ self.T_first_board[sighting.moment]

    def moved(self, step: FloatArray) -> Placement:
        """After small motions, (6 (C - 1 + M),): of every camera but the first, then of every board."""
        motions = [rigid(rotation_exp(one[:3]), one[3:]) for one in step.reshape(-1, 6)]
        cameras, boards = self.T_camera_first[1:], self.T_first_board
        motions_of_cameras, motions_of_boards = motions[: len(cameras)], motions[len(cameras) :]
        return Placement(
            (np.eye(4), *(move @ T for move, T in zip(motions_of_cameras, cameras, strict=True))),
            tuple(move @ T for move, T in zip(motions_of_boards, boards, strict=True)),
        )


@dataclass(frozen=True, slots=True)
class Adjusted:
    """The best placement and how sure it is."""

    placement: Placement
    residuals_px: tuple[FloatArray, ...]
    """(N, 2) of each sighting, seen less predicted."""
    covariance: FloatArray
    """(6 (C - 1), 6 (C - 1)) of the motions of all cameras but the first."""


def residuals_px(
    sightings: Sequence[Sighting], optics: Sequence[Optics], placement: Placement
) -> tuple[FloatArray, ...]:
    """(N, 2) of each sighting, seen less predicted."""
    return tuple(
        one.points_px - optics[one.camera].project(one.board_m, placement.T_camera_board(one))
        for one in sightings
    )


def adjust(
    sightings: Sequence[Sighting],
    optics: Sequence[Optics],
    lens_covariances: Sequence[FloatArray],
    start: Placement,
) -> Adjusted:
    """The placement near ``start`` with the least squared distances in the images (Levenberg, Marquardt).

    The lenses stay as they are. What is uncertain about them makes the cameras' poses uncertain, too: the
    error of a lens that was estimated with a free pose for each of its views is, to first order, independent
    of the error that the poses have for a given lens, so that both covariances add.

    Args:
        sightings: of all cameras.
        optics: of every camera.
        lens_covariances: (P, P) of the free parameters of every lens.
        start: near the truth.

    Raises:
        ReconstructionError: the sightings leave a camera free to move.
    """
    placement, system = _nearest(sightings, optics, start, slice(None))
    covariance = _covariance(system, lens_covariances, 6 * (len(placement.T_camera_first) - 1))
    return Adjusted(placement, residuals_px(sightings, optics, placement), covariance)


def place_boards(sightings: Sequence[Sighting], optics: Sequence[Optics], start: Placement) -> Placement:
    """The boards adjusted to all sightings while the cameras stay where they are."""
    boards = slice(6 * (len(start.T_camera_first) - 1), None)
    return _nearest(sightings, optics, start, boards)[0]


def _nearest(
    sightings: Sequence[Sighting], optics: Sequence[Optics], start: Placement, free: slice
) -> tuple[Placement, _System]:
    """The best placement that the free motions lead to, with its normal equations."""
    placement, system = start, _System(sightings, optics, start)
    damping = 1e-3
    for _ in range(STEPS):
        step = np.zeros(len(system.pull))
        step[free] = np.linalg.solve(system.damped(damping)[free, free], system.pull[free])
        nearer = placement.moved(step)
        nearer_system = _System(sightings, optics, nearer)
        if nearer_system.squares <= system.squares:
            placement, system, damping = nearer, nearer_system, 0.1 * damping
        else:
            damping *= 10.0
        if np.abs(step).max() < SMALL:
            break
    return placement, system


class _System:
    """The normal equations of all poses at a placement, and how lenses pull at them."""

    def __init__(self, sightings: Sequence[Sighting], optics: Sequence[Optics], placement: Placement) -> None:
        others = len(placement.T_camera_first) - 1
        size = 6 * (others + len(placement.T_first_board))
        self.normal, self.pull = np.zeros((size, size)), np.zeros(size)
        self.by_lens = [np.zeros((size, len(FREE[one.lens]))) for one in optics]
        self.squares, self.coordinates = 0.0, 0
        for one in sightings:
            J, by_lens, off_px = _linearised(one, optics[one.camera], placement)
            board = 6 * (others + one.moment) + np.arange(6)
            at = np.concatenate([6 * (one.camera - 1) + np.arange(6), board]) if one.camera else board
            J = J if one.camera else J[:, 6:]
            self.normal[np.ix_(at, at)] += J.T @ J
            self.pull[at] += J.T @ off_px
            self.by_lens[one.camera][at] += J.T @ by_lens
            self.squares += float(off_px @ off_px)
            self.coordinates += len(off_px)

    def damped(self, damping: float) -> FloatArray:
        return self.normal + damping * np.diag(np.diag(self.normal))


def _linearised(
    sighting: Sighting, optics: Optics, placement: Placement
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(2 N, 12) by motions of camera and board, (2 N, P) by the lens, and (2 N,) seen less predicted."""
    T_camera_first = placement.T_camera_first[sighting.camera]
    first_m = apply(placement.T_first_board[sighting.moment], sighting.board_m)
    told = optics.linearised(first_m, T_camera_first)
    by_camera_m = told.by_pose[:, 3:]
    by_first_m = by_camera_m @ T_camera_first[:3, :3]
    camera_m, first_m = (np.repeat(points, 2, axis=0) for points in (apply(T_camera_first, first_m), first_m))
    J = np.hstack([np.cross(camera_m, by_camera_m), by_camera_m, np.cross(first_m, by_first_m), by_first_m])
    return J, told.by_lens, (sighting.points_px - told.points_px).ravel()


def _covariance(system: _System, lens_covariances: Sequence[FloatArray], wanted: int) -> FloatArray:
    """(wanted, wanted) of the first motions: of noise in the images and of the lenses."""
    freedom = max(system.coordinates - len(system.normal), 1)
    scale = np.sqrt(np.diag(system.normal))
    if not (scale > 0.0).all() or np.linalg.cond(system.normal / np.outer(scale, scale)) > 1e12:
        raise ReconstructionError(
            "The views leave a camera free to move; take more moments in which cameras see the board together"
        )
    inverse = np.linalg.inv(system.normal)
    covariance = system.squares / freedom * inverse[:wanted, :wanted]
    for by_lens, of_lens in zip(system.by_lens, lens_covariances, strict=True):
        moved = -inverse[:wanted] @ by_lens
        covariance = covariance + moved @ of_lens @ moved.T
    return covariance
