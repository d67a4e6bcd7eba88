"""A camera from views of a board: the lens, how sure it is, and how well it predicts views it has not seen
(SPEC 1.1, 1.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import get_args

import cv2
import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.fisheye import estimate_fisheye
from pipeline.calibration.lens import FLAGS, FREE, NAMES, Optics
from pipeline.config import Lens
from pipeline.kernels.geometry import rigid
from pipeline.types import FloatArray

LEAST_VIEWS = 3
LEAST_POINTS = 4
"""Of a view that is placed."""
SETTLE_STEPS = 30
MOST_RMS_SHARE = 0.1
"""RMS over the image's longer side, from which on the numbers say nothing of the camera."""
LEAST_INFORMATION = 1e-14
"""Of a combination of parameters, over that of each alone: below it there is but rounding."""
LEAST_TILT_DEG = 5.0
"""Between the two views that differ most: views of a board held ever alike fit many lenses."""
Z95 = 1.959964


@dataclass(frozen=True, slots=True)
class View:
    """The board as one image shows it."""

    name: str
    points_px: FloatArray
    """(N, 2)"""
    board_m: FloatArray
    """(N, 3) the same points on the board."""


@dataclass(frozen=True, slots=True)
class FittedView:
    """A view, where its board is, and how far the lens is from explaining it."""

    name: str
    T_camera_board: FloatArray
    """(4, 4)"""
    residuals_px: FloatArray
    """(N, 2) seen less predicted."""
    points_px: FloatArray
    """(N, 2) seen."""
    board_m: FloatArray
    """(N, 3) the same points on the board."""

    @property
    def rms_px(self) -> float:
        """Root mean square distance of a point, as OpenCV has it."""
        return rms_px(self.residuals_px)


@dataclass(frozen=True, slots=True)
class Calibration:
    """A lens with its uncertainty."""

    lens: Lens
    size_px: tuple[int, int]
    """Width and height of the images."""
    matrix: FloatArray
    """(3, 3) K."""
    distortion: FloatArray
    """OpenCV's vector: k1, k2, p1, p2, k3 and, of a rational lens, k4, k5, k6; of a fisheye k1 to k4."""
    names: tuple[str, ...]
    """Of the parameters that were estimated."""
    covariance: FloatArray
    """(P, P) of them."""
    views: tuple[FittedView, ...]

    @property
    def optics(self) -> Optics:
        """The lens alone."""
        return Optics(self.lens, self.matrix, self.distortion)

    @property
    def rms_px(self) -> float:
        """Over all points of all views."""
        return rms_px(np.concatenate([view.residuals_px for view in self.views]))

    @property
    def parameters(self) -> dict[str, float]:
        """All by name."""
        k, lens = self.matrix, self.distortion.ravel().tolist()
        names = FREE["fisheye"] if self.lens == "fisheye" else NAMES
        return dict(zip(names, (k[0, 0], k[1, 1], k[0, 2], k[1, 2], *lens), strict=False))

    @property
    def standard_errors(self) -> dict[str, float]:
        """Of those that were estimated."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals."""
        values = self.parameters
        errors = self.standard_errors.items()
        return {name: (values[name] - Z95 * error, values[name] + Z95 * error) for name, error in errors}


def rms_px(residuals_px: FloatArray) -> float:
    """Root mean square length of (N, 2) residuals."""
    return float(np.sqrt((residuals_px**2).sum(axis=1).mean()))


def coordinate_sd_px(views: Sequence[FittedView], lens: Lens) -> float:
    """Standard deviation of a coordinate of a point, from what is left after lens and poses are fitted."""
    every = np.concatenate([view.residuals_px for view in views])
    freedom = max(every.size - 6 * len(views) - len(FREE[lens]), 1)
    return float(np.sqrt((every**2).sum() / freedom))


