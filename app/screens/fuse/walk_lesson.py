"""The lesson of the walk: the settings of its stops, the numbers of its texts, and its file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from app.lesson.files import LESSONS, NUMBER, SCENE, Kind, Numbers, Setting, choice, sets
from app.screens.fuse.walk_numbers import loop_name
from app.screens.fuse.walk_view import WalkView
from app.window.tables import UNKNOWN, WAITING, number

SHIPPED = LESSONS / "how-a-walk-becomes-a-room.md"


@dataclass(frozen=True, slots=True)
class WalkLook:
    """The moment and the loop that a stop shows."""

    moment: float | None = 1.0
    """Share of the recording's frames that have been taken; None: the first lost one, or the end."""
    loop: Literal["none", "largest", "contradicting"] = "none"
    """The loop that moved the camera farthest, one that contradicts the others (if there is one), or none."""
    enlarged: bool = True
    """Whether the drift is enlarged."""


def _moment(text: str) -> float | None:
    if text == "lost":
        return None
    if text in ("start", "end"):
        return float(text == "end")
    found = re.fullmatch(rf"{NUMBER} ?%", text)
    if found is None or float(found[1]) > 100.0:
        raise ValueError("try start, end, lost or a share of the frames, such as 40 %")
    return float(found[1]) / 100.0


SETTINGS: dict[str, Setting[WalkLook]] = {
    "moment": sets("moment", _moment),
    "loop": sets("loop", choice({name: name for name in ("none", "largest", "contradicting")})),
    "drift": sets("enlarged", choice({"enlarged": True, "true size": False})),
}
"""The settings of a stop, by their names in the file."""
NUMBERS = (
    *("frames", "keyframes", "seconds", "lost", "times", "drift", "step"),
    *("loops", "found", "pair", "moved", "turned", "left", "overlap"),
    *("first", "half", "missed", "missed_before"),
)
"""Fields of the texts."""


def frame_of(look: WalkLook, view: WalkView) -> int:
    """Return the frame that a stop shows."""
    if look.moment is None:
        return view.lost[0][0] if view.lost else view.frames - 1
    return round(look.moment * (view.frames - 1))


def loop_of(look: WalkLook, view: WalkView) -> int:
    """Return the index of the loop that a stop shows; -1 for none."""
    largest = 0 if view.loops else -1
    contradicting = view.used_loops if view.used_loops < len(view.loops) else -1
    return {"none": -1, "largest": largest, "contradicting": contradicting}[look.loop]


def numbers(scene: str, view: WalkView, surface: Any, times: int) -> Numbers:
    """Return the values of the lesson's fields.

    Args:
        scene: title of the scene.
        view: the walk.
        surface: the surfaces of the same recording; None while they are computed.
        times: factor by which the drift is enlarged.
    """
    share = 100.0 * view.until / max(len(view.points_m), 1)
    known_m = view.drift_m[np.isfinite(view.drift_m)]
    step_m = np.abs(np.diff(known_m, prepend=known_m[0])).max()
    values = {
        "frames": f"{view.frames:,}",
        "keyframes": f"{len(view.keyframes):,}",
        "seconds": number(float(view.times_s[-1]), 1, "s"),
        "lost": f"{view.lost_frames:,}",
        "times": f"{times}",
        "drift": number(float(np.nanmax(view.drift_m)), 1, "cm", 100.0),
        "step": number(float(step_m), 1, "cm", 100.0),
        "loops": f"{view.used_loops:,}",
        "found": f"{len(view.loops):,}",
        "first": number(float(share[0]), 0, "%"),
        "half": number(float(share[view.frames // 2]), 0, "%"),
    }
    return {SCENE: scene, **values, **_loop_numbers(view), **_surface_numbers(surface)}


def _loop_numbers(view: WalkView) -> dict[str, str]:
    if not view.loops:
        return dict.fromkeys(("pair", "moved", "turned", "left", "overlap"), UNKNOWN)
    loop = view.loops[0]
    return {
        "pair": loop_name(loop),
        "moved": number(loop.moved_m, 1, "cm", 100.0),
        "turned": f"{np.degrees(loop.turned_rad):.2f}°",
        "left": number(loop.left_m, 1, "cm", 100.0),
        "overlap": number(loop.overlap_share, 0, "%", 100.0),
    }


def _surface_numbers(surface: Any) -> dict[str, str]:
    """Return the shares of rays without a surface after and before fusion."""
    if surface is None or surface.before is None:
        return dict.fromkeys(("missed", "missed_before"), WAITING)
    return {
        "missed": number(surface.after.quality.no_hit_ray_share, 1, "%", 100.0),
        "missed_before": number(surface.before.quality.no_hit_ray_share, 1, "%", 100.0),
    }


def statement(values: Mapping[str, str]) -> str:
    """Return how tracking went, for screen readers."""
    return (
        f"{values[SCENE]}: {values['frames']} frames in {values['seconds']}, {values['lost']} of them lost. "
        f"Tracking alone drifts by at most {values['drift']}; {values['loops']} loops correct it."
    )


KIND = Kind("walk", SETTINGS, WalkLook(), NUMBERS, statement)
