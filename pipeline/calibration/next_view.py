"""Choice of the next view to take: of many board poses, the one that most reduces the predicted error at the
working distance (SPEC 1.3 e).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import Calibration, coordinate_sd_px, information, informed, inverted
from pipeline.calibration.lens import Optics
from pipeline.calibration.trust import Sight, placing, sight
from pipeline.kernels.geometry import apply, rigid, rotation_exp
from pipeline.types import FloatArray

TILTS_DEG = (0.0, 25.0, 45.0)
"""Tilts of the board relative to the camera; larger ones blur and are hard to detect."""
SIDES = 8
"""Number of directions of the tilt."""
PLACES = (0.15, 0.32, 0.5, 0.68, 0.85)
"""Positions of the board's centre, as shares of the image's width and height."""
WIDTHS = (0.3, 0.45, 0.65)
"""Widths of the board, as shares of the image's, which determine its distance."""
WIDEST = 1.0
"""Largest ratio of the board's width to its distance: closer boards are out of focus."""
RIM = 0.02
"""Share of the image that stays free around the board's points."""
NEAREST = 0.02
"""Least depth of a board's points, as a share of the board's distance."""


@dataclass(frozen=True, slots=True)
class NextView:
    """A view to take next."""

    T_camera_board: FloatArray
    """(4, 4) pose of the board."""
    points_px: FloatArray
    """(N, 2) pixels of the board's points."""
    outline_px: FloatArray
    """(4, 2) corners of the board's area of points, in order around it."""
    error_before_m: float
    """Predicted error of a point at the working distance, root mean square over the image."""
    error_after_m: float
    """Predicted error after this view is added."""

    @property
    def distance_m(self) -> float:
        """Distance from the camera to the centre of the board."""
        return float(np.linalg.norm(self.T_camera_board[:3, 3]))

    @property
    def tilt_deg(self) -> float:
        """Angle between the board's normal and the line of sight to its centre."""
        sight_line = self.T_camera_board[:3, 3] / self.distance_m
        return float(np.degrees(np.arccos(np.clip(abs(self.T_camera_board[:3, 2] @ sight_line), 0.0, 1.0))))


def next_view(calibration: Calibration, board: Board, range_m: float) -> NextView:
    """Find the view that reduces the predicted error at a distance most.

    Args:
        calibration: the calibration so far.
        board: the calibration board.
        range_m: distance at which the camera will measure.

    Raises:
        InputError: the distance is impossible.
        ReconstructionError: the board fits nowhere into the image.
    """
    optics, size_px = calibration.optics, calibration.size_px
    sd_px = coordinate_sd_px(calibration.views, calibration.lens)
    known = information(calibration.views, optics)
    boards = [(view.board_m, view.T_camera_board) for view in calibration.views]
    cost = _cost_m2(sight(optics, size_px, range_m), placing(boards, optics))
    best: tuple[float, FloatArray] | None = None
    points_m = board.points_m
    for T in candidates(board, optics, size_px):
        covariance = sd_px**2 * inverted(known + informed(points_m, T, optics))
        after_m = _error_m(covariance, cost)
        if best is None or after_m < best[0]:
            best = after_m, T
    if best is None:
        raise ReconstructionError(
            f"The board ({board.title}) fits nowhere into the image; is its spacing right?"
        )
    after_m, T = best
    points_px = optics.project(points_m, T)
    columns = board.grid[0]
    corners = [0, columns - 1, len(points_px) - 1, len(points_px) - columns]
    before_m = _error_m(calibration.covariance, cost)
    return NextView(T, points_px, points_px[corners], before_m, after_m)


def candidates(board: Board, optics: Optics, size_px: tuple[int, int]) -> Iterator[FloatArray]:
    """Yield from a fixed set of (4, 4) poses those at which the whole board is in the image.

    They combine all positions, tilts, tilt directions and distances; the upper edge of the board is up.
    """
    size, points_m = np.array(size_px, float), board.points_m
    low_px, high_px = RIM * size - 0.5, (1.0 - RIM) * size - 0.5
    sides = np.arange(SIDES) * 2.0 * np.pi / SIDES
    tilts = [
        rotation_exp(np.radians(tilt) * np.array([np.cos(side), np.sin(side), 0.0]))
        for tilt in TILTS_DEG
        for side in (sides if tilt else sides[:1])
    ]
    rays = optics.rays(np.array([size * (x, y) for x in PLACES for y in PLACES]))
    for share in WIDTHS:
        away_m = float(np.ptp(points_m[:, 0])) / min(_angle(optics, size, share), WIDEST)
        for ray in rays[np.isfinite(rays[:, 2])]:
            facing = _facing(ray)
            for tilt in tilts:
                T = rigid(facing @ tilt, away_m * ray)
                if (apply(T, points_m)[:, 2] <= NEAREST * away_m).any():
                    continue
                points_px = optics.project(points_m, T)
                if ((points_px >= low_px) & (points_px <= high_px)).all():
                    yield T


def _angle(optics: Optics, size: FloatArray, share: float) -> float:
    """Return 2 tan(angle / 2) of the angle that a share of the image's width subtends at its centre."""
    ends_px = 0.5 * size + np.array([[-0.5 * share * size[0], 0.0], [0.5 * share * size[0], 0.0]])
    left, right = optics.rays(ends_px)
    return float(2.0 * np.tan(0.5 * np.arccos(np.clip(left @ right, -1.0, 1.0))))


def _facing(ray: FloatArray) -> FloatArray:
    """Return the (3, 3) rotation of a board perpendicular to a ray, with level rows."""
    right = np.cross((0.0, 1.0, 0.0), ray)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(ray, right), ray])


def _cost_m2(seen: Sight, place: FloatArray) -> FloatArray:
    """Return the (P, P) matrix M; trace(M C) is the mean squared error, m^2, of a lens with covariance C."""
    change = seen.metres @ (seen.by_lens + seen.by_pose @ place)
    change = change[np.isfinite(change).all(axis=(1, 2))]
    return np.einsum("gij,gik->jk", change, change) / len(change)


def _error_m(covariance: FloatArray, cost_m2: FloatArray) -> float:
    """Return the root mean square error over the image, metres."""
    return float(np.sqrt(np.sum(covariance * cost_m2)))
