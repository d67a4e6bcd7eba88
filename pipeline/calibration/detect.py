"""Detection of a board's points in an image by several detectors in turn, with the reason if all fail
(SPEC 1.2). The points are never mirrored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy.sparse.csgraph import connected_components

from packetmesh.errors import InputError
from pipeline.calibration.board import RING, Board
from pipeline.types import ByteArray, FloatArray, IntArray

SMALLEST_PX, LARGEST_SHARE = 20.0, 0.02
"""Least area of a circle in pixels, and its largest area as a share of the image. OpenCV's own limit of 5,000
pixels would miss the circles of a board near the camera."""
SIZES = 4.0
"""Ratio of the largest to the smallest circle of a tilted board, and to the marked circle's core."""
CORNER_WINDOW_PX = 5
MARK_STEP = 0.25
"""Least brightness at which the white ring is recognised: 0 is that of a circle, 1 that of the paper."""
LINK = 2.0
"""Blobs farther from the others than this many median neighbour distances are not on the board."""
MOST_BEND = 0.5
"""Largest change of the step between neighbours along a row or column, as a share of the step."""
NEAR, MOST_OF_A_SIDE = 0.3, 0.8
"""The grid continues if blobs are this near, in pitches, to this share of the points of another row."""
ALTERNATES = 0.75
"""Least contrast of alternating squares over that of the row inside it; at the board's rim it is a half."""
INTO_A_SQUARE = 0.3
"""Distance from a corner, in squares, at which brightness is read; the outermost squares may be narrow."""
FEW_CHARUCO = 6
"""Least number of corners with which a view of a ChArUco board counts."""


@dataclass(frozen=True, slots=True)
class Detection:
    """Points found in one image."""

    points_px: FloatArray
    """(N, 2) subpixel positions of the board's points; empty if the board was not found."""
    indices: IntArray
    """(N,) index of each in ``Board.points_m``."""
    reason: str = ""
    """Sentence on the reason why the board was not found, with advice; empty if it was found."""
    blobs_px: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    """(B, 2) circle-like blobs, if the board was not found."""
    oriented: bool = True
    """Whether a mark or the pattern showed the orientation; if not, all points may be rotated by 180°."""

    @property
    def found(self) -> bool:
        """Whether the board was found."""
        return len(self.points_px) > 0


def detect(image: ByteArray, board: Board) -> Detection:
    """Find a board's points in an image.

    Args:
        image: (H, W) or (H, W, 3) uint8.
        board: the board to find.

    Raises:
        InputError: the image does not have 8 bits per channel.
    """
    if image.dtype != np.uint8 or image.ndim not in (2, 3):
        raise InputError(f"An image of {image.dtype} {image.shape} cannot be searched; try 8 bits a channel")
    gray = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    if board.pattern == "charuco":
        return _charuco(gray, board)
    if board.pattern == "chessboard":
        return _chessboard(gray, board)
    return _circles(gray, board)


def _nothing(reason: str, blobs_px: FloatArray | None = None) -> Detection:
    blobs_px = np.zeros((0, 2)) if blobs_px is None else blobs_px
    return Detection(np.zeros((0, 2)), np.zeros(0, np.int64), reason, blobs_px)


def _all(board: Board, points_px: FloatArray, oriented: bool) -> Detection:
    return Detection(points_px, np.arange(len(points_px)), oriented=oriented)


# Circles.


def _circles(gray: ByteArray, board: Board) -> Detection:
    asymmetric = board.pattern == "circles-asymmetric"
    grid = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    most: FloatArray = np.zeros((0, 2))
    for picture, detector in _blob_detectors(gray):
        blobs_px, sizes_px = _together(*_alike(detector.detect(picture)), board)
        if len(blobs_px) > len(most):
            most = blobs_px
        if len(blobs_px) < board.columns * board.rows:
            continue
        alone = _only(blobs_px, sizes_px, gray.shape)
        for clustering in (cv2.CALIB_CB_CLUSTERING, 0):
            found, rough = cv2.findCirclesGrid(
                alone, board.size, flags=grid | clustering, blobDetector=detector
            )
            if found:
                apart_px = np.linalg.norm(blobs_px[:, None] - rough.reshape(1, -1, 2), axis=2)
                chosen = apart_px.argmin(axis=0)
                if len(np.unique(chosen)) == len(chosen) and _even(blobs_px[chosen], board):
                    if _goes_on(board, blobs_px[chosen], blobs_px):
                        return _nothing(_more_circles(board), blobs_px)
                    return _upright(gray, board, blobs_px[chosen])
    return _nothing(_why_no_circles(board, most), most)


