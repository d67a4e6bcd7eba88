"""Square markers in an image: their dictionary, and their agreement with their places on a board."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from pipeline.calibration.dictionaries import APRILGRID, FAMILIES, dictionary
from pipeline.types import BoolArray, ByteArray, FloatArray, IntArray

LEAST_MARKERS = 4
"""Least number of markers by which a dictionary is recognised: noise gives single ones, too."""
FEW_CORNERS = 6
"""Least number of corners for the detection of a board."""
OFF = 0.3
"""Largest distance of a marker from its place on the board, in pitches of the board."""
FITS = 0.8
"""Least share of the markers that must be in their places on a board for the board to be the right one."""


@dataclass(frozen=True, slots=True)
class Markers:
    """Markers of one dictionary in one image."""

    dictionary: str
    ids: IntArray
    """(M,) numbers in the dictionary."""
    corners_px: FloatArray
    """(M, 4, 2) clockwise from the upper left of the marker's own picture."""
    border_cells: int = 1
    """Width of the black border of the markers."""

    @property
    def centres_px(self) -> FloatArray:
        """(M, 2) means of the corners."""
        return self.corners_px.mean(axis=1)

    @property
    def title(self) -> str:
        """Description in words."""
        if len(self.ids) == 1:
            return f"1 marker of the dictionary {self.dictionary} (number {self.ids[0]})"
        return (
            f"{len(self.ids)} markers of the dictionary {self.dictionary} (numbers {self.ids.min()} to "
            f"{self.ids.max()})"
        )


@dataclass(frozen=True, slots=True)
class Fit:
    """Agreement of detected markers with their places on a board."""

    on_board: FloatArray
    """(3, 3) homography from pixels to the board's plane, in the unit of the places given to ``fit``."""
    in_place: BoolArray
    """(M,) whether each marker is in its place on the board."""

    @property
    def share(self) -> float:
        """Share of the markers in their places."""
        return float(self.in_place.mean())

    @property
    def mirrored(self) -> bool:
        """Whether the image would have to be a mirror image of the board."""
        return float(np.linalg.det(self.on_board)) < 0.0


def markers_of(gray: ByteArray, name: str, border_cells: int = 1) -> Markers:
    """Find the markers of one dictionary, each number once.

    Args:
        gray: (H, W) uint8.
        name: the dictionary.
        border_cells: width of the markers' black border.
    """
    settings = cv2.aruco.DetectorParameters()
    settings.markerBorderBits = border_cells
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary(name), settings).detectMarkers(gray)
    if ids is None:
        return Markers(name, np.zeros(0, np.int64), np.zeros((0, 4, 2)), border_cells)
    numbers, first = np.unique(np.asarray(ids).ravel(), return_index=True)
    corners_px = np.asarray(corners, float).reshape(-1, 4, 2)[first]
    return Markers(name, numbers.astype(np.int64), corners_px, border_cells)


def dictionaries_in(gray: ByteArray, names: Iterable[str] = FAMILIES) -> Iterator[Markers]:
    """Yield the markers of every dictionary of which the image shows at least ``LEAST_MARKERS``."""
    for name in names:
        seen = markers_of(gray, name)
        if name == APRILGRID and len(seen.ids) < LEAST_MARKERS:  # Kalibr prints a border of two cells
            seen = markers_of(gray, name, 2)
        if len(seen.ids) >= LEAST_MARKERS:
            yield seen


def changed_image(gray: ByteArray) -> str:
    """Return a sentence with the remedy if the mirror image or the negative of an image shows markers; else
    an empty string.
    """
    for picture, what, remedy in (
        (np.ascontiguousarray(gray[:, ::-1]), "mirror images", "turn off mirroring in the camera's program"),
        (255 - gray, "white on black", "print the board black on white, or invert the images"),
    ):
        seen = next(dictionaries_in(picture), None)
        if seen is not None:
            return f"{seen.title} are seen, but as {what}; {remedy}"
    return ""


def fit(seen: Markers, centres: FloatArray, pitch: float) -> Fit | None:
    """Compare markers with a board; returns None if too few of the board's are seen or in their places.

    Args:
        seen: markers in the image.
        centres: (B, 2) places of the board's markers by their numbers.
        pitch: distance of neighbouring markers, in the unit of the places.
    """
    known = seen.ids < len(centres)
    if known.sum() < LEAST_MARKERS:
        return None
    on_board, _ = cv2.findHomography(
        seen.centres_px[known], centres[seen.ids[known]], cv2.RANSAC, OFF * pitch
    )
    if on_board is None or not np.isfinite(on_board).all():
        return None
    in_place = np.zeros(len(known), bool)
    off = placed(on_board, seen.centres_px[known]) - centres[seen.ids[known]]
    in_place[known] = np.linalg.norm(off, axis=1) <= OFF * pitch
    return Fit(on_board, in_place) if in_place.sum() >= LEAST_MARKERS else None


def placed(on_board: FloatArray, points_px: FloatArray) -> FloatArray:
    """Return (N, 2) points mapped by a (3, 3) homography."""
    return np.asarray(cv2.perspectiveTransform(points_px[:, None], on_board))[:, 0]


def centres_of(board: Any) -> FloatArray:
    """Return the (B, 2) places of the markers of OpenCV's board, by their numbers from 0."""
    return np.asarray(board.getObjPoints(), float)[:, :, :2].mean(axis=1)
