"""Photographs of a printed board by an exactly known camera."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from lab.worlds.printed import printed, sheet_px
from pipeline.calibration.board import Board
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray

OVER = 3
"""Rays along each side of a pixel, whose value is their mean."""
DESK = 205
"""Grey of the desk around the sheet."""


def seen_px(board: Board, T_camera_board: FloatArray, camera: CameraIntrinsics) -> FloatArray:
    """Return (N, 2) image positions of the board's points."""
    turn = cv2.Rodrigues(T_camera_board[:3, :3])[0]
    points_px, _ = cv2.projectPoints(
        board.points_m, turn, T_camera_board[:3, 3], camera.matrix, camera.distortion
    )
    return points_px.reshape(-1, 2)


def photograph(board: Board, T_camera_board: FloatArray, camera: CameraIntrinsics) -> ByteArray:
    """Return the (H, W) grey picture of the printed sheet on a desk."""
    T = T_camera_board
    plane = np.column_stack([T[:3, 0], T[:3, 1], T[:3, 3]])
    lens = (*camera.matrix.ravel().tolist(), *camera.distortion.tolist())
    on_board = np.linalg.inv(plane) @ _rays(lens, camera.width_px, camera.height_px)
    at_px = sheet_px(board, (on_board[:2] / on_board[2]).T)
    shape = (OVER * camera.height_px, OVER * camera.width_px)
    x, y = (column.reshape(shape).astype(np.float32) for column in at_px.T)
    fine = cv2.remap(printed(board), x, y, cv2.INTER_LINEAR, borderValue=DESK)
    return cv2.resize(fine, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)


@lru_cache(2)
def _rays(lens: tuple[float, ...], width_px: int, height_px: int) -> FloatArray:
    """Return (3, N) directions of all rays, row by row of an image ``OVER`` times as wide and as high."""
    v, u = np.mgrid[0 : OVER * height_px, 0 : OVER * width_px].astype(np.float64)
    pixels = (np.stack([u, v], axis=-1).reshape(-1, 1, 2) + 0.5) / OVER - 0.5
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-9)
    matrix, distortion = np.reshape(lens[:9], (3, 3)), np.array(lens[9:])
    flat = cv2.undistortPoints(pixels, matrix, distortion, criteria=until).reshape(-1, 2)
    return np.column_stack([flat, np.ones(len(flat))]).T