def _blob_detectors(gray: ByteArray) -> Iterator[tuple[ByteArray, cv2.SimpleBlobDetector]]:
    """Yield detectors for dark circles on light, then light on dark; strict about shape, then lenient."""
    for picture in (gray, 255 - gray):
        for circularity, convexity, inertia in ((0.5, 0.9, 0.1), (0.2, 0.7, 0.02)):
            given = cv2.SimpleBlobDetector.Params()
            given.filterByColor, given.blobColor = True, 0
            given.filterByArea, given.minArea = True, SMALLEST_PX
            given.maxArea = max(LARGEST_SHARE * gray.size, 5000.0)
            given.filterByCircularity, given.minCircularity = True, circularity
            given.filterByConvexity, given.minConvexity = True, convexity
            given.filterByInertia, given.minInertiaRatio = True, inertia
            given.minDistBetweenBlobs = 4.0
            given.minRepeatability = 2
            yield picture, cv2.SimpleBlobDetector.create(given)


def _alike(blobs: Sequence[cv2.KeyPoint]) -> tuple[FloatArray, FloatArray]:
    """Return (B, 2) centres and (B,) diameters of the largest group of blobs of similar size."""
    sizes_px = np.array([blob.size for blob in blobs])
    if not len(sizes_px):
        return np.zeros((0, 2)), sizes_px
    group = max(((sizes_px >= one) & (sizes_px <= SIZES * one) for one in sizes_px), key=np.sum)
    return np.array([blob.pt for blob in blobs], float)[group], sizes_px[group]


def _together(blobs_px: FloatArray, sizes_px: FloatArray, board: Board) -> tuple[FloatArray, FloatArray]:
    """Return the largest group of blobs connected from neighbour to neighbour, without other objects."""
    if len(blobs_px) <= board.columns * board.rows:
        return blobs_px, sizes_px
    apart_px = np.linalg.norm(blobs_px[:, None] - blobs_px, axis=2)
    pitch_px = np.median(np.sort(apart_px, axis=1)[:, 1])
    _, group = connected_components(apart_px < LINK * pitch_px)
    mine = group == np.bincount(group).argmax()
    return blobs_px[mine], sizes_px[mine]


def _even(points_px: FloatArray, board: Board) -> bool:
    """Return whether every point is where its two neighbours in row and column predict it."""
    grid = points_px.reshape(board.rows, board.columns, 2)
    alike = 2 if board.pattern == "circles-asymmetric" else 1  # every second row is shifted
    for lines in (grid, *(grid[first::alike].swapaxes(0, 1) for first in range(alike))):
        steps = np.diff(lines, axis=1)
        pitch_px = np.linalg.norm(steps, axis=2)
        bend_px = np.linalg.norm(np.diff(steps, axis=1), axis=2)
        if (bend_px > MOST_BEND * np.minimum(pitch_px[:, 1:], pitch_px[:, :-1])).any():
            return False
    return True


def _only(blobs_px: FloatArray, sizes_px: FloatArray, shape: tuple[int, ...]) -> ByteArray:
    """Draw an image of only these blobs, in which shadows and letters cannot disturb the grid detection."""
    picture = np.full(shape, 255, np.uint8)
    for center_px, size_px in zip(blobs_px.round().astype(int).tolist(), sizes_px.tolist(), strict=True):
        cv2.circle(picture, center_px, max(4, round(0.4 * size_px)), 0, -1, cv2.LINE_AA)
    return picture


def _why_no_circles(board: Board, blobs_px: FloatArray) -> str:
    wanted = board.columns * board.rows
    if not len(blobs_px):
        return "Nothing in it looks like a circle; is the board in the picture, sharp and evenly lit?"
    if len(blobs_px) < wanted:
        return f"{len(blobs_px)} of {wanted} circles are seen; show the whole board, without glare"
    return (
        f"{len(blobs_px)} blobs are seen, but no grid of {board.columns} x {board.rows} among them; check "
        "columns and rows, and that nothing round lies beside the board"
    )


