"""Measured and true depth at pixels on a calibration board (SPEC 1.5)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.calibration.board import MARKER_SHARE, Board
from pipeline.calibration.estimate import Calibration, FittedView, pose_of
from pipeline.calibration.lens import Optics
from pipeline.kernels.geometry import apply, inverse
from pipeline.types import BoolArray, DepthMap, FloatArray, IntArray

RIM_PX = 3
"""Pixels closer than this to the rim of the board's points are not used: sensors mix board and background."""
INK_PX = 1.0
"""Black areas are enlarged by this many pixels, because pixels at their border are partly black."""
MOST_PER_VIEW, FEWEST = 600, 100
"""Largest number of pixels used per view, evenly spread, and smallest number with which a view is used."""
GATE_SDS, LEAST_GATE_M = 6.0, 0.02
"""Gate about the median error of a view, in robust standard deviations, and its least half width: pixels
beyond it show a hand or background."""
MOST_SHARE = 0.25
"""Largest relative error of a view's median depth; a larger one means a wrong unit or another scene."""
MAD_TO_SD = 1.4826


@dataclass(frozen=True, slots=True)
class DepthSamples:
    """N pixels on the board, over all views."""

    size_px: tuple[int, int]
    """Width and height of the images."""
    pixels: IntArray
    """(N, 2) u, v."""
    measured_m: FloatArray
    """(N,) depth measured by the sensor, along the optical axis."""
    true_m: FloatArray
    """(N,) depth, along the optical axis, at which the pixel's ray meets the board's plane."""
    cosine: FloatArray
    """(N,) cosine of the angle between the ray and the board's normal."""
    view: IntArray
    """(N,) index into ``names``."""
    ink: BoolArray
    """(N,) True in markers and on or near black print, where the reflection of infrared differs."""
    names: tuple[str, ...]
    """Names of the views."""
    lens_m: FloatArray
    """(P, N) change of ``true_m`` by one standard deviation of each of P independent errors of the lens."""
    lens_focal: FloatArray
    """(P,) relative change of the focal length by the same errors."""

    def __len__(self) -> int:
        return len(self.measured_m)

    def select(self, rows: BoolArray | IntArray) -> DepthSamples:
        """Return the pixels at ``rows``; indices of views are unchanged."""
        return replace(
            self,
            pixels=self.pixels[rows],
            measured_m=self.measured_m[rows],
            true_m=self.true_m[rows],
            cosine=self.cosine[rows],
            view=self.view[rows],
            ink=self.ink[rows],
            lens_m=self.lens_m[:, rows],
        )


def board_depth_samples(
    calibration: Calibration,
    depths: Sequence[DepthMap | None],
    board: Board,
    legacy: Collection[str] = (),
) -> DepthSamples:
    """Collect measured and true depth of a board.

    In each view the board's plane n . X = d has the depth d / (n . K^-1 [u v 1]) at pixel (u, v). The whole
    plane is used, because at a tilted board's centre alone an error of the pose would become a bias. Pixels
    are at least ``RIM_PX`` inside the outermost points, so that none mixes the board with the background.
    Pixels on black print are marked: they reflect less infrared, and the fit does not use them. Markers of
    ChArUco boards and AprilGrids count as black as a whole, because programs print them with different cells.
    The markers of a ChArUco board are taken to be of ``MARKER_SHARE``.

    Args:
        calibration: the lens with its uncertainty, and its views.
        depths: (H, W) metric depth of each view on the image's pixel grid; None for a view without depth.
        board: the board in the views.
        legacy: names of the views of a ChArUco board in the layout of OpenCV before 4.6.

    Raises:
        InputError: there is no depth on the board, or a depth image has another size or unit.
    """
    parts: list[DepthSamples] = []
    lenses, errors = _lenses(calibration), _errors(calibration)
    for view, depth in zip(calibration.views, depths, strict=True):
        if depth is None:
            continue
        printed = board, view.name in legacy
        part = _samples_of(view, depth, calibration.size_px, lenses, errors, *printed, len(parts))
        if len(part) >= FEWEST:
            parts.append(part)
    if not parts:
        raise InputError(
            "No depth image has depth where the board is; are they of the same moments and registered to "
            "the colour images?"
        )
    return DepthSamples(
        size_px=parts[0].size_px,
        pixels=np.concatenate([part.pixels for part in parts]),
        measured_m=np.concatenate([part.measured_m for part in parts]),
        true_m=np.concatenate([part.true_m for part in parts]),
        cosine=np.concatenate([part.cosine for part in parts]),
        view=np.concatenate([part.view for part in parts]),
        ink=np.concatenate([part.ink for part in parts]),
        names=tuple(name for part in parts for name in part.names),
        lens_m=np.concatenate([part.lens_m for part in parts], axis=1),
        lens_focal=parts[0].lens_focal,
    )


