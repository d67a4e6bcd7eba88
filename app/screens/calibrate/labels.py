"""Texts of the Calibrate screen, and labels of its choices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.web.markup import Markdown

TEXT = Markdown(
    """**What you see.** Photographs of a board of known size give each camera's lens and the place of the
board in each view: click a bar or a board. What counts is not the error on these views, but how well the
lens predicts **other views**. Go on with **Depth**."""
)
NOTHING = Markdown(
    """Photographs of a board of known size give each camera's lens. This scene comes
**without photographs of a board**: the app uses the calibration that came with it. Open a scene whose cameras
need calibration, or use your own photographs."""
)

NO_RIG = Markdown(
    "No poses of several cameras are known: only the camera that is chosen above is drawn, around the board."
)

PictureName = Literal[
    "photo", "straightened", "uncertainty", "halves", "coverage", "next", "off-before", "off-after"
]
Around = Literal["camera", "board", "rig"]
"""The object that is fixed in the drawing."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two pictures divided by a line."""

    left: PictureName
    right: PictureName


PAIRS: dict[str, Pair] = {
    "photograph | straightened": Pair("photo", "straightened"),
    "photograph | uncertainty": Pair("photo", "uncertainty"),
    "uncertainty | difference of two halves": Pair("uncertainty", "halves"),
    "photograph | coverage": Pair("photo", "coverage"),
    "photograph | next view to take": Pair("photo", "next"),
    "depth error measured | corrected": Pair("off-before", "off-after"),
}
STRAIGHTENED, UNCERTAINTY, HALVES, COVERAGE, NEXT, DEPTH = PAIRS
AROUND: dict[str, Around] = {
    "boards around the camera": "camera",
    "cameras around the board": "board",
    "cameras of the rig": "rig",
}


RMS = (
    "Root mean square distance between each detected point and its reprojection through the lens, over "
    "all points of the fit. A low value shows that the lens explains these views, not that it is right."
)
HELD_OUT = (
    "The same error for views that the lens was not fitted to: each view is left out in turn, the lens "
    "is fitted to the others, and only the pose is fitted to the view left out."
)
VIEWS = (
    "Number of photographs that the calibration uses, of all photographs. The board must have been "
    "found in them."
)
STANDARD_ERROR = (
    "Standard deviation of the number if the same views were taken again with the same noise. It does "
    "not reveal a wrong lens model."
)
INTERVAL = (
    "1.96 standard errors to either side: it contains the true value in 95 of 100 cases, if the lens "
    "model is right."
)
TRUTH = "True value, with which the photographs were rendered."
TWO_HALVES = (
    "The camera is estimated twice, from the odd and from the even views. If noise is the only error, "
    "the two results agree within their standard errors."
)
CORRELATION = (
    "Correlation of the errors of two parameters, from −1 to 1. Near 0 the views separate the two; near "
    "1 both can be too large unnoticed, near −1 one too large and the other too small."
)
BENT = (
    "Difference between the board's highest and deepest point, estimated with the camera. It is used "
    "only if it predicts held-out views better than a flat board."
)
