"""Estimation of a camera from views of a board: the lens, its uncertainty, and the error in held-out views
(SPEC 1.1, 1.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import get_args

import cv2
import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.fisheye import estimate_fisheye
from pipeline.calibration.lens import FLAGS, FREE, NAMES, Optics
from pipeline.calibration.one_thread import one_thread
from pipeline.config import Lens
from pipeline.kernels.geometry import rigid
from pipeline.types import FloatArray

LEAST_VIEWS = 3
LEAST_POINTS = 4
"""Least number of points in a view to find its pose."""
SETTLE_STEPS = 30
MOST_RMS_PX = 5.0
"""RMS above which no camera is returned."""
MOST_ASPECT = 1.4
"""Largest ratio of the focal lengths along columns and rows: pixels of real sensors are nearly square."""
LEAST_INFORMATION = 1e-14
"""Least eigenvalue of the information matrix scaled to unit diagonal; smaller ones are rounding errors."""
LEAST_TILT_DEG = 5.0
"""Least angle between the boards of the two views that differ most: equal tilts fit many lenses."""
Z95 = 1.959964


@dataclass(frozen=True, slots=True)
class View:
    """Image points of the board in one image."""

    name: str
    points_px: FloatArray
    """(N, 2)"""
    board_m: FloatArray
    """(N, 3) the same points on the board."""


@dataclass(frozen=True, slots=True)
class FittedView:
    """A view with the pose of its board and its residuals."""

    name: str
    T_camera_board: FloatArray
    """(4, 4)"""
    residuals_px: FloatArray
    """(N, 2) residuals, observed minus predicted."""
    points_px: FloatArray
    """(N, 2) observed points."""
    board_m: FloatArray
    """(N, 3) the same points on the board."""

    @property
    def rms_px(self) -> float:
        """Root mean square distance of a point, as OpenCV defines it."""
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
    """OpenCV's vector: k1, k2, p1, p2, k3, with a rational lens also k4, k5, k6; for a fisheye k1 to k4."""
    names: tuple[str, ...]
    """Names of the parameters that were estimated."""
    covariance: FloatArray
    """(P, P) covariance of these parameters; focal lengths and principal point in pixels."""
    views: tuple[FittedView, ...]

    @property
    def optics(self) -> Optics:
        """The lens without uncertainty."""
        return Optics(self.lens, self.matrix, self.distortion)

    @property
    def rms_px(self) -> float:
        """Root mean square residual of all points of all views."""
        return rms_px(np.concatenate([view.residuals_px for view in self.views]))

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters by name."""
        k, lens = self.matrix, self.distortion.ravel().tolist()
        names = FREE["fisheye"] if self.lens == "fisheye" else NAMES
        return dict(zip(names, (k[0, 0], k[1, 1], k[0, 2], k[1, 2], *lens), strict=False))

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard errors of the estimated parameters."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def focal_sd(self) -> float:
        """Larger relative standard error of the two focal lengths, a fraction."""
        values = self.parameters
        return max(
            error / values[name] for name, error in self.standard_errors.items() if name in ("fx", "fy")
        )

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals of the estimated parameters."""
        values = self.parameters
        errors = self.standard_errors.items()
        return {name: (values[name] - Z95 * error, values[name] + Z95 * error) for name, error in errors}


def rms_px(residuals_px: FloatArray) -> float:
    """Return the root mean square length of (N, 2) residuals."""
    return float(np.sqrt((residuals_px**2).sum(axis=1).mean()))


def coordinate_sd_px(views: Sequence[FittedView], lens: Lens) -> float:
    """Return the standard deviation of a point's coordinate, pixels, from the residuals after the fit."""
    every = np.concatenate([view.residuals_px for view in views])
    freedom = max(every.size - 6 * len(views) - len(FREE[lens]), 1)
    return float(np.sqrt((every**2).sum() / freedom))


