"""Calibration boards with known points: grids of circles, chessboards, ChArUco, AprilGrid (SPEC 1.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.calibration.dictionaries import APRILGRID, FAMILIES, dictionary, known_dictionary, markers_in
from pipeline.config import Pattern
from pipeline.types import FloatArray

CIRCLE_SHARE = 0.5
"""Ratio of a circle's diameter to the distance of its nearest neighbour."""
RING = (0.45, 0.75)
"""Radii, over the circle's, of the white ring in the first circle, which marks the orientation. The circle's
centre stays dark, because detectors of dark circles look there."""
MARKER_SHARE = 0.75
"""Ratio of a ChArUco marker's side to that of its square."""
SPACINGS_M = 1e-4, 10.0
"""Least and largest spacing. No printer draws a smaller one, and a spacing in metres that is given where
millimetres are expected is smaller, too."""
MOST_POINTS = 50
"""Most points in a row or column."""
TAG_SPACING = 0.3
"""Gap between the tags of Kalibr's AprilGrid, over the side of a tag."""


@dataclass(frozen=True, slots=True)
class Board:
    """A flat board; its points are in the plane z = 0, x to the right, y down, z away from the viewer.

    Raises:
        InputError: a value is impossible, or the dictionary has too few markers for the board.
    """

    pattern: Pattern = "circles"
    columns: int = 11
    """Circles, inner corners or AprilTags per row."""
    rows: int = 9
    spacing_m: float = 0.035
    """Pitch of circles, side of a square, or side of an AprilTag. For asymmetric circles: half the distance
    between neighbours in a row."""
    dictionary: str = ""
    """Dictionary of a ChArUco board's markers, such as 4X4_50; empty if any may be on the board."""
    tag_spacing: float = TAG_SPACING
    """Gap between two AprilTags over the side of a tag; Kalibr calls it tagSpacing."""

    def __post_init__(self) -> None:
        if self.pattern not in get_args(Pattern):
            known = ", ".join(get_args(Pattern))
            raise InputError(f"There is no pattern '{self.pattern}'; try one of {known}")
        for name, count in (("columns", self.columns), ("rows", self.rows)):
            if not 2 <= count <= MOST_POINTS:
                raise InputError(f"A board with {count} {name} cannot be used; try 2 to {MOST_POINTS}")
        least_m, most_m = SPACINGS_M
        if not least_m <= self.spacing_m < most_m:
            raise InputError(
                f"A spacing of {1000.0 * self.spacing_m:g} mm cannot be used; give it in millimetres, from "
                f"{1000.0 * least_m:g} to below {1000.0 * most_m:g}, for example 35"
            )
        if not 0.0 < self.tag_spacing <= 1.0:
            raise InputError(
                f"A tag spacing of {self.tag_spacing:g} cannot be used; try 0.3, the gap over the tag's side"
            )
        if self.dictionary:
            object.__setattr__(self, "dictionary", known_dictionary(self.dictionary))
            if self.pattern != "charuco":
                raise InputError(
                    f"A board of pattern {self.pattern} has no dictionary to choose; leave it out, or "
                    "try the pattern charuco"
                )
        self._check_markers()

    def _check_markers(self) -> None:
        if self.pattern not in ("charuco", "aprilgrid"):
            return
        name = self.marker_dictionary
        if self.markers > markers_in(name):
            raise InputError(
                f"A {self.pattern} board of {self.columns} x {self.rows} has {self.markers} markers, and the "
                f"dictionary {name} has {markers_in(name)}; try fewer columns or rows"
                + ("" if self.pattern == "aprilgrid" else f", or {FAMILIES[0]}")
            )

    @property
    def marker_dictionary(self) -> str:
        """Dictionary of the markers that are printed."""
        return APRILGRID if self.pattern == "aprilgrid" else self.dictionary or FAMILIES[0]

    @property
    def markers(self) -> int:
        """Number of markers on a ChArUco board or an AprilGrid."""
        if self.pattern == "aprilgrid":
            return self.columns * self.rows
        return (self.columns + 1) * (self.rows + 1) // 2

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of points; each AprilTag has two by two."""
        times = 2 if self.pattern == "aprilgrid" else 1
        return times * self.columns, times * self.rows

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows, as OpenCV uses them."""
        return self.columns, self.rows

    @property
    def points_m(self) -> FloatArray:
        """(N, 3) points of ``grid`` row by row from the upper left; the board's centre is the origin."""
        columns, rows = self.grid
        row, column = np.divmod(np.arange(rows * columns), columns)
        x, y = column.astype(float), row.astype(float)
        if self.pattern == "circles-asymmetric":
            x = 2.0 * x + row % 2
        if self.pattern == "aprilgrid":
            x, y = (one // 2 * (1.0 + self.tag_spacing) + one % 2 for one in (column, row))
        flat = np.column_stack([x, y, np.zeros(len(x))]) * self.spacing_m
        return flat - 0.5 * (flat.min(axis=0) + flat.max(axis=0))

    @property
    def nearest_m(self) -> float:
        """Distance from a circle or corner to its nearest neighbour; of an AprilGrid, the side of a tag."""
        return self.spacing_m * (2.0**0.5 if self.pattern == "circles-asymmetric" else 1.0)

    @property
    def radius_m(self) -> float:
        """Radius of a circle."""
        return 0.5 * CIRCLE_SHARE * self.nearest_m

    @property
    def ambiguous(self) -> bool:
        """Whether the points look the same upside down, so that only a mark shows the orientation."""
        if self.pattern == "circles":
            return True
        if self.pattern == "circles-asymmetric":
            return self.rows % 2 == 0
        return self.pattern == "chessboard" and (self.columns - self.rows) % 2 == 0

    @property
    def title(self) -> str:
        """Description of the board in one line."""
        kinds = {
            "circles": f"{self.columns} x {self.rows} circles, pitch",
            "circles-asymmetric": f"{self.columns} x {self.rows} circles in shifted rows, half pitch",
            "chessboard": f"chessboard of {self.columns} x {self.rows} inner corners, squares of",
            "charuco": f"ChArUco board of {self.columns} x {self.rows} inner corners, squares of",
            "aprilgrid": f"AprilGrid of {self.columns} x {self.rows} tags, tag spacing "
            f"{self.tag_spacing:g}, tags of",
        }
        return f"{kinds[self.pattern]} {1000.0 * self.spacing_m:g} mm"

    def charuco(self, name: str = "", legacy: bool = False) -> Any:
        """Return OpenCV's board with the same squares and markers.

        Args:
            name: dictionary; empty takes the board's own.
            legacy: whether a board with an even number of rows of squares begins with a white square, as
                OpenCV before 4.6 drew it.
        """
        squares = (self.columns + 1, self.rows + 1)
        markers = dictionary(name or self.marker_dictionary)
        made = cv2.aruco.CharucoBoard(squares, self.spacing_m, MARKER_SHARE * self.spacing_m, markers)
        made.setLegacyPattern(legacy)
        return made
