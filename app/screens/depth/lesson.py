"""The lesson of the Depth screen: what a stop can set, and the file that ships."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

from app.lesson import LESSONS, NUMBER, Lesson, Setting, choice, read_lesson, sets
from app.screens.depth.labels import COLORINGS, DRAWN, HOLES, PHOTO, PICTURES, SENSOR, PointColoring
from app.screens.depth.view import Disc, HideRequest
from pipeline.config import AlignmentMode, DepthConfig

SHIPPED = LESSONS / "can-a-picture-measure.md"
_DEFAULT = DepthConfig()
_MODES: dict[str, AlignmentMode] = {mode: mode for mode in get_args(AlignmentMode)}


@dataclass(frozen=True, slots=True)
class DepthLook:
    """What a stop shows; by default what the screen shows at first."""

    left: str = PHOTO
    """This and ``right``: one of ``app.screens.depth.labels.PICTURES``."""
    right: str = SENSOR
    split_share: float = 0.5
    alignment: AlignmentMode = _DEFAULT.alignment
    coloring: PointColoring = "source"
    drawn: str = HOLES
    """One of ``app.screens.depth.labels.DRAWN``."""
    reach: float = _DEFAULT.reach
    least_confidence: float = _DEFAULT.least_confidence
    hide: HideRequest | None = None
    """What is hidden and filled, of the node that is shown."""


def depth_lesson(path: Path = SHIPPED) -> Lesson[DepthLook]:
    """A lesson about depth.

    Raises:
        InputError: the file is no lesson or sets what this screen does not have.
    """
    return read_lesson(path, SETTINGS, DepthLook())


def _share(text: str) -> float:
    """Reads such as ``40 %``."""
    found = re.fullmatch(rf"{NUMBER} ?%", text)
    if found is None or float(found[1]) > 100.0:
        raise ValueError("try a share from 0 % to 100 %")
    return float(found[1]) / 100.0


def _reach(look: DepthLook, text: str) -> DepthLook:
    reach = _share(text)
    if reach == 0.0:
        raise ValueError("try a share above 0 % and up to 100 %")
    return replace(look, reach=reach)


def _hide(look: DepthLook, text: str) -> DepthLook:
    if text == "nothing":
        return replace(look, hide=None)
    found = re.fullmatch(rf"{NUMBER} ?% wide at {NUMBER} ?% {NUMBER} ?%", text)
    if found is None or any(float(value) > 100.0 for value in found.groups()):
        raise ValueError("try 'nothing' or such as '20 % wide at 50 % 40 %', from the left and the top")
    size, x, y = (float(value) / 100.0 for value in found.groups())
    return replace(look, hide=HideRequest(0, (Disc(x, y, size),)))


def _short(name: str) -> str:
    """What stands on the screen, up to its explanation."""
    return name.partition(":")[0]


SETTINGS: dict[str, Setting[DepthLook]] = {
    "left": sets("left", choice({name: name for name in PICTURES})),
    "right": sets("right", choice({name: name for name in PICTURES})),
    "split": sets("split_share", _share),
    "alignment": sets("alignment", choice(_MODES)),
    "colours": sets("coloring", choice({_short(name): coloring for name, coloring in COLORINGS.items()})),
    "inferred points": sets("drawn", choice({name: name for name in DRAWN})),
    "reach": _reach,
    "least confidence": sets("least_confidence", _share),
    "hide": _hide,
}
"""What a stop can set, by its name in the file."""
