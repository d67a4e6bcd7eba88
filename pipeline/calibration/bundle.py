"""Bundle adjustment of lenses and poses to all sightings of a board (Triggs et al., "Bundle adjustment: a
modern synthesis", 2000), with dense normal equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.calibration.lens import FREE, Optics
from pipeline.kernels.geometry import apply, rigid, rotation_exp
from pipeline.types import FloatArray, IntArray

STEPS = 60
LITTLE = 1e-10
"""Least relative decrease of the squared error for another step."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """Image points of the board in one camera at one moment."""

    camera: int
    moment: int
    points_px: FloatArray
    """(N, 2)"""
    board_m: FloatArray
    """(N, 3) the same points on the board."""


@dataclass(frozen=True, slots=True)
class Bundle:
    """Cameras and boards in the frame of the first camera."""

    optics: tuple[Optics, ...]
    """Lens of every camera."""
    T_camera_first: tuple[FloatArray, ...]
    """(4, 4) pose of every camera; the first is the identity."""
    T_first_board: tuple[FloatArray, ...]
    """(4, 4) pose of the board at every moment."""

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of parameters of the cameras except the first, of the boards, and of each lens."""
        lenses = (len(FREE[one.lens]) for one in self.optics)
        return 6 * (len(self.optics) - 1), 6 * len(self.T_first_board), *lenses

    def T_camera_board(self, sighting: Sighting) -> FloatArray:
        """Return the (4, 4) pose of a sighting's board in its camera."""
        return self.T_camera_first[sighting.camera] @ self.T_first_board[sighting.moment]

    def residuals_px(self, sightings: Sequence[Sighting]) -> tuple[FloatArray, ...]:
        """Return (N, 2) residuals of each sighting, observed minus predicted."""
        return tuple(
            one.points_px - self.optics[one.camera].project(one.board_m, self.T_camera_board(one))
            for one in sightings
        )

    def moved(self, step: FloatArray) -> Bundle:
        """Return the bundle after small changes, in the order of ``sizes``: rotations (radians), translations
        (metres) of cameras, then of boards, then increments of the lenses' free parameters.
        """
        cameras, boards, *lenses = np.split(step, np.cumsum(self.sizes)[:-1])
        return Bundle(
            tuple(_changed(one, change) for one, change in zip(self.optics, lenses, strict=True)),
            (self.T_camera_first[0], *_moved(self.T_camera_first[1:], cameras)),
            _moved(self.T_first_board, boards),
        )


@dataclass(frozen=True, slots=True)
class Adjusted:
    """The optimal bundle and its uncertainty."""

    bundle: Bundle
    residuals_px: tuple[FloatArray, ...]
    """(N, 2) residuals of each sighting, observed minus predicted."""
    camera_covariance: FloatArray
    """(6 (C - 1), 6 (C - 1)) covariance of rotation and translation of all cameras except the first."""
    lens_covariances: tuple[FloatArray, ...]
    """(P, P) covariance of the free parameters of every lens."""


def adjust(sightings: Sequence[Sighting], start: Bundle) -> Adjusted:
    """Find the bundle near ``start`` with the least squared image distances (Levenberg, Marquardt).

    The lenses are free too. Fixed at the calibration of each camera alone, they would leave more than twice
    the error in the cameras' poses (tests/pipeline/calibration/test_rig.py).

    Args:
        sightings: sightings of all cameras, which shared moments must link.
        start: bundle near the solution.

    Raises:
        np.linalg.LinAlgError: the sightings do not determine the bundle.
    """
    bundle, system = _nearest(sightings, start, slice(None))
    scale = 1.0 / np.sqrt(np.diag(system.normal))
    spread = np.outer(scale, scale) * np.linalg.pinv(system.normal * np.outer(scale, scale), hermitian=True)
    freedom = max(system.coordinates - len(system.normal), 1)
    covariance = system.squares / freedom * spread
    ends = np.cumsum(bundle.sizes)
    cameras, _, *lenses = (
        covariance[end - size : end, end - size : end] for end, size in zip(ends, bundle.sizes, strict=True)
    )
    return Adjusted(bundle, bundle.residuals_px(sightings), cameras, tuple(lenses))


