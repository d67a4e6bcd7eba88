"""Detection of AprilGrid boards: AprilTags of the family 36h11 in rows, as Kalibr prints them.

Kalibr joins the tags' corners by black squares, which makes each corner one of a chessboard. Small tags are
found in an enlarged image; corners are refined in the image itself.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.detection import Detection, not_found
from pipeline.calibration.dictionaries import APRILGRID, FAMILIES
from pipeline.calibration.markers import (
    FEW_CORNERS,
    FITS,
    LEAST_MARKERS,
    Fit,
    Markers,
    changed_image,
    dictionaries_in,
    fit,
    markers_of,
    placed,
)
from pipeline.types import ByteArray, FloatArray, IntArray

ENLARGED = (1, 2)
"""Enlargements of the image in which tags are searched."""
BORDERS = (2, 1)
"""Widths of a tag's black border in cells: that of Kalibr, and that of other programs."""
CELLS = 6
"""Cells along a tag of 36h11 inside its border."""
OTHER_SPACING = 0.05
"""Difference, over a tag's side, above which the gap between the tags is not the board's."""
ENOUGH = 0.9
"""Share of the board's tags at which the search stops."""
WINDOW, WINDOW_PX = 0.6, (2, 8)
"""Half width of the window in which a corner is refined, as a share of the border or the gap, and its limits
in pixels.
"""
STRAY, WRONG = 0.03, 0.06
"""Shares of a tag's side. Corners farther than the first from where the tags around predict them are refined
again from there; corners then farther than the second are left out."""


def find_aprilgrid(gray: ByteArray, board: Board) -> Detection:
    """Find the corners of the tags.

    Args:
        gray: (H, W) uint8.
        board: the board to find.
    """
    seen, border = _most_tags(gray, board)
    fits = [
        (points, fitted) for points in _layouts(board) if (fitted := _fit(board, seen, points)) is not None
    ]
    fits = [(points, fitted) for points, fitted in fits if not fitted.mirrored and fitted.share >= FITS]
    if not fits:
        return not_found(_why_not(gray, board, seen))
    points, fitted = fits[0]
    numbers, corners_px = seen.ids[fitted.in_place], seen.corners_px[fitted.in_place]
    indices = points[numbers][:, _turn(board, points[numbers], corners_px)]
    refined_px = _refined(gray, board, corners_px, border)
    spacing = _tag_spacing(board, fitted, refined_px)
    if abs(spacing - board.tag_spacing) > OTHER_SPACING:
        return not_found(
            f"The gap between the tags is {spacing:.2f} of a tag's side, not {board.tag_spacing:g}; try "
            f"--tag-spacing {spacing:.2f}, or what the board's maker states"
        )
    predicted_px = _predicted(board, points[numbers], indices, refined_px)
    stray = _apart(refined_px, predicted_px) > STRAY
    refined_px = _refined(gray, board, np.where(stray[:, :, None], predicted_px, refined_px), border)
    size_px = np.array(gray.shape[::-1])
    good = (_apart(refined_px, predicted_px) <= WRONG) & ((refined_px >= 0) & (refined_px < size_px)).all(
        axis=2
    )
    if good.sum() < FEW_CORNERS:
        return not_found(
            f"{seen.title} are seen, but only {good.sum()} of their corners where the tags around predict "
            f"them, and it takes {FEW_CORNERS}; have the board flat, sharp and larger in the picture"
        )
    order = np.argsort(indices[good])
    return Detection(refined_px[good][order], indices[good][order])


def tag_points(board: Board, upwards: bool = True) -> IntArray:
    """Return (T, 4) indices in ``Board.points_m`` of the corners of each tag, clockwise from the upper left.

    Args:
        board: an AprilGrid.
        upwards: whether the numbers begin in the lowest row, as on Kalibr's boards, or in the highest.
    """
    row, column = np.divmod(np.arange(board.markers), board.columns)
    if upwards:
        row = board.rows - 1 - row
    first = 2 * row * 2 * board.columns + 2 * column
    return np.stack([first, first + 1, first + 1 + 2 * board.columns, first + 2 * board.columns], axis=1)


def _tag_spacing(board: Board, fitted: Fit, corners_px: FloatArray) -> float:
    """Return the gap between tags over a tag's side, as measured in the image."""
    corners = placed(fitted.on_board, corners_px.reshape(-1, 2)).reshape(-1, 4, 2)
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    pitch = (1.0 + board.tag_spacing) * board.spacing_m
    return pitch / float(np.median(sides)) - 1.0


def _layouts(board: Board) -> tuple[IntArray, ...]:
    return tag_points(board), tag_points(board, upwards=False)


def _most_tags(gray: ByteArray, board: Board) -> tuple[Markers, int]:
    """Return the tags of the search that finds most, and the width of their border in cells."""
    best = Markers(APRILGRID, np.zeros(0, np.int64), np.zeros((0, 4, 2))), BORDERS[0]
    for border in BORDERS:
        for times in ENLARGED:
            larger = cv2.resize(gray, None, fx=times, fy=times, interpolation=cv2.INTER_CUBIC)
            seen = markers_of(larger, APRILGRID, border)
            seen = replace(seen, corners_px=(seen.corners_px + 0.5) / times - 0.5)
            if len(seen.ids) > len(best[0].ids):
                best = seen, border
            if len(seen.ids) >= ENOUGH * board.markers:
                return best
        if len(best[0].ids) >= LEAST_MARKERS:
            break
    return best


