"""Detection of grids of circles, straight or in shifted rows (SPEC 1.2). The points are never mirrored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from scipy.sparse.csgraph import connected_components

from pipeline.calibration.board import RING, Board
from pipeline.calibration.chessboard import chessboard_size
from pipeline.calibration.circle_lattice import board_seen, orders_on
from pipeline.calibration.detection import Detection, brightness, not_found, whole
from pipeline.calibration.grid_order import even_steps, upright_orders
from pipeline.types import ByteArray, FloatArray, IntArray

SMALLEST_PX, LARGEST_SHARE = 20.0, 0.02
"""Least area of a circle in pixels, and its largest area as a share of the image. OpenCV's own limit of 5,000
pixels would miss the circles of a board near the camera."""
SIZES = 4.0
"""Largest ratio of the diameters of two circles of a tilted board, or of a circle and the marked circle's
core."""
MARK_STEP = 0.25
"""Least brightness at which the white ring is recognised: 0 is that of a circle, 1 that of the paper."""
LETTER = 0.6
"""Blobs smaller than this share of the median diameter may be letters on the sheet."""
LINK = 2.0
"""Blobs farther from the others than this many median neighbour distances are not on the board."""
NEAR, MOST_OF_A_SIDE = 0.3, 0.8
"""The grid continues if another row has blobs within the first, in pitches, of at least the second share of
its points."""


def find_circles(gray: ByteArray, board: Board) -> Detection:
    """Find a grid of circles by several detectors in turn; if OpenCV finds no grid, by growing a lattice.

    Args:
        gray: (H, W) uint8.
        board: the board to find.
    """
    most: FloatArray = np.zeros((0, 2))
    groups: list[FloatArray] = []
    expected = board.columns * board.rows
    for picture, detector in _blob_detectors(gray):
        all_px: FloatArray = np.zeros((0, 2))
        for blobs_px, sizes_px in _groups(detector.detect(picture), board):
            all_px = blobs_px if len(blobs_px) > len(all_px) else all_px
            most = all_px if len(all_px) > len(most) else most
            groups += [blobs_px, blobs_px[sizes_px > LETTER * np.median(sizes_px)]]
            if len(blobs_px) < expected:
                continue
            for orders in _grids(board, blobs_px, sizes_px, gray.shape, detector):
                if _goes_on(board, orders[0], all_px):
                    return not_found(_more_circles(board, groups), all_px)
                return _marked(gray, board, orders)
    for blobs_px in groups:
        orders = [blobs_px[order] for order in orders_on(board, blobs_px)]
        if orders and not _goes_on(board, orders[0], most):
            return _marked(gray, board, orders)
    return not_found(_why_no_circles(gray, board, most, groups), most)


def _grids(
    board: Board,
    blobs_px: FloatArray,
    sizes_px: FloatArray,
    shape: tuple[int, ...],
    detector: cv2.SimpleBlobDetector,
) -> Iterator[list[FloatArray]]:
    """Yield the possible orders of the points of each grid that OpenCV finds among blobs."""
    asymmetric = board.pattern == "circles-asymmetric"
    grid = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    alone = _only(blobs_px, sizes_px, shape)
    for clustering in (cv2.CALIB_CB_CLUSTERING, 0):
        found, rough = cv2.findCirclesGrid(alone, board.size, flags=grid | clustering, blobDetector=detector)
        if not found:
            continue
        apart_px = np.linalg.norm(blobs_px[:, None] - rough.reshape(1, -1, 2), axis=2)
        chosen = apart_px.argmin(axis=0)
        if len(np.unique(chosen)) < len(chosen) or not even_steps(blobs_px[chosen], board):
            continue
        orders = [blobs_px[chosen[order]] for order in upright_orders(board, blobs_px[chosen])]
        if orders:
            yield orders


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


def _groups(blobs: Sequence[cv2.KeyPoint], board: Board) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield (B, 2) centres and (B,) diameters of groups of blobs that may be the board's circles: the largest
    group of similar size, then the largest blobs, because letters on the sheet are smaller than circles.
    """
    expected = board.columns * board.rows
    sizes_px = np.array([blob.size for blob in blobs])
    if not len(sizes_px):
        return
    centres_px = np.array([blob.pt for blob in blobs], float)
    alike = max(((sizes_px >= one) & (sizes_px <= SIZES * one) for one in sizes_px), key=np.sum)
    near_px, near_sizes_px = _together(centres_px[alike], sizes_px[alike], board)
    yield near_px, near_sizes_px
    if len(near_px) > expected:
        largest = np.sort(np.argsort(-near_sizes_px, kind="stable")[:expected])
        yield near_px[largest], near_sizes_px[largest]
    if len(sizes_px) > expected and alike.sum() >= expected:
        largest = sizes_px >= np.sort(sizes_px)[-expected]
        yield _together(centres_px[largest], sizes_px[largest], board)


def _together(blobs_px: FloatArray, sizes_px: FloatArray, board: Board) -> tuple[FloatArray, FloatArray]:
    """Return the largest group of blobs linked through neighbours; all, if no more than the board has."""
    if len(blobs_px) <= board.columns * board.rows:
        return blobs_px, sizes_px
    apart_px = np.linalg.norm(blobs_px[:, None] - blobs_px, axis=2)
    pitch_px = np.median(np.sort(apart_px, axis=1)[:, 1])
    _, group = connected_components(apart_px < LINK * pitch_px)
    mine = group == np.bincount(group).argmax()
    return blobs_px[mine], sizes_px[mine]