def calibrate(views: Sequence[View], size_px: tuple[int, int], lens: Lens = "thesis") -> Calibration:
    """Estimate a camera.

    Args:
        views: at least three, tilted differently.
        size_px: width and height of all images.
        lens: which distortions it may have.

    Raises:
        InputError: too few views, or another lens.
        ReconstructionError: the views do not determine the lens.
    """
    if lens not in get_args(Lens):
        raise InputError(f"There is no lens '{lens}'; try one of {', '.join(get_args(Lens))}")
    if len(views) < LEAST_VIEWS:
        raise InputError(
            f"The board was found in {len(views)} images, and it takes {LEAST_VIEWS}, tilted differently; "
            "take more"
        )
    try:
        optics, poses = _fisheye(views, size_px) if lens == "fisheye" else _brown(views, size_px, lens)
    except cv2.error:
        raise ReconstructionError(_UNEXPLAINED) from None
    if not (np.isfinite(optics.matrix).all() and np.isfinite(optics.distortion).all()):
        raise ReconstructionError(_DEGENERATE)
    if _tilt_deg(poses) < LEAST_TILT_DEG:
        raise ReconstructionError(_DEGENERATE)
    found = calibration_of(views, poses, optics, size_px)
    if not found.rms_px < MOST_RMS_SHARE * max(size_px):
        raise ReconstructionError(_UNEXPLAINED)
    return found


def calibration_of(
    views: Sequence[View], poses: Sequence[FloatArray], optics: Optics, size_px: tuple[int, int]
) -> Calibration:
    """The record of a lens and of (4, 4) poses that were estimated together."""
    fitted = tuple(_fitted(view, pose, optics) for view, pose in zip(views, poses, strict=True))
    covariance = coordinate_sd_px(fitted, optics.lens) ** 2 * inverted(information(fitted, optics))
    return Calibration(
        optics.lens, size_px, optics.matrix, optics.distortion, FREE[optics.lens], covariance, fitted
    )


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV calibrates in one thread: of several it adds up the views as they end, and the last bits differ
    from one time to the next. One is as fast.
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def _brown(views: Sequence[View], size_px: tuple[int, int], lens: Lens) -> tuple[Optics, list[FloatArray]]:
    """OpenCV's lens, and the boards' poses."""
    with one_thread():
        _, matrix, distortion, turns, moves, *_ = cv2.calibrateCameraExtended(
            [view.board_m.astype(np.float32) for view in views],
            [view.points_px.astype(np.float32).reshape(-1, 1, 2) for view in views],
            size_px,
            None,
            None,
            flags=FLAGS[lens],
        )
    poses = [pose_of(turn, move) for turn, move in zip(turns, moves, strict=True)]
    return Optics(lens, matrix, distortion.ravel()), poses


def _fisheye(views: Sequence[View], size_px: tuple[int, int]) -> tuple[Optics, list[FloatArray]]:
    """A fisheye lens, and the boards' poses."""

    def placed(row: int, optics: Optics) -> FloatArray | None:
        try:
            return place(views[row], optics.matrix, optics.distortion, "fisheye").T_camera_board
        except ReconstructionError:
            return None

    found = estimate_fisheye([(view.board_m, view.points_px) for view in views], size_px, placed)
    if found is None:
        raise ReconstructionError(_UNEXPLAINED)
    return found


_DEGENERATE = (
    f"All views show the board from nearly the same direction (within {LEAST_TILT_DEG:g}°), which many "
    "lenses explain alike; tilt it by 20 to 40° to different sides"
)
_UNEXPLAINED = (
    "No lens of this kind explains the views; check columns and rows, tilt the board by 20 to 40° to "
    "different sides, or try another lens"
)


def pose_of(turn: FloatArray, move: FloatArray) -> FloatArray:
    """(4, 4) of OpenCV's rotation vector and translation."""
    return rigid(cv2.Rodrigues(np.asarray(turn))[0], np.ravel(move))


def residuals(
    view: View,
    T_camera_board: FloatArray,
    matrix: FloatArray,
    distortion: FloatArray,
    lens: Lens = "thesis",
) -> FloatArray:
    """(N, 2) seen less predicted."""
    return view.points_px - Optics(lens, matrix, distortion).project(view.board_m, T_camera_board)


def place(view: View, matrix: FloatArray, distortion: FloatArray, lens: Lens = "thesis") -> FittedView:
    """Where the board of a view is that had no part in the lens.

    Raises:
        ReconstructionError: no pose explains it.
    """
    optics = Optics(lens, matrix, distortion)
    rays = optics.rays(view.points_px)
    known = np.isfinite(rays[:, 2])
    found = False
    if known.sum() >= LEAST_POINTS:
        flat = rays[known, :2] / rays[known, 2:]
        with suppress(cv2.error):
            found, turn, move = cv2.solvePnP(view.board_m[known], flat, np.eye(3), None)
    if not found:
        raise ReconstructionError(f"No place of the board explains {view.name}; is it the same board?")
    return _fitted(view, settle(view.board_m, view.points_px, pose_of(turn, move), optics), optics)