def _errors(calibration: Calibration) -> FloatArray:
    """Return (P, P) changes of the lens's parameters (rows) by one sd of each independent error (columns)."""
    variances, directions = np.linalg.eigh(calibration.covariance)
    return directions * np.sqrt(np.maximum(variances, 0.0))


def _lenses(calibration: Calibration) -> list[Optics]:
    """Return the lens, then the lens changed by one standard deviation of each independent error."""
    names, known = list(calibration.parameters), calibration.distortion.ravel()
    rows = [names.index(name) for name in calibration.names]
    lenses = []
    for step in (np.zeros(len(rows)), *_errors(calibration).T):
        values = np.array([*calibration.parameters.values()])
        values[rows] += step
        matrix = np.array([[values[0], 0.0, values[2]], [0.0, values[1], values[3]], [0.0, 0.0, 1.0]])
        distortion = np.concatenate([values[4 : 4 + len(known)], known[len(values) - 4 :]])
        lenses.append(Optics(calibration.lens, matrix, distortion))
    return lenses


def _samples_of(
    view: FittedView,
    depth: DepthMap,
    size_px: tuple[int, int],
    lenses: Sequence[Optics],
    errors: FloatArray,
    board: Board,
    legacy: bool,
    index: int,
) -> DepthSamples:
    """Collect the pixels of one view."""
    if depth.z_m.shape != size_px[::-1]:
        raise InputError(
            f"The depth image of {view.name} has {depth.z_m.shape[1]} x {depth.z_m.shape[0]} pixels and its "
            f"colour image {size_px[0]} x {size_px[1]}; give depth that is registered to the colour images"
        )
    lens, T = lenses[0], view.T_camera_board
    pixels = _pixels_on_board(board, T, lens, depth)
    measured_m = depth.z_m[pixels[:, 1], pixels[:, 0]].astype(np.float64)
    rays = _rays(lens, pixels)
    true_m = _plane_m(T, rays)
    kept = _gate(view.name, measured_m, true_m)
    pixels, measured_m, rays, true_m = pixels[kept], measured_m[kept], rays[kept], true_m[kept]
    moved_m = [
        _plane_m(moved, _rays(one, pixels)) - true_m
        for one, moved in zip(lenses[1:], _moved_boards(view, lens, errors), strict=True)
    ]
    focal_px = float(lens.matrix[0, 0])
    return DepthSamples(
        size_px=size_px,
        pixels=pixels,
        measured_m=measured_m,
        true_m=true_m,
        cosine=np.abs(rays @ T[:3, 2]) / np.linalg.norm(rays, axis=1),
        view=np.full(len(pixels), index),
        ink=_on_ink(board, legacy, T, rays * true_m[:, None], INK_PX / focal_px),
        names=(view.name,),
        lens_m=np.array(moved_m).reshape(len(moved_m), len(pixels)),
        lens_focal=np.array([float(one.matrix[0, 0]) / focal_px - 1.0 for one in lenses[1:]]),
    )


def _moved_boards(view: FittedView, lens: Optics, errors: FloatArray) -> list[FloatArray]:
    """Return (4, 4) apparent poses of the board under each error of the lens, to first order."""
    linear = lens.linearised(view.board_m, view.T_camera_board)
    steps = -np.linalg.lstsq(linear.by_pose, linear.by_lens @ errors, rcond=None)[0]
    turn, move = cv2.Rodrigues(view.T_camera_board[:3, :3])[0].ravel(), view.T_camera_board[:3, 3]
    return [pose_of(turn + step[:3], move + step[3:]) for step in steps.T]


def _rays(lens: Optics, pixels: IntArray) -> FloatArray:
    """Return (N, 3) rays through pixels, scaled to z = 1."""
    rays = lens.rays(pixels.astype(np.float64))
    return rays / rays[:, 2:]