def calibrate(views: Sequence[View], size_px: tuple[int, int], lens: Lens = "thesis") -> Calibration:
    """Estimate a camera.

    Args:
        views: at least three, tilted differently.
        size_px: width and height of all images.
        lens: distortion model.

    Raises:
        InputError: there are too few views, or the lens model is unknown.
        ReconstructionError: the views do not determine the lens, or the camera that fits best cannot exist.
    """
    found = best_fit(views, size_px, lens)
    check_possible(found)
    return found


def best_fit(views: Sequence[View], size_px: tuple[int, int], lens: Lens = "thesis") -> Calibration:
    """Estimate a camera as ``calibrate`` does, without the check that such a camera can exist."""
    if lens not in get_args(Lens):
        raise InputError(f"There is no lens '{lens}'; try one of {', '.join(get_args(Lens))}")
    if len(views) < LEAST_VIEWS:
        raise InputError(
            f"The board was found in {len(views)} images, and it takes {LEAST_VIEWS}, tilted differently; "
            "take more"
        )
    try:
        optics, poses = _fisheye(views, size_px) if lens == "fisheye" else _brown(views, size_px, lens)
    except (cv2.error, np.linalg.LinAlgError):
        raise ReconstructionError(_UNEXPLAINED) from None
    if not all(np.isfinite(one).all() for one in (optics.matrix, optics.distortion, *poses)):
        raise ReconstructionError(_DEGENERATE)
    if _tilt_deg(poses) < LEAST_TILT_DEG:
        raise ReconstructionError(_DEGENERATE)
    return calibration_of(views, poses, optics, size_px)


def check_possible(found: Calibration) -> None:
    """Check that a camera of these parameters can exist.

    Raises:
        ReconstructionError: a focal length is negative, pixels are far from square, the principal point is
            outside the image, or the camera does not explain the views.
    """
    (fx, _, cx), (_, fy, cy) = found.matrix[:2].tolist()
    width, height = found.size_px
    wrong = ""
    if not (fx > 0.0 and fy > 0.0):
        wrong = f"has focal lengths of {fx:.5g} and {fy:.5g} px, which must be positive"
    elif not 1.0 / MOST_ASPECT < fx / fy < MOST_ASPECT:
        wrong = (
            f"has focal lengths of {fx:.5g} px along rows and {fy:.5g} px along columns, which must be alike"
        )
    elif not (-0.5 <= cx <= width - 0.5 and -0.5 <= cy <= height - 0.5):
        wrong = f"has its principal point at {cx:.5g}, {cy:.5g}, outside the image of {width} x {height} px"
    elif not found.rms_px <= MOST_RMS_PX:
        wrong = f"misses the points by {found.rms_px:.3g} px (RMS), more than {MOST_RMS_PX:g} px"
    if not wrong:
        return
    worst = max(found.views, key=lambda view: view.rms_px)
    raise ReconstructionError(
        f"The camera that fits best {wrong}, so it cannot be right; show the board in more of the image, "
        "tilted by 20 to 40° to different sides, try another lens, or leave out the worst image, "
        f"{worst.name} ({worst.rms_px:.2g} px)"
    )


def calibration_of(
    views: Sequence[View], poses: Sequence[FloatArray], optics: Optics, size_px: tuple[int, int]
) -> Calibration:
    """Build the record of a lens and (4, 4) poses that were estimated together."""
    fitted = tuple(_fitted(view, pose, optics) for view, pose in zip(views, poses, strict=True))
    covariance = coordinate_sd_px(fitted, optics.lens) ** 2 * inverted(information(fitted, optics))
    return Calibration(
        optics.lens, size_px, optics.matrix, optics.distortion, FREE[optics.lens], covariance, fitted
    )


def _brown(views: Sequence[View], size_px: tuple[int, int], lens: Lens) -> tuple[Optics, list[FloatArray]]:
    """Estimate lens and board poses with OpenCV."""
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
    """Estimate a fisheye lens and the board poses."""

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
    """Return the (4, 4) transform of OpenCV's rotation vector and translation."""
    return rigid(cv2.Rodrigues(np.asarray(turn))[0], np.ravel(move))


