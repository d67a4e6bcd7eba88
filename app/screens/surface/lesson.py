"""The lesson of the surface: the settings of its stops, the numbers of its texts, and its file."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

from app.compute.records import MeshView
from app.lesson.files import LESSONS, NUMBER, SCENE, Kind, Numbers, Setting, choice, sets, short
from app.screens.surface.labels import AFTER, COLORINGS, RULES, SHOWN
from app.screens.surface.view import BaselineName, BaselineView, Coloring, SurfaceView
from app.window.tables import UNKNOWN, number
from pipeline.config import RadiusRule, SurfaceConfig

SHIPPED = LESSONS / "which-ball-radius.md"
Watch: TypeAlias = Literal["off", "close up", "whole"]
"""The rolling ball: hidden, a few triangles slowly, or the whole surface."""
_DEFAULT = SurfaceConfig()
_ON_OFF = {"on": True, "off": False}
_RULES: dict[str, RadiusRule] = {rule: rule for rule in RULES.values() if rule != "manual"}
_MOST_R_F = 20.0


@dataclass(frozen=True, slots=True)
class SurfaceLook:
    """The surface that a stop shows, and its settings; the default is the screen's first state."""

    shown: str = AFTER
    """One of ``app.screens.surface.labels.SHOWN``."""
    rule: RadiusRule = _DEFAULT.radius_rule
    radius_in_r_F: float | None = None
    """Ball radius over r_F of the fused cloud, so that it suits every scene; None if a rule sets it."""
    coloring: Coloring = "photo"
    rims: bool = True
    """Whether the rims of the holes are drawn."""
    smoothing_passes: int = _DEFAULT.smoothing_passes
    max_points: int = _DEFAULT.max_points
    watch: Watch = "off"
    holes: bool = False
    """Whether the largest hole is chosen and explained."""


def surface_of(look: SurfaceLook, config: SurfaceConfig) -> SurfaceConfig:
    """Return a stop's settings; a ball in units of r_F is set later, when the cloud's spacing is known."""
    config = replace(config, max_points=look.max_points, smoothing_passes=look.smoothing_passes)
    return config if look.rule == "manual" else replace(config, radius_rule=look.rule, radii_m=())


def _radii(look: SurfaceLook, text: str) -> SurfaceLook:
    if text in _RULES:
        return replace(look, rule=_RULES[text], radius_in_r_F=None)
    found = re.fullmatch(rf"{NUMBER} ?r_F", text)
    if found is None or not 0.0 < float(found[1]) <= _MOST_R_F:
        raise ValueError(
            f"try one of {', '.join(_RULES)} or for example '1.5 r_F', above 0 and at most {_MOST_R_F:g} r_F"
        )
    return replace(look, rule="manual", radius_in_r_F=float(found[1]))


def _count(least: int, most: int) -> Callable[[str], int]:
    """Return a reader of whole numbers such as 8000 or 8,000."""

    def read(text: str) -> int:
        digits = text.replace(",", "")
        if not digits.isdecimal() or not least <= int(digits) <= most:
            raise ValueError(f"try a whole number from {least:,} to {most:,}")
        return int(digits)

    return read


SETTINGS: dict[str, Setting[SurfaceLook]] = {
    "show": sets("shown", choice({short(name): name for name in SHOWN})),
    "radii": _radii,
    "colours": sets("coloring", choice({short(name): coloring for name, coloring in COLORINGS.items()})),
    "rims": sets("rims", choice(_ON_OFF)),
    "smoothing": sets("smoothing_passes", _count(0, 5)),
    "points": sets("max_points", _count(2_000, 60_000)),
    "watch": sets("watch", choice({name: name for name in get_args(Watch)})),
    "hole": sets("holes", choice({"largest": True, "none": False})),
}
"""The settings of a stop, by their names in the file."""


SURFACES = ("", "_before", "_poisson")
"""Suffixes of the fields of the surface after fusion, of that before it, and of Poisson's surface."""
MEASURES = ("missed", "unused", "f_score", "guessed")
NUMBERS = (
    *(f"{measure}{which}" for which in SURFACES for measure in MEASURES),
    *("r_f", "sigma_d", "ball", "ball_width", "cut_off", "thesis_ball", "largest_ball", "hole_area"),
    "better",
)
"""Fields of the texts and choices."""


def numbers(scene: str, view: SurfaceView, baselines: Mapping[BaselineName, BaselineView]) -> Numbers:
    """Return the fields' values for the surfaces in a scene."""
    poisson = baselines.get("poisson")
    meshes = {"": view.after, "_before": view.before, "_poisson": None if poisson is None else poisson.mesh}
    values: dict[str, str] = {SCENE: scene}
    for which, mesh in meshes.items():
        values |= {f"{name}{which}": value for name, value in _measures(mesh).items()}
    r_F_m, sigma_D_m, ball_m = view.spacing.r_F_m, view.spacing.sigma_D_m, view.radii_m[-1]
    lengths = {"r_f": r_F_m, "sigma_d": sigma_D_m, "ball": ball_m, "ball_width": 2.0 * ball_m}
    lengths |= {"cut_off": ball_m / 2.0**0.5, "thesis_ball": r_F_m + sigma_D_m}
    lengths |= {"largest_ball": r_F_m + 4.0 * sigma_D_m}
    values |= {name: number(length_m, 0, "mm", 1000.0) for name, length_m in lengths.items()}
    values["better"] = UNKNOWN if poisson is None else _better(view.after, poisson.mesh)
    return {**values, "hole_area": number(view.after.quality.hole_area_m2, 3, "m²")}


def statement(values: Mapping[str, str]) -> str:
    """Return what fusion does to the surface, for screen readers."""
    if UNKNOWN in (values["missed_before"], values["missed"]):
        return ""
    scores = f" The F-score is {values['f_score_before']} before and {values['f_score']} after."
    return (
        f"{values[SCENE]}: before fusion {values['missed_before']} of the rays are without a surface, after "
        f"it {values['missed']}." + ("" if values["f_score"] == UNKNOWN else scores)
    )


WORDS = {"better": ("ball", "poisson", "untold")}
KIND = Kind("surface", SETTINGS, SurfaceLook(), NUMBERS, statement, WORDS)


def _better(ball: MeshView, poisson: MeshView) -> str:
    """Return the word for the surface with the higher F-score; ``untold`` without ground truth."""
    if not ball.truth or not poisson.truth:
        return "untold"
    return "poisson" if poisson.truth["f_score_5cm"] > ball.truth["f_score_5cm"] else "ball"


def _measures(mesh: MeshView | None) -> dict[str, str]:
    if mesh is None:
        return dict.fromkeys(MEASURES, UNKNOWN)
    quality, score = mesh.quality, None if mesh.truth is None else mesh.truth.get("f_score_5cm")
    unused = quality.unused_points / max(1, quality.unused_points + mesh.vertices)
    shares = (quality.no_hit_ray_share, unused, score, quality.guessed_ray_share)
    return {name: number(share, 1, "%", 100.0) for name, share in zip(MEASURES, shares, strict=True)}
