"""Texts of the Calibrate screen, and labels of its choices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.web.markup import Markdown

TEXT = Markdown(
    """**What you see.** Photographs of a board of known size tell how each camera bends what it sees, and
where the board stood: click a bar or a board. What counts is not how well the lens explains these views, but
how sure it is of **others**. Go on with **Depth**."""
)
NOTHING = Markdown(
    """This scene comes **without photographs of a board**: its cameras are taken at their word. Open a
scene whose cameras need calibration, or use your own photographs below."""
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
    "Root mean square distance between where a point was seen and where the lens puts it (reprojection), "
    "over all points that the lens was made from. A low one says that the lens explains these views, not "
    "that it is right."
)
HELD_OUT = (
    "The same for views by a lens that has not seen them: each is left out in turn, and only its pose is "
    "fitted to it."
)
VIEWS = "Photographs in which the board was found and that are used, of all there are."
STANDARD_ERROR = (
    "How far a number would scatter if the same views were taken again, by the noise that is left in them: "
    "one standard deviation. A lens of the wrong kind does not show in it."
)
INTERVAL = (
    "1.96 standard errors to either side: it holds the truth 95 times in 100, if the lens is of this kind."
)
TRUTH = "What the photographs were rendered with."
TWO_HALVES = (
    "The camera is estimated from every other view and from the others. If noise were all that is wrong, "
    "both would agree as well as their standard errors say."
)
CORRELATION = (
    "How two numbers' errors go together, from −1 to 1. Near 0 the views tell one from the other; near 1 one "
    "can be too large unseen if the other is, near −1 if the other is too small."
)
BENT = (
    "From the deepest point of the board to the highest, found with the camera. It is used where views that "
    "had no part in it are predicted better than by a flat board."
)