def residuals(
    view: View,
    T_camera_board: FloatArray,
    matrix: FloatArray,
    distortion: FloatArray,
    lens: Lens = "thesis",
) -> FloatArray:
    """Return (N, 2) residuals, observed minus predicted."""
    return view.points_px - Optics(lens, matrix, distortion).project(view.board_m, T_camera_board)


def place(view: View, matrix: FloatArray, distortion: FloatArray, lens: Lens = "thesis") -> FittedView:
    """Find the pose of the board in a view for a known lens.

    Raises:
        ReconstructionError: no pose explains the view.
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
    """Refine a (4, 4) pose so that (N, 3) points project closest to (N, 2) pixels.

    It minimises the image distances by the Levenberg-Marquardt method.
    """
    pose = np.concatenate([cv2.Rodrigues(T_camera_points[:3, :3])[0].ravel(), T_camera_points[:3, 3]])
    damping, linear = 1e-3, optics.linearised(points_m, T_camera_points)
    off_px = (points_px - linear.points_px).ravel()
    for _ in range(SETTLE_STEPS):
        normal = linear.by_pose.T @ linear.by_pose
        try:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), linear.by_pose.T @ off_px)
        except np.linalg.LinAlgError:  # the image does not depend on some motion: the board is far off
            break
        nearer = optics.linearised(points_m, pose_of(pose[:3] + step[:3], pose[3:] + step[3:]))
        nearer_px = (points_px - nearer.points_px).ravel()
        if nearer_px @ nearer_px <= off_px @ off_px:
            pose, linear, off_px, damping = pose + step, nearer, nearer_px, 0.1 * damping
        else:
            damping *= 10.0
        if np.abs(step).max() < 1e-12:
            break
    return pose_of(pose[:3], pose[3:])


def held_out(
    views: Sequence[View], size_px: tuple[int, int], folds: int, lens: Lens = "thesis"
) -> tuple[FittedView, ...]:
    """Return every view, its pose fitted with a lens that was estimated without its fold (SPEC 1.3 c).

    Raises:
        InputError: there are fewer than two folds, or too few views for them.
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
    placed: dict[int, FittedView] = {}
    for fold in range(folds):
        rest = [view for index, view in enumerate(views) if index % folds != fold]
        lens_of_rest = best_fit(rest, size_px, lens)
        for index in range(fold, len(views), folds):
            placed[index] = place(
                views[index], lens_of_rest.matrix, lens_of_rest.distortion, lens_of_rest.lens
            )
    return tuple(placed[index] for index in range(len(views)))


def _tilt_deg(poses: Sequence[FloatArray]) -> float:
    normals = np.array([pose[:3, 2] for pose in poses])
    return float(np.degrees(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0))).max())


def _fitted(view: View, T_camera_board: FloatArray, optics: Optics) -> FittedView:
    residuals_px = view.points_px - optics.project(view.board_m, T_camera_board)
    return FittedView(view.name, T_camera_board, residuals_px, view.points_px, view.board_m)


def information(fitted: Sequence[FittedView], optics: Optics) -> FloatArray:
    """Return the (P, P) information of views about the lens, for image coordinates with a standard deviation
    of 1 px: the Schur complement of the poses in J^T J (SPEC 1.3 d).
    """
    return sum(
        (informed(view.board_m, view.T_camera_board, optics) for view in fitted),
        start=np.zeros((len(FREE[optics.lens]),) * 2),
    )


def inverted(information: FloatArray) -> FloatArray:
    """Invert (P, P) information to a covariance; poorly determined parameters get a large variance."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), LEAST_INFORMATION))
    values, turns = np.linalg.eigh(information * np.outer(scale, scale))
    root = scale[:, None] * turns / np.sqrt(np.maximum(values, LEAST_INFORMATION))
    return root @ root.T


def informed(board_m: FloatArray, T_camera_board: FloatArray, optics: Optics) -> FloatArray:
    """Return the (P, P) information of one view, whose pose is unknown, about the lens."""
    linear = optics.linearised(board_m, T_camera_board)
    base = np.linalg.qr(linear.by_pose)[0]
    left = linear.by_lens - base @ (base.T @ linear.by_lens)
    return left.T @ left