def _pixels_on_board(board: Board, T: FloatArray, lens: Optics, depth: DepthMap) -> IntArray:
    """Return (N, 2) pixels with depth inside the board's points, away from their rim, evenly thinned."""
    low_m, high_m = board.points_m[:, :2].min(axis=0), board.points_m[:, :2].max(axis=0)
    corners_m = np.array([low_m, (high_m[0], low_m[1]), high_m, (low_m[0], high_m[1])])
    along = np.linspace(0.0, 1.0, 16, endpoint=False)[:, None]
    sides = zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True)
    rim_m = np.concatenate([start + along * (end - start) for start, end in sides])
    rim_px = lens.project(np.column_stack([rim_m, np.zeros(len(rim_m))]), T)
    inside = np.zeros(depth.z_m.shape, np.uint8)
    cv2.fillPoly(inside, [np.rint(rim_px).astype(np.int32).reshape(-1, 1, 2)], 1)
    kernel = np.ones((2 * RIM_PX + 1, 2 * RIM_PX + 1), np.uint8)
    inside = cv2.erode(inside, kernel, borderValue=0)
    v, u = np.nonzero((inside > 0) & depth.valid & (depth.z_m > 0.0))
    return np.stack([u, v], axis=1)[_evenly(len(u), 2 * MOST_PER_VIEW)]


def _evenly(count: int, most: int) -> IntArray:
    """Return at most ``most`` indices, evenly spread over ``count``."""
    return np.linspace(0, count - 1, min(count, most)).round().astype(int)


def _gate(name: str, measured_m: FloatArray, true_m: FloatArray) -> IntArray:
    """Return the rows of one view's pixels that are not in front of or behind the board, evenly thinned.

    Raises:
        InputError: the median depth is not that of the board.
    """
    if len(measured_m) < FEWEST:
        return np.zeros(0, np.int64)
    ratio = float(np.median(measured_m / true_m))
    if abs(ratio - 1.0) > MOST_SHARE:
        raise InputError(
            f"In {name} the board is {np.median(true_m):.2f} m away and the median of the depth image "
            f"is {np.median(measured_m):.4g} m; check the unit of the depth images and the board's spacing"
        )
    off_m = measured_m - true_m
    off_m = off_m - np.median(off_m)
    gate_m = max(GATE_SDS * MAD_TO_SD * float(np.median(np.abs(off_m))), LEAST_GATE_M)
    rows = np.flatnonzero(np.abs(off_m) <= gate_m)
    return rows[_evenly(len(rows), MOST_PER_VIEW)]


def _plane_m(T_camera_board: FloatArray, rays: FloatArray) -> FloatArray:
    """Return (N,) depths at which (N, 3) rays with z = 1 meet the board."""
    normal = T_camera_board[:3, 2]
    return (normal @ T_camera_board[:3, 3]) / (rays @ normal)


def _on_ink(
    board: Board, legacy: bool, T_camera_board: FloatArray, points_m: FloatArray, px: float
) -> BoolArray:
    """Return (N,) True for points within ``px`` of black print, a marker counting as black as a whole.

    Args:
        board: the board.
        legacy: whether a ChArUco board has the layout of OpenCV before 4.6, which begins with a white square
            if the number of rows of squares is even.
        T_camera_board: (4, 4) pose of the board.
        points_m: (N, 3) points in the camera's frame.
        px: widening of black areas in units of the focal length: pixels over the focal length.
    """
    flat_m = apply(inverse(T_camera_board), points_m)[:, :2]
    rim_m = px * points_m[:, 2]
    if board.pattern.startswith("circles"):
        apart_m = np.linalg.norm(flat_m[:, None] - board.points_m[None, :, :2], axis=2).min(axis=1)
        return apart_m <= board.radius_m + rim_m
    from_first_m = flat_m - board.points_m[0, :2]
    if board.pattern == "aprilgrid":  # white is between two tags, except the squares at their corners
        pitch_m = (1.0 + board.tag_spacing) * board.spacing_m
        along_m = from_first_m % pitch_m
        beside_tag = along_m < board.spacing_m
        edges_m = np.minimum(np.minimum(along_m, pitch_m - along_m), np.abs(along_m - board.spacing_m))
        return (beside_tag[:, 0] == beside_tag[:, 1]) | (edges_m.min(axis=1) <= rim_m)
    squares = from_first_m / board.spacing_m
    from_edge_m = np.abs(squares - np.rint(squares)).min(axis=1) * board.spacing_m
    first_white = legacy and board.rows % 2 == 1
    black = np.floor(squares).sum(axis=1) % 2 == first_white
    white_m = 0.5 * (1.0 - MARKER_SHARE) * board.spacing_m if board.pattern == "charuco" else np.inf
    return black | (from_edge_m <= rim_m) | (from_edge_m >= white_m - rim_m)
