"""Pictures of a board as a camera sees it that is known to the last digit."""

import functools

import cv2
import numpy as np

from lab.claims.calibration.photograph import photograph as take
from lab.claims.calibration.photograph import seen_px
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics(
    np.array([[600.0, 0.0, 318.0], [0.0, 604.0, 243.0], [0.0, 0.0, 1.0]]),
    np.array([-0.12, 0.05, 0.0, 0.0, 0.0]),
    640,
    480,
)
TILTS_DEG = ((0, 0), (25, 5), (-25, 10), (5, 28), (-8, -30), (20, -20), (-18, 24), (30, 0))


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
    points_px = seen_px(board, T_camera_board, CAMERA)
    return points_px if not noise_px else points_px + rng.normal(0.0, noise_px, points_px.shape)


def views(board: Board, noise_px=0.0, seed=0, count=8):
    """Views whose points are off by noise."""
    rng = np.random.default_rng(seed)
    return [
        View(f"view {index}", seen(board, T, noise_px=noise_px, rng=rng), board.points_m)
        for index, T in enumerate(poses(board, count))
    ]


def photograph(board: Board, T_camera_board):
    """(H, W) what the camera takes of the printed sheet; the same again is not rendered again."""
    return _photograph(board, np.asarray(T_camera_board, float).tobytes()).copy()


@functools.lru_cache(maxsize=256)
def _photograph(board: Board, T_camera_board: bytes):
    return take(board, np.frombuffer(T_camera_board).reshape(4, 4), CAMERA)
