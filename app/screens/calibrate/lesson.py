"""The lesson of the Calibrate screen: the settings of its stops, the numbers of its texts, its file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np

from app.lesson.files import LESSONS, SCENE, Kind, Numbers, Setting, choice, quantity, sets
from app.screens.calibrate.labels import AROUND, PAIRS, STRAIGHTENED, Around
from app.screens.calibrate.numbers import unseen_rms_px, views_used, within
from app.screens.calibrate.view import CameraView
from app.window.tables import UNKNOWN, number
from pipeline.config import Lens

SHIPPED = LESSONS / "how-good-is-my-calibration.md"
Keep = Literal["all", "three alike"]
"""The views used for a calibration."""
LEAST_DEG = 8.0
"""Least value of the largest angle between two of the three boards' normals: parallel boards determine no
lens."""
_ON_OFF = {"on": True, "off": False}
_KEEP: dict[str, Keep] = {"all": "all", "three alike": "three alike"}
_LENSES: dict[str, Lens] = {"thesis": "thesis", "brown": "brown", "rational": "rational"}


@dataclass(frozen=True, slots=True)
class CalibrateLook:
    """State of the screen at a stop; the default is the screen's first state."""

    pair: str = STRAIGHTENED
    """One of ``app.screens.calibrate.labels.PAIRS``."""
    split_share: float = 0.5
    around: Around = "camera"
    keep: Keep = "all"
    lens: Lens = "thesis"
    range_m: float | None = None
    """Range at which the camera is judged; None takes the scene's own."""
    noise_px: float | None = None
    """Noise of the replayed experiment; None replays nothing."""
    other_lens: bool = False
    """Whether the experiment's views are seen through another lens."""
    used: bool = False
    """Whether the chain uses the calibration."""


def _noise(look: CalibrateLook, text: str) -> CalibrateLook:
    amount, _, lens = text.partition(" through ")
    if lens not in ("", "another lens"):
        raise ValueError("try for example '0.1 px' or '0.1 px through another lens'")
    return replace(look, noise_px=quantity("px", 1.0)(amount), other_lens=bool(lens))


SETTINGS: dict[str, Setting[CalibrateLook]] = {
    "compare": sets("pair", choice({name: name for name in PAIRS})),
    "split": sets("split_share", quantity("%", 100.0, 100.0)),
    "in space": sets("around", choice(AROUND)),
    "views": sets("keep", choice(_KEEP)),
    "lens": sets("lens", choice(_LENSES)),
    "range": sets("range_m", quantity("m", 6.0, above_zero=True)),
    "noise": _noise,
    "calibration in use": sets("used", choice(_ON_OFF)),
}
"""The settings of a stop, by their names in the file."""


def left_out(camera: CameraView, keep: Keep) -> Iterator[tuple[str, str]]:
    """Yield the camera and the moment of each view to leave out.

    "three alike" keeps the three views whose boards' normals differ least but still determine a lens.
    """
    lens = camera.calibration
    if keep == "all" or lens is None:
        return
    normals = {view.name: view.T_camera_board[:3, 2] for view in lens.views}
    spread = {names: _spread_deg([normals[name] for name in names]) for names in combinations(normals, 3)}
    enough = {names: deg for names, deg in spread.items() if deg >= LEAST_DEG}
    if enough:
        kept = min(enough, key=lambda names: enough[names])
        yield from ((camera.name, name) for name in normals if name not in kept)


def _spread_deg(normals: list[np.ndarray]) -> float:
    """Return the largest angle between two of the (3,) unit normals, degrees."""
    cosines = np.clip(np.array(normals) @ np.array(normals).T, -1.0, 1.0)
    return float(np.degrees(np.arccos(cosines.min())))


NUMBERS = ("circles", "measurements", "views", "rms", "held_out", "fx")
"""Fields of the texts."""


def numbers(scene: str, circles: int, camera: CameraView) -> Numbers:
    """Return the fields' values for a camera in a scene, and a board with this number of circles."""
    found = camera.calibration
    return {
        SCENE: f"{scene}, {camera.name}",
        "circles": str(circles),
        "measurements": str(2 * circles),
        "views": views_used(camera),
        "rms": UNKNOWN if found is None else number(found.rms_px, 3, "px"),
        "held_out": number(unseen_rms_px(camera), 3, "px"),
        "fx": within(found, "fx"),
    }


def statement(values: Mapping[str, str]) -> str:
    """Return how well the photographs fit, for screen readers."""
    return (
        f"{values[SCENE]}: from {values['views']} views, with an RMS error of {values['rms']} and of "
        f"{values['held_out']} for views left out. The focal length is {values['fx']}."
    )


KIND = Kind("calibrate", SETTINGS, CalibrateLook(), NUMBERS, statement)
