"""Calibration boards with known points: grids of circles, chessboards, ChArUco (SPEC 1.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.config import Pattern
from pipeline.types import FloatArray

CIRCLE_SHARE = 0.5
"""Ratio of a circle's diameter to the distance of its nearest neighbour."""
RING = (0.45, 0.75)
"""Radii, over the circle's, of the white ring in the first circle, which marks the orientation. The circle's
centre stays dark, because detectors of dark circles look there."""
MARKER_SHARE = 0.75
"""Ratio of a ChArUco marker's side to that of its square."""
MOST_POINTS = 50
"""Most points in a row or column."""
MARKERS = cv2.aruco.DICT_5X5_1000


@dataclass(frozen=True, slots=True)
class Board:
    """A flat board; its points are in the plane z = 0, x to the right, y down, z away from the viewer."""

    pattern: Pattern = "circles"
    columns: int = 11
    """Circles, or inner corners, per row."""
    rows: int = 9
    spacing_m: float = 0.035
    """Pitch of circles, or side of a square. For asymmetric circles: half the distance of two in a row."""

    def __post_init__(self) -> None:
        if self.pattern not in get_args(Pattern):
            known = ", ".join(get_args(Pattern))
            raise InputError(f"There is no pattern '{self.pattern}'; try one of {known}")
        for name, count in (("columns", self.columns), ("rows", self.rows)):
            if not 2 <= count <= MOST_POINTS:
                raise InputError(f"A board with {count} {name} cannot be used; try 2 to {MOST_POINTS}")
        if not 0.0 < self.spacing_m < 10.0:
            raise InputError(f"A spacing of {self.spacing_m:g} m cannot be used; try 0.035")

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows, as OpenCV uses them."""
        return self.columns, self.rows

    @property
    def points_m(self) -> FloatArray:
        """(rows * columns, 3) points row by row from the upper left; the board's centre is the origin."""
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        x, y = column.astype(float), row.astype(float)
        if self.pattern == "circles-asymmetric":
            x = 2.0 * x + row % 2
        flat = np.column_stack([x, y, np.zeros(len(x))]) * self.spacing_m
        return flat - 0.5 * (flat.min(axis=0) + flat.max(axis=0))

    @property
    def nearest_m(self) -> float:
        """Distance from a point to its nearest neighbour."""
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
        return self.pattern == "chessboard" and (self.columns - self.rows) % 2 == 0

    @property
    def title(self) -> str:
        """Description of the board in one line."""
        kinds = {
            "circles": f"{self.columns} x {self.rows} circles, pitch",
            "circles-asymmetric": f"{self.columns} x {self.rows} circles in shifted rows, half pitch",
            "chessboard": f"chessboard of {self.columns} x {self.rows} inner corners, squares of",
            "charuco": f"ChArUco board of {self.columns} x {self.rows} inner corners, squares of",
        }
        return f"{kinds[self.pattern]} {1000.0 * self.spacing_m:g} mm"

    def charuco(self) -> Any:
        """Return OpenCV's board with the same squares and markers."""
        squares = (self.columns + 1, self.rows + 1)
        dictionary = cv2.aruco.getPredefinedDictionary(MARKERS)
        return cv2.aruco.CharucoBoard(squares, self.spacing_m, MARKER_SHARE * self.spacing_m, dictionary)