def _goes_on(board: Board, points_px: FloatArray, blobs_px: FloatArray) -> bool:
    """Return whether the grid has another row or column, so that only a part of the board was found."""
    if board.pattern == "circles-asymmetric":  # with more rows, its grid would not have fitted
        return False
    columns, rows = board.size
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2).astype(float)
    image_of, _ = cv2.findHomography(grid, points_px)
    across, down = np.arange(columns), np.arange(rows)
    for x, y in ((across, -1), (across, rows), (-1, down), (columns, down)):
        x, y = np.broadcast_arrays(x, y)
        beyond = np.column_stack([x, y]).astype(float)[:, None]
        inward = np.clip(beyond, 0, (columns - 1, rows - 1))
        beyond_px, inward_px = (cv2.perspectiveTransform(one, image_of)[:, 0] for one in (beyond, inward))
        apart_px = np.linalg.norm(blobs_px[:, None] - beyond_px, axis=2).min(axis=0)
        if np.mean(apart_px < NEAR * np.linalg.norm(beyond_px - inward_px, axis=1)) >= MOST_OF_A_SIDE:
            return True
    return False


def _more_circles(board: Board) -> str:
    return f"The board has more circles than {board.columns} x {board.rows}; count its columns and rows"


def _upright(gray: ByteArray, board: Board, points_px: FloatArray) -> Detection:
    """Return the points in the board's order: right-handed, starting at the mark if there is one."""
    orders = [order for order in _orders(board) if _right_handed(points_px[order], board)]
    if board.pattern == "circles-asymmetric":
        return _all(board, points_px[orders[0]], oriented=True)
    ring = [_ring(gray, points_px[order], board) for order in orders]
    best = int(np.argmax(ring))
    marked = ring[best] > MARK_STEP and sum(value > MARK_STEP for value in ring) == 1
    return _all(board, points_px[orders[best if marked else 0]], marked)


def _orders(board: Board) -> list[IntArray]:
    """Return orders of a grid: unchanged, rotated by 180°, mirrored, and transposed if it is square."""
    grid = np.arange(board.columns * board.rows).reshape(board.rows, board.columns)
    if board.pattern == "circles-asymmetric":
        return [grid.ravel(), grid[::-1, ::-1].ravel(), grid[:, ::-1].ravel(), grid[::-1].ravel()]
    grids = [grid, grid.T] if board.columns == board.rows else [grid]
    return [
        one[::down, ::right].ravel() for one in grids for down, right in ((1, 1), (-1, -1), (1, -1), (-1, 1))
    ]


def _right_handed(points_px: FloatArray, board: Board) -> bool:
    """Return whether columns turn clockwise into rows, as x into y in an image."""
    first, last = points_px[0], points_px[-1]
    right, down = points_px[board.columns - 1] - first, points_px[-board.columns] - first
    turned = (right[0] * down[1] - right[1] * down[0]) > 0.0
    opposite = (last - points_px[-board.columns]) @ right > 0.0
    return bool(turned and opposite)


def _ring(gray: ByteArray, points_px: FloatArray, board: Board) -> float:
    """Return the first circle's brightness at its ring: 0 is that of neighbouring circles, 1 of the paper."""
    reach = 0.5 * sum(RING) * board.radius_m / board.spacing_m
    near = [0, 1, board.columns, board.columns + 1]
    right, down = points_px[1] - points_px[0], points_px[board.columns] - points_px[0]
    around = reach * np.array([right, -right, down, -down])
    first, *others = (_brightness(gray, points_px[row] + around).mean() for row in near)
    paper = _brightness(gray, points_px[near].mean(axis=0)[None])[0]
    dark = float(np.mean(others))
    return float((first - dark) / (paper - dark)) if paper != dark else 0.0


def _brightness(gray: ByteArray, points_px: FloatArray) -> FloatArray:
    """Return (N,) interpolated brightness."""
    x, y = points_px.T.astype(np.float32)
    return cv2.remap(gray.astype(np.float32), x[None], y[None], cv2.INTER_LINEAR)[0]