def _only(blobs_px: FloatArray, sizes_px: FloatArray, shape: tuple[int, ...]) -> ByteArray:
    """Draw an image of only these blobs, in which shadows and letters cannot disturb the grid detection."""
    picture = np.full(shape, 255, np.uint8)
    for center_px, size_px in zip(blobs_px.round().astype(int).tolist(), sizes_px.tolist(), strict=True):
        cv2.circle(picture, center_px, max(4, round(0.4 * size_px)), 0, -1, cv2.LINE_AA)
    return picture


def _why_no_circles(gray: ByteArray, board: Board, blobs_px: FloatArray, groups: Sequence[FloatArray]) -> str:
    expected = board.columns * board.rows
    if not len(blobs_px):
        return (
            "Nothing in it looks like a circle; have the board in the picture, sharp and evenly lit, or "
            "check --pattern"
        )
    other = _seen(board, groups)
    if other is not None and (other.pattern, other.size) != (board.pattern, board.size):
        size = chessboard_size(gray, board.columns >= board.rows)  # its squares look like shifted circles
        chessboard = "" if size is None else f", or --pattern chessboard --columns {size[0]} --rows {size[1]}"
        first = "show the whole board, or " if other.columns * other.rows < expected else ""
        return (
            f"{_grid_name(other)} are seen, not {_grid_name(board)}; {first}try --pattern {other.pattern} "
            f"--columns {other.columns} --rows {other.rows}{chessboard}"
        )
    if len(blobs_px) < expected:
        return (
            f"{len(blobs_px)} of {expected} circles are seen; show the whole board, without glare, or check "
            "--pattern, --columns and --rows"
        )
    kind = "shifted rows" if board.pattern == "circles-asymmetric" else "straight rows"
    return (
        f"{len(blobs_px)} circles are seen, but no {kind} of {board.columns} x {board.rows} among them; "
        "check --pattern, --columns and --rows, and that nothing else round is in the picture"
    )


def _seen(board: Board, groups: Sequence[FloatArray]) -> Board | None:
    """Return the board that the first group of blobs with a whole grid forms."""
    return next((one for group in groups if (one := board_seen(group, board)) is not None), None)


def _grid_name(board: Board) -> str:
    kind = "shifted rows" if board.pattern == "circles-asymmetric" else "straight rows"
    return f"{board.columns} x {board.rows} circles in {kind}"


def _goes_on(board: Board, points_px: FloatArray, blobs_px: FloatArray) -> bool:
    """Return whether the grid has another row or column, so that only a part of the board was found."""
    shifted = board.pattern == "circles-asymmetric"
    columns, rows = board.size
    row, column = np.divmod(np.arange(rows * columns), columns)
    image_of, _ = cv2.findHomography(_places(row, column, shifted), points_px)
    across, down = np.arange(columns), np.arange(rows)
    for outside in ((-1, across), (rows, across), (down, -1), (down, columns)):
        row, column = np.broadcast_arrays(*outside)
        beyond = _places(row, column, shifted)
        inward = _places(np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1), shifted)
        beyond_px, inward_px = (
            cv2.perspectiveTransform(one[:, None], image_of)[:, 0] for one in (beyond, inward)
        )
        apart_px = np.linalg.norm(blobs_px[:, None] - beyond_px, axis=2).min(axis=0)
        if np.mean(apart_px < NEAR * np.linalg.norm(beyond_px - inward_px, axis=1)) >= MOST_OF_A_SIDE:
            return True
    return False


def _places(row: IntArray, column: IntArray, shifted: bool) -> FloatArray:
    """Return (N, 2) positions of circles in a grid with rows one unit apart."""
    x = 2 * column + row % 2 if shifted else column
    return np.column_stack([x, row]).astype(float)


def _more_circles(board: Board, groups: Sequence[FloatArray]) -> str:
    seen = _seen(board, groups)
    remedy = "check --columns and --rows"
    if seen is not None and seen.pattern == board.pattern:
        remedy = f"try --columns {seen.columns} --rows {seen.rows}"
    return f"The board has more circles than {board.columns} x {board.rows}; {remedy}"


def _marked(gray: ByteArray, board: Board, orders: Sequence[FloatArray]) -> Detection:
    """Return the detection in the order of points that starts at the marked circle; without exactly one such
    order, the first order, as not oriented.
    """
    if not board.ambiguous:
        return whole(board, orders[0], oriented=True)
    ring = [_ring(gray, points_px, board) for points_px in orders]
    best = int(np.argmax(ring))
    marked = ring[best] > MARK_STEP and sum(value > MARK_STEP for value in ring) == 1
    return whole(board, orders[best if marked else 0], marked)


def _ring(gray: ByteArray, points_px: FloatArray, board: Board) -> float:
    """Return the first circle's brightness at its ring: 0 is that of neighbouring circles, 1 of the paper."""
    reach = 0.5 * sum(RING) * board.radius_m / board.spacing_m
    near = [0, 1, board.columns, board.columns + 1]
    right, down = points_px[1] - points_px[0], points_px[board.columns] - points_px[0]
    if board.pattern == "circles-asymmetric":  # the second row begins one spacing to the right
        right = 0.5 * right
        down = down - right
    around = reach * np.array([right, -right, down, -down])
    first, *others = (brightness(gray, points_px[row] + around).mean() for row in near)
    paper = brightness(gray, points_px[near].mean(axis=0)[None])[0]
    dark = float(np.mean(others))
    return float((first - dark) / (paper - dark)) if paper != dark else 0.0
