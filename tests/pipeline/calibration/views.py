"""Pictures of a board as a camera sees it that is known to the last digit."""

from functools import cache

import cv2
import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View
from pipeline.calibration.target import picture_of, sheet
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics(
    np.array([[600.0, 0.0, 318.0], [0.0, 604.0, 243.0], [0.0, 0.0, 1.0]]),
    np.array([-0.12, 0.05, 0.0, 0.0, 0.0]),
    640,
    480,
)
TILTS_DEG = ((0, 0), (25, 5), (-25, 10), (5, 28), (-8, -30), (20, -20), (-18, 24), (30, 0))
PIXEL_MM = 0.25
OVER = 3
"""Rays along either side of a pixel."""


def poses(board: Board, count: int = 8, turn_deg: float = 7.0):
    """(4, 4) poses of the board that fill the picture, tilted to all sides."""
    size_m = np.ptp(board.points_m[:, :2], axis=0) + 3.0 * board.spacing_m
    away_m = 1.35 * max(size_m[0], CAMERA.width_px / CAMERA.height_px * size_m[1])
    made = []
    for index, (x_deg, y_deg) in enumerate(TILTS_DEG[:count]):
        turn = np.radians([x_deg, y_deg, turn_deg * (index - 3)])
        T = np.eye(4)
        T[:3, :3] = cv2.Rodrigues(turn)[0]
        T[:3, 3] = (0.03 * away_m * (index % 3 - 1), 0.02 * away_m * (index % 2), away_m)
        made.append(T)
    return made


def seen(board: Board, T_camera_board, noise_px=0.0, rng=None):
    """(N, 2) where the camera has the board's points."""
    turn = cv2.Rodrigues(T_camera_board[:3, :3])[0]
    points_px, _ = cv2.projectPoints(
        board.points_m, turn, T_camera_board[:3, 3], CAMERA.matrix, CAMERA.distortion
    )
    points_px = points_px.reshape(-1, 2)
    return points_px if not noise_px else points_px + rng.normal(0.0, noise_px, points_px.shape)


def views(board: Board, noise_px=0.0, seed=0, count=8):
    """Views whose points are off by noise."""
    rng = np.random.default_rng(seed)
    return [
        View(f"view {index}", seen(board, T, noise_px=noise_px, rng=rng), board.points_m)
        for index, T in enumerate(poses(board, count))
    ]


@cache
def _rays():
    """(3, N) directions of nine rays through every pixel."""
    v, u = np.mgrid[0 : OVER * CAMERA.height_px, 0 : OVER * CAMERA.width_px].astype(np.float64)
    pixels = (np.stack([u, v], axis=-1).reshape(-1, 1, 2) + 0.5) / OVER - 0.5
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-9)
    flat = cv2.undistortPoints(pixels, CAMERA.matrix, CAMERA.distortion, criteria=until).reshape(-1, 2)
    return np.column_stack([flat, np.ones(len(flat))]).T


def photograph(board: Board, T_camera_board):
    """(H, W) what the camera takes of the printed sheet; every pixel is the mean of nine rays."""
    printed = picture_of(sheet(board), PIXEL_MM)
    origin_px = 1000.0 * (board.points_m[0, :2] - _first_mm(board) / 1000.0) / PIXEL_MM
    T = T_camera_board
    H = np.column_stack([T[:3, 0], T[:3, 1], T[:3, 3]])
    on_board = np.linalg.solve(H, _rays())
    flat_m = (on_board[:2] / on_board[2]).T
    at_px = 1000.0 * flat_m / PIXEL_MM - origin_px - 0.5
    shape = (OVER * CAMERA.height_px, OVER * CAMERA.width_px)
    x, y = (column.reshape(shape).astype(np.float32) for column in at_px.T)
    fine = cv2.remap(printed, x, y, cv2.INTER_LINEAR, borderValue=205)
    return cv2.resize(fine, (CAMERA.width_px, CAMERA.height_px), interpolation=cv2.INTER_AREA)


def _first_mm(board: Board):
    """(2,) where the first point is on the sheet."""
    points_mm = 1000.0 * board.points_m[:, :2]
    square = board.pattern in ("chessboard", "charuco")
    around_mm = 1000.0 * board.spacing_m if square else 2000.0 * board.radius_m
    return points_mm[0] - (points_mm.min(axis=0) - around_mm - 15.0)