# Corners.


def _chessboard(gray: ByteArray, board: Board) -> Detection:
    ways: tuple[Callable[[], tuple[bool, FloatArray | None]], ...] = (
        lambda: cv2.findChessboardCornersSB(gray, board.size, flags=cv2.CALIB_CB_ACCURACY),
        lambda: cv2.findChessboardCornersSB(
            gray, board.size, flags=cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
        ),
        lambda: _refined(gray, board),
    )
    reason = (
        f"No chessboard of {board.columns} x {board.rows} inner corners is seen; count the corners between "
        "four squares, and have the whole board with its white rim in the picture, sharp and evenly lit"
    )
    for find in ways:
        found, corners = find()
        if not found or corners is None:
            continue
        points_px = np.asarray(corners, float).reshape(-1, 2)
        if not _even(points_px, board):
            continue
        inside, beyond = _alternation(gray, board, points_px)
        if beyond.max() > ALTERNATES:
            reason = (
                f"The board has more inner corners than {board.columns} x {board.rows}; "
                "count its columns and rows"
            )
        elif inside.min() > ALTERNATES:
            order = next(order for order in _orders(board) if _right_handed(points_px[order], board))
            return _dark_first(gray, board, points_px[order])
    return _nothing(reason)


def _alternation(gray: ByteArray, board: Board, points_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (4,) contrasts of alternating squares at the outermost rows and columns of corners, and (4,) one
    row or column further out, each over its inner neighbour's: 1 at corners, 0.5 at the board's rim.
    """
    grid = points_px.reshape(board.rows, board.columns, 2)
    for _ in range(2):  # extrapolate a row on either side; then, transposed, a column
        grid = np.concatenate([2 * grid[:1] - grid[1:2], grid, 2 * grid[-1:] - grid[-2:-1]]).swapaxes(0, 1)
    down, right = np.gradient(INTO_A_SQUARE * grid, axis=(0, 1))
    ways = (right + down, -right - down, right - down, down - right)
    squares_px = grid + np.stack(ways)
    one, opposite, left, below = _brightness(gray, squares_px.reshape(-1, 2)).reshape(squares_px.shape[:3])
    crossing = one + opposite - left - below
    crossing[::2] *= -1.0
    crossing[:, ::2] *= -1.0
    crossing *= np.sign(crossing[1:-1, 1:-1].mean())
    rows, columns = crossing[:, 1:-1].mean(axis=1), crossing[1:-1].mean(axis=0)
    sides = np.array([side[:3] for line in (rows, columns) for side in (line, line[::-1])])
    outside, last, inner = np.maximum(sides, 1.0).T  # 510 for black and white
    return last / inner, outside / last


def _refined(gray: ByteArray, board: Board) -> tuple[bool, FloatArray | None]:
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCorners(gray, board.size, flags=flags)
    if not found:
        return False, None
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    return True, cv2.cornerSubPix(gray, corners, (CORNER_WINDOW_PX,) * 2, (-1, -1), until)


def _dark_first(gray: ByteArray, board: Board, points_px: FloatArray) -> Detection:
    """Order corners to have a black square between the first four; ambiguous boards have one at both ends."""
    square = [0, 1, board.columns, board.columns + 1]
    here, there = (
        float(_brightness(gray, order[square].mean(axis=0)[None])[0])
        for order in (points_px, points_px[::-1])
    )
    if not board.ambiguous and there < here:
        points_px = points_px[::-1]
    return _all(board, points_px, oriented=not board.ambiguous)


def _charuco(gray: ByteArray, board: Board) -> Detection:
    corners, ids, marker_corners, _ = cv2.aruco.CharucoDetector(board.charuco()).detectBoard(gray)
    if ids is None or len(ids) < FEW_CHARUCO:
        seen = 0 if ids is None else len(ids)
        markers = 0 if marker_corners is None else len(marker_corners)
        reason = (
            f"{markers} markers and {seen} corners of the ChArUco board are seen, and it takes "
            f"{FEW_CHARUCO}; check columns and rows, and hold it nearer or lit better"
        )
        return _nothing(reason)
    return Detection(np.asarray(corners, float).reshape(-1, 2), np.asarray(ids).ravel().astype(np.int64))
