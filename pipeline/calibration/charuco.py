"""Detection of ChArUco boards of any dictionary, in the layout of OpenCV before or after version 4.6 (SPEC
1.2).
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.calibration.board import MOST_POINTS, Board
from pipeline.calibration.detection import Detection, not_found
from pipeline.calibration.dictionaries import APRILGRID, FAMILIES, markers_in
from pipeline.calibration.markers import (
    FEW_CORNERS,
    FITS,
    LEAST_MARKERS,
    Fit,
    Markers,
    centres_of,
    changed_image,
    dictionaries_in,
    fit,
    markers_of,
)
from pipeline.types import ByteArray


def find_charuco(gray: ByteArray, board: Board) -> Detection:
    """Find the corners of a ChArUco board by the markers of its dictionary, or of all dictionaries in turn.

    Args:
        gray: (H, W) uint8.
        board: the board to find.
    """
    most = markers_of(gray, board.dictionary or FAMILIES[0])
    found, corners = _by_markers(gray, board, most)
    if found is not None:
        return found
    if not board.dictionary and len(most.ids) < LEAST_MARKERS:
        for seen in dictionaries_in(gray, FAMILIES[1:]):
            found, count = _by_markers(gray, board, seen)
            if found is not None:
                return found
            if len(seen.ids) > len(most.ids):
                most, corners = seen, count
    return not_found(_why_not(gray, board, most, corners))


def _by_markers(gray: ByteArray, board: Board, seen: Markers) -> tuple[Detection | None, int]:
    """Return the detection by these markers, or None, and the number of corners found; the layout that the
    markers fit better is tried first.
    """
    if not len(seen.ids) or seen.border_cells > 1 or board.markers > markers_in(seen.dictionary):
        return None, 0
    most = 0
    for legacy in _layouts(board, seen):
        detector = cv2.aruco.CharucoDetector(board.charuco(seen.dictionary, legacy))
        markers = seen.corners_px.astype(np.float32)[:, None]
        corners, ids, *_ = detector.detectBoard(
            gray, markerCorners=list(markers), markerIds=seen.ids[:, None].astype(np.int32)
        )
        if ids is not None and len(ids) >= FEW_CORNERS:
            points_px = np.asarray(corners, float).reshape(-1, 2)
            indices = np.asarray(ids).ravel().astype(np.int64)
            return Detection(points_px, indices, legacy=legacy), len(ids)
        most = max(most, 0 if ids is None else len(ids))
    return None, most


def _fit(board: Board, seen: Markers, legacy: bool) -> Fit | None:
    places = centres_of(board.charuco(seen.dictionary, legacy))
    return fit(seen, places, 2.0**0.5 * board.spacing_m)


def _layouts(board: Board, seen: Markers) -> list[bool]:
    """Return the layouts to try as values of ``legacy``, the likelier first; for an odd number of rows of
    squares both layouts are the same.
    """
    if board.rows % 2 == 0:
        return [False]
    fits = [_fit(board, seen, legacy) for legacy in (False, True)]
    new, old = (0.0 if one is None else one.share for one in fits)
    return [True, False] if old > new else [False, True]


def _why_not(gray: ByteArray, board: Board, seen: Markers, corners: int) -> str:
    """Return what was seen instead of the board, and what to change."""
    if len(seen.ids) < LEAST_MARKERS:
        others = max(
            dictionaries_in(gray, [name for name in FAMILIES if name == APRILGRID or name != seen.dictionary])
            if board.dictionary
            else (),
            key=lambda one: len(one.ids),
            default=None,
        )
        if others is not None and others.border_cells > 1:
            return _aprilgrid(others)
        if others is not None:
            return (
                f"No markers of {board.dictionary} are seen, but {others.title}; "
                f"try --dictionary {others.dictionary}"
            )
        changed = changed_image(gray)
        if changed:
            return changed
        what = f"of {board.dictionary}" if board.dictionary else "of any dictionary that OpenCV knows"
        return (
            f"{len(seen.ids) or 'No'} marker{'' if len(seen.ids) == 1 else 's'} {what} "
            f"{'is' if len(seen.ids) == 1 else 'are'} seen; have the board larger in the picture, sharp and "
            "evenly lit, or check --pattern"
        )
    if seen.border_cells > 1:
        return _aprilgrid(seen)
    found = f"{seen.title} are seen"
    size = _size_of(board, seen)
    if size is not None and size != board.size:
        return (
            f"{found}, which are those of a board of {size[0]} x {size[1]} inner corners, not of "
            f"{board.columns} x {board.rows}; try --columns {size[0]} --rows {size[1]}"
        )
    if size is None:
        return (
            f"{found}, but not in the places of a board of {board.columns} x {board.rows} inner corners, "
            f"with the numbers 0 to {board.markers - 1} row by row; check --pattern, --columns and --rows"
        )
    return (
        f"{found}, but only {corners} of the corners between them, and it takes {FEW_CORNERS}; have more of "
        "the board in the picture, larger and sharp"
    )


def _aprilgrid(seen: Markers) -> str:
    return f"{seen.title} with the double border of an AprilGrid are seen; try --pattern aprilgrid"


def _size_of(board: Board, seen: Markers) -> tuple[int, int] | None:
    """Return columns and rows of a board whose places the markers fit, the given board's if they fit it; None
    if they fit no board.
    """
    sizes = [board.size]
    for columns in range(2, MOST_POINTS + 1):
        rows = -(-2 * (int(seen.ids.max()) + 1) // (columns + 1)) - 1
        sizes += [(columns, more) for more in (rows, rows + 1) if 2 <= more <= MOST_POINTS]
    for columns, rows in sizes:
        if (columns + 1) * (rows + 1) // 2 > markers_in(seen.dictionary):
            continue
        other = Board("charuco", columns, rows, board.spacing_m, seen.dictionary)
        for legacy in (False, True):
            fitted = _fit(other, seen, legacy)
            if fitted is not None and fitted.share >= FITS and not fitted.mirrored:
                return columns, rows
    return None