def place_boards(sightings: Sequence[Sighting], start: Bundle) -> Bundle:
    """Adjust the boards' poses to all sightings, with cameras and lenses fixed."""
    cameras, boards, *_ = start.sizes
    return _nearest(sightings, start, slice(cameras, cameras + boards))[0]


def _nearest(sightings: Sequence[Sighting], start: Bundle, free: slice) -> tuple[Bundle, _System]:
    """Return the bundle that is optimal in the ``free`` parameters, with its normal equations."""
    bundle, system = start, _System(sightings, start)
    damping = 1e-3
    for _ in range(STEPS):
        step = np.zeros(len(system.pull))
        step[free] = np.linalg.solve(system.damped(damping)[free, free], system.pull[free])
        nearer = bundle.moved(step)
        nearer_system = _System(sightings, nearer)
        fallen = system.squares - nearer_system.squares
        if fallen >= 0.0:
            bundle, system, damping = nearer, nearer_system, 0.1 * damping
        else:
            damping *= 10.0
        if abs(fallen) <= LITTLE * system.squares:
            break
    return bundle, system


class _System:
    """Normal equations of a bundle."""

    def __init__(self, sightings: Sequence[Sighting], bundle: Bundle) -> None:
        size = sum(bundle.sizes)
        self.normal, self.pull = np.zeros((size, size)), np.zeros(size)
        self.squares, self.coordinates = 0.0, 0
        for one in sightings:
            J, off_px = _linearised(one, bundle)
            at = _columns(one, bundle)
            J = J[:, -len(at) :]
            self.normal[np.ix_(at, at)] += J.T @ J
            self.pull[at] += J.T @ off_px
            self.squares += float(off_px @ off_px)
            self.coordinates += len(off_px)

    def damped(self, damping: float) -> FloatArray:
        """Return the normal matrix with its diagonal multiplied by 1 + ``damping``."""
        return self.normal + damping * np.diag(np.diag(self.normal))


def _columns(sighting: Sighting, bundle: Bundle) -> IntArray:
    """Return the parameters on which a sighting depends: of camera (none for the first), board and lens."""
    ends = np.cumsum(bundle.sizes)
    camera = 6 * (sighting.camera - 1) + np.arange(6 if sighting.camera else 0)
    board = ends[0] + 6 * sighting.moment + np.arange(6)
    lens = np.arange(ends[1 + sighting.camera], ends[2 + sighting.camera])
    return np.concatenate([camera, board, lens])


def _linearised(sighting: Sighting, bundle: Bundle) -> tuple[FloatArray, FloatArray]:
    """Return (2 N, 12 + P) derivatives by camera, board and lens, and (2 N,) observed minus predicted."""
    T_camera_first = bundle.T_camera_first[sighting.camera]
    first_m = apply(bundle.T_first_board[sighting.moment], sighting.board_m)
    linear = bundle.optics[sighting.camera].linearised(first_m, T_camera_first)
    by_camera_m = linear.by_pose[:, 3:]
    by_first_m = by_camera_m @ T_camera_first[:3, :3]
    camera_m, first_m = (np.repeat(points, 2, axis=0) for points in (apply(T_camera_first, first_m), first_m))
    turns = np.cross(camera_m, by_camera_m), np.cross(first_m, by_first_m)
    J = np.hstack([turns[0], by_camera_m, turns[1], by_first_m, linear.by_lens])
    return J, (sighting.points_px - linear.points_px).ravel()


def _moved(poses: Sequence[FloatArray], step: FloatArray) -> tuple[FloatArray, ...]:
    motions = step.reshape(-1, 6)
    return tuple(rigid(rotation_exp(m[:3]), m[3:]) @ T for m, T in zip(motions, poses, strict=True))


def _changed(optics: Optics, change: FloatArray) -> Optics:
    matrix, distortion = optics.matrix.copy(), optics.distortion.copy()
    matrix[[0, 1, 0, 1], [0, 1, 2, 2]] += change[:4]
    distortion[: len(change) - 4] += change[4:]
    return Optics(optics.lens, matrix, distortion)
