"""Detection of a board's points in an image by the detectors of its pattern (SPEC 1.2)."""

from __future__ import annotations

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.calibration.aprilgrid import find_aprilgrid
from pipeline.calibration.board import Board
from pipeline.calibration.charuco import find_charuco
from pipeline.calibration.chessboard import find_chessboard
from pipeline.calibration.circles import find_circles
from pipeline.calibration.detection import Detection
from pipeline.types import ByteArray


def detect(image: ByteArray, board: Board) -> Detection:
    """Find a board's points in an image.

    Args:
        image: (H, W) or (H, W, 3) uint8.
        board: the board to find.

    Raises:
        InputError: the image is not uint8, or not of rank 2 or 3.
    """
    if image.dtype != np.uint8 or image.ndim not in (2, 3):
        raise InputError(f"An image of {image.dtype} {image.shape} cannot be searched; try 8 bits a channel")
    gray = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    find = {
        "circles": find_circles,
        "circles-asymmetric": find_circles,
        "chessboard": find_chessboard,
        "charuco": find_charuco,
        "aprilgrid": find_aprilgrid,
    }[board.pattern]
    return find(gray, board)
