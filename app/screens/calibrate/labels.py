"""What the Calibrate screen says of itself, and what its choices are called."""

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
"""What stays in its place in space."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two pictures with a line between them."""

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