def _fit(board: Board, seen: Markers, points: IntArray) -> Fit | None:
    centres_m = board.points_m[points][:, :, :2].mean(axis=1)
    return fit(seen, centres_m, (1.0 + board.tag_spacing) * board.spacing_m)


def _turn(board: Board, points: IntArray, corners_px: FloatArray) -> list[int]:
    """Return the order of a tag's corners on the board that matches the order in its own picture.

    Programs print the same tag in different orientations, but all tags of a board in one.

    Args:
        board: the board.
        points: (T, 4) indices of the corners on the board.
        corners_px: (T, 4, 2) the same tags in the image.
    """
    turns = [np.roll(np.arange(4), -turn).tolist() for turn in range(4)]
    off_px = []
    for turn in turns:
        on_board = board.points_m[points[:, turn].ravel(), None, :2]
        image_of, _ = cv2.findHomography(on_board, corners_px.reshape(-1, 2))
        at_px = cv2.perspectiveTransform(on_board, image_of)[:, 0]
        off_px.append(float(np.linalg.norm(at_px - corners_px.reshape(-1, 2), axis=1).mean()))
    return turns[int(np.argmin(off_px))]


def _refined(gray: ByteArray, board: Board, corners_px: FloatArray, border: int) -> FloatArray:
    """Return (T, 4, 2) corners with subpixel accuracy; those outside the image are unchanged."""
    room_px = _sides_px(corners_px) * min(border / (CELLS + 2 * border), board.tag_spacing)
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    refined = corners_px.copy()
    most_px = np.array(gray.shape[::-1]) - 1.0
    inside = np.asarray(((corners_px >= 0.0) & (corners_px <= most_px)).all(axis=2), bool)
    for row, room in enumerate(room_px):
        window = int(np.clip(WINDOW * room, *WINDOW_PX))
        near = corners_px[row][inside[row]][:, None].astype(np.float32)
        if len(near):
            near = cv2.cornerSubPix(gray, near, (window, window), (-1, -1), until)
            refined[row, inside[row]] = near[:, 0]
    return refined


def _predicted(board: Board, points: IntArray, indices: IntArray, corners_px: FloatArray) -> FloatArray:
    """Return (T, 4, 2) corners of each tag as predicted by a homography of its corners and those around it.

    Args:
        board: the board.
        points: (T, 4) indices of the tags' corners on the board, clockwise from the upper left.
        indices: (T, 4) the same in the order of ``corners_px``.
        corners_px: (T, 4, 2) corners in the image.
    """
    centres_m = board.points_m[points].mean(axis=1)
    reach_m = 1.5 * (1.0 + board.tag_spacing) * board.spacing_m
    predicted = np.empty_like(corners_px)
    for row, centre_m in enumerate(centres_m):
        around = np.abs(centres_m - centre_m).max(axis=1) < reach_m
        on_board, at_px = board.points_m[indices[around].ravel(), :2], corners_px[around].reshape(-1, 2)
        limit_px = STRAY * float(_sides_px(corners_px[row : row + 1])[0])
        image_of, _ = cv2.findHomography(on_board, at_px, cv2.RANSAC, limit_px)
        own = board.points_m[indices[row], None, :2]
        predicted[row] = (
            corners_px[row] if image_of is None else cv2.perspectiveTransform(own, image_of)[:, 0]
        )
    return predicted


def _apart(corners_px: FloatArray, predicted_px: FloatArray) -> FloatArray:
    """Return (T, 4) distances of corners from their predictions, over the sides of their tags."""
    apart_px = np.linalg.norm(corners_px - predicted_px, axis=2)
    return np.asarray(apart_px / _sides_px(predicted_px)[:, None])


def _sides_px(corners_px: FloatArray) -> FloatArray:
    """Return (T,) lengths of the shortest sides of tags."""
    return np.linalg.norm(corners_px - np.roll(corners_px, 1, axis=1), axis=2).min(axis=1)


def _why_not(gray: ByteArray, board: Board, seen: Markers) -> str:
    """Return what was seen instead of the board, and what to change."""
    if len(seen.ids) < LEAST_MARKERS:
        others = dictionaries_in(gray, [name for name in FAMILIES if name != APRILGRID])
        other = max(others, key=lambda one: len(one.ids), default=None)
        if other is not None:
            return (
                f"No AprilGrid is seen, but {other.title}; try --pattern charuco, or a grid of AprilTags of "
                "the family 36h11"
            )
        changed = changed_image(gray)
        if changed:
            return changed
        return (
            f"{len(seen.ids)} of the {board.markers} AprilTags (36h11) are seen, and it takes "
            f"{LEAST_MARKERS}; have "
            "the board larger in the picture, sharp and evenly lit, or check --pattern"
        )
    return (
        f"{seen.title} are seen, but not in the places of an AprilGrid of {board.columns} x {board.rows} "
        f"tags, which has the numbers 0 to {board.markers - 1} row by row; check --columns, --rows and "
        "--tag-spacing"
    )
