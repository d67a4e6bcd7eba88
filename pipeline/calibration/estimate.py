"""A camera from views of a board: the lens, how sure it is, and how well it predicts views it has not seen
(SPEC 1.1, 1.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import cv2
import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.config import Lens
from pipeline.geometry import rigid
from pipeline.types import FloatArray

FLAGS: dict[Lens, int] = {
    "thesis": cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "brown": 0,
    "rational": cv2.CALIB_RATIONAL_MODEL,
}
"""k1 and k2 (SPEC 1.1); with tangential p1, p2 and k3; with the denominator's k4, k5, k6."""
NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
"""Of the parameters, in OpenCV's order."""
FREE: dict[Lens, tuple[str, ...]] = {
    "thesis": NAMES[:6],
    "brown": NAMES[:9],
    "rational": NAMES,
}
LEAST_VIEWS = 3
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
    """OpenCV's vector: k1, k2, p1, p2, k3 and, of a rational lens, k4, k5, k6."""
    names: tuple[str, ...]
    """Of the parameters that were estimated."""
    covariance: FloatArray
    """(P, P) of them."""
    views: tuple[FittedView, ...]

    @property
    def rms_px(self) -> float:
        """Over all points of all views."""
        return rms_px(np.concatenate([view.residuals_px for view in self.views]))

    @property
    def parameters(self) -> dict[str, float]:
        """All by name."""
        k, lens = self.matrix, self.distortion.ravel().tolist()
        return dict(zip(NAMES, (k[0, 0], k[1, 1], k[0, 2], k[1, 2], *lens), strict=False))

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
    board_m = [view.board_m.astype(np.float32) for view in views]
    seen_px = [view.points_px.astype(np.float32).reshape(-1, 1, 2) for view in views]
    try:
        _, matrix, distortion, turns, moves, *_ = cv2.calibrateCameraExtended(
            board_m, seen_px, size_px, None, None, flags=FLAGS[lens]
        )
    except cv2.error:
        raise ReconstructionError(_DEGENERATE) from None
    if not (np.isfinite(matrix).all() and np.isfinite(distortion).all()):
        raise ReconstructionError(_DEGENERATE)
    poses = [pose_of(turn, move) for turn, move in zip(turns, moves, strict=True)]
    if _tilt_deg(poses) < LEAST_TILT_DEG:
        raise ReconstructionError(_DEGENERATE)
    fitted = tuple(
        FittedView(view.name, pose, residuals(view, pose, matrix, distortion))
        for view, pose in zip(views, poses, strict=True)
    )
    covariance = _covariance(views, fitted, matrix, distortion, FREE[lens])
    return Calibration(lens, size_px, matrix, distortion.ravel(), FREE[lens], covariance, fitted)


_DEGENERATE = (
    f"All views show the board from nearly the same direction (within {LEAST_TILT_DEG:g}°), which many "
    "lenses explain alike; tilt it by 20 to 40° to different sides"
)


def pose_of(turn: FloatArray, move: FloatArray) -> FloatArray:
    """(4, 4) of OpenCV's rotation vector and translation."""
    return rigid(cv2.Rodrigues(np.asarray(turn))[0], np.ravel(move))


def residuals(
    view: View, T_camera_board: FloatArray, matrix: FloatArray, distortion: FloatArray
) -> FloatArray:
    """(N, 2) seen less predicted."""
    turn = cv2.Rodrigues(T_camera_board[:3, :3])[0]
    predicted_px, _ = cv2.projectPoints(view.board_m, turn, T_camera_board[:3, 3], matrix, distortion)
    return view.points_px - predicted_px.reshape(-1, 2)


def place(view: View, matrix: FloatArray, distortion: FloatArray) -> FittedView:
    """Where the board of a view is that had no part in the lens.

    Raises:
        ReconstructionError: no pose explains it.
    """
    found, turn, move = cv2.solvePnP(view.board_m, view.points_px, matrix, distortion)
    if not found:
        raise ReconstructionError(f"No place of the board explains {view.name}; is it the same board?")
    turn, move = cv2.solvePnPRefineLM(view.board_m, view.points_px, matrix, distortion, turn, move)
    pose = pose_of(turn, move)
    return FittedView(view.name, pose, residuals(view, pose, matrix, distortion))


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
    told: dict[int, FittedView] = {}
    for fold in range(folds):
        rest = [view for index, view in enumerate(views) if index % folds != fold]
        lens_of_rest = calibrate(rest, size_px, lens)
        for index in range(fold, len(views), folds):
            told[index] = place(views[index], lens_of_rest.matrix, lens_of_rest.distortion)
    return tuple(told[index] for index in range(len(views)))


def _tilt_deg(poses: Sequence[FloatArray]) -> float:
    normals = np.array([pose[:3, 2] for pose in poses])
    return float(np.degrees(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0))).max())


def _covariance(
    views: Sequence[View],
    fitted: Sequence[FittedView],
    matrix: FloatArray,
    distortion: FloatArray,
    names: tuple[str, ...],
) -> FloatArray:
    """(P, P) of the lens: its part of (J^T J)^-1 s^2, in which the poses are parameters, too (SPEC 1.3 d)."""
    columns = [NAMES.index(name) for name in names]
    normal = np.zeros((len(columns), len(columns)))
    for view, one in zip(views, fitted, strict=True):
        turn = cv2.Rodrigues(one.T_camera_board[:3, :3])[0]
        _, J = cv2.projectPoints(view.board_m, turn, one.T_camera_board[:3, 3], matrix, distortion)
        pose, lens = J[:, :6], J[:, 6:][:, columns]
        lens = lens - pose @ np.linalg.lstsq(pose, lens, rcond=None)[0]
        normal += lens.T @ lens
    every = np.concatenate([one.residuals_px for one in fitted])
    freedom = max(every.size - 6 * len(views) - len(columns), 1)
    return np.linalg.pinv(normal) * float((every**2).sum()) / freedom