def settle(
    points_m: FloatArray, points_px: FloatArray, T_camera_points: FloatArray, optics: Optics
) -> FloatArray:
    """(4, 4) pose near a given one, from which (N, 3) points are seen nearest to (N, 2) pixels.

    Levenberg and Marquardt's method on the distances in the image.
    """
    pose = np.concatenate([cv2.Rodrigues(T_camera_points[:3, :3])[0].ravel(), T_camera_points[:3, 3]])
    damping, told = 1e-3, optics.linearised(points_m, T_camera_points)
    off_px = (points_px - told.points_px).ravel()
    for _ in range(SETTLE_STEPS):
        normal = told.by_pose.T @ told.by_pose
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), told.by_pose.T @ off_px)
        nearer = optics.linearised(points_m, pose_of(pose[:3] + step[:3], pose[3:] + step[3:]))
        nearer_px = (points_px - nearer.points_px).ravel()
        if nearer_px @ nearer_px <= off_px @ off_px:
            pose, told, off_px, damping = pose + step, nearer, nearer_px, 0.1 * damping
        else:
            damping *= 10.0
        if np.abs(step).max() < 1e-12:
            break
    return pose_of(pose[:3], pose[3:])


def held_out(
    views: Sequence[View], size_px: tuple[int, int], folds: int, lens: Lens = "thesis"
) -> tuple[FittedView, ...]:
    """Every view by a lens from the others: each fold in turn is left out (SPEC 1.3 c).

    Raises:
        InputError: fewer than two folds, or too few views for them.
        ReconstructionError: the views of a fold do not determine the lens.
    """
    if not 2 <= folds <= len(views):
        raise InputError(f"{len(views)} views cannot be held out in {folds} folds; try 2 to {len(views)}")
    left = len(views) - -(-len(views) // folds)
    if left < LEAST_VIEWS:
        raise InputError(
            f"{len(views)} views in {folds} folds leave {left} for the lens, and it takes {LEAST_VIEWS}; "
            "hold out fewer at a time with more folds, or take more images"
        )
    told: dict[int, FittedView] = {}
    for fold in range(folds):
        rest = [view for index, view in enumerate(views) if index % folds != fold]
        lens_of_rest = calibrate(rest, size_px, lens)
        for index in range(fold, len(views), folds):
            told[index] = place(views[index], lens_of_rest.matrix, lens_of_rest.distortion, lens_of_rest.lens)
    return tuple(told[index] for index in range(len(views)))


def _tilt_deg(poses: Sequence[FloatArray]) -> float:
    normals = np.array([pose[:3, 2] for pose in poses])
    return float(np.degrees(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0))).max())


def _fitted(view: View, T_camera_board: FloatArray, optics: Optics) -> FittedView:
    residuals_px = view.points_px - optics.project(view.board_m, T_camera_board)
    return FittedView(view.name, T_camera_board, residuals_px, view.points_px, view.board_m)


def information(fitted: Sequence[FittedView], optics: Optics) -> FloatArray:
    """(P, P) what views tell of the lens if a coordinate is known to 1 px: its part of J^T J, in which the
    poses are parameters, too (SPEC 1.3 d).
    """
    return sum(
        (informed(view.board_m, view.T_camera_board, optics) for view in fitted),
        start=np.zeros((len(FREE[optics.lens]),) * 2),
    )


def inverted(told: FloatArray) -> FloatArray:
    """(P, P) covariance of (P, P) information; what the views hardly tell is very unsure, never sure."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(told), LEAST_INFORMATION))
    values, turns = np.linalg.eigh(told * np.outer(scale, scale))
    root = scale[:, None] * turns / np.sqrt(np.maximum(values, LEAST_INFORMATION))
    return root @ root.T


def informed(board_m: FloatArray, T_camera_board: FloatArray, optics: Optics) -> FloatArray:
    """(P, P) what one view tells."""
    told = optics.linearised(board_m, T_camera_board)
    base = np.linalg.qr(told.by_pose)[0]
    left = told.by_lens - base @ (base.T @ told.by_lens)
    return left.T @ left
