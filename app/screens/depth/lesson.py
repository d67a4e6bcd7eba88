"""The lesson of the Depth screen: the settings of its stops, the numbers of its texts, and its file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import get_args

from app.compute.records import DepthNode, SceneView
from app.lesson.files import LESSONS, NUMBER, SCENE, Kind, Numbers, Setting, choice, quantity, sets, short
from app.screens.depth.labels import COLORINGS, DRAWN, HOLES, PICTURES, PointColoring
from app.screens.depth.view import Disc, HideRequest, PictureName
from app.window.tables import number
from pipeline.config import AlignmentMode, DepthConfig

SHIPPED = LESSONS / "can-a-picture-measure.md"
_DEFAULT = DepthConfig()
_MODES: dict[str, AlignmentMode] = {mode: mode for mode in get_args(AlignmentMode)}


@dataclass(frozen=True, slots=True)
class DepthLook:
    """State of the screen at a stop; the default is the screen's first state."""

    left: PictureName = "photo"
    right: PictureName = "sensor"
    split_share: float = 0.5
    alignment: AlignmentMode = _DEFAULT.alignment
    coloring: PointColoring = "source"
    drawn: str = HOLES
    """One of ``app.screens.depth.labels.DRAWN``."""
    reach: float = _DEFAULT.reach
    least_confidence: float = _DEFAULT.least_confidence
    hide: HideRequest | None = None
    """The part of the shown node's depth to hide and fill."""


def _hide(look: DepthLook, text: str) -> DepthLook:
    if text == "nothing":
        return replace(look, hide=None)
    found = re.fullmatch(rf"{NUMBER} ?% wide at {NUMBER} ?% {NUMBER} ?%", text)
    if found is None or any(float(value) > 100.0 for value in found.groups()):
        raise ValueError("try 'nothing' or for example '20 % wide at 50 % 40 %', from the left and the top")
    size, x, y = (float(value) / 100.0 for value in found.groups())
    return replace(look, hide=HideRequest(0, (Disc(x, y, size),)))


SETTINGS: dict[str, Setting[DepthLook]] = {
    "left": sets("left", choice({label: name for name, label in PICTURES.items()})),
    "right": sets("right", choice({label: name for name, label in PICTURES.items()})),
    "split": sets("split_share", quantity("%", 100.0, 100.0)),
    "alignment": sets("alignment", choice(_MODES)),
    "colours": sets("coloring", choice({short(name): coloring for name, coloring in COLORINGS.items()})),
    "inferred points": sets("drawn", choice({name: name for name in DRAWN})),
    "reach": sets("reach", quantity("%", 100.0, 100.0, above_zero=True)),
    "least confidence": sets("least_confidence", quantity("%", 100.0, 100.0)),
    "hide": _hide,
}
"""The settings of a stop, by their names in the file."""


NUMBERS = ("no_depth", "median", "rms", "inliers", "let_in", "flying", "out_of_reach")
"""Fields of the texts."""


def numbers(scene: SceneView, index: int, node: DepthNode) -> Numbers:
    """Return the fields' values for the node with this index in the scene."""
    judged = node.judged
    shares = {
        "no_depth": 1.0 - scene.nodes[index].coverage,
        "inliers": node.inlier_share,
        "let_in": judged.kept_share,
        "flying": judged.flying_share,
        "out_of_reach": judged.out_of_reach_share,
    }
    values = {name: number(share, 1, "%", 100.0) for name, share in shares.items()}
    errors = {"median": node.residuals.median_m, "rms": node.residuals.rms_m}
    values |= {name: number(error_m, 1, "cm", 100.0) for name, error_m in errors.items()}
    return {SCENE: f"{scene.title}, {node.name}", **values}


def statement(values: Mapping[str, str]) -> str:
    """Return what the pictures and the points show, for screen readers."""
    return (
        f"{values[SCENE]}: {values['no_depth']} of the picture has no measured depth. The inferred depth is "
        f"{values['rms']} off where the sensor measured (RMS); it fills {values['let_in']} of the pixels "
        "without depth."
    )


KIND = Kind("depth", SETTINGS, DepthLook(), NUMBERS, statement)
