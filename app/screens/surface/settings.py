"""Controls of the ball's settings, and the effect of the radius slider."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import viser

from app.screens.surface.labels import COLORINGS, PLACES
from app.screens.surface.view import SpacingView
from app.window.controls import Number
from app.window.in_address import InAddress, Picked
from pipeline.config import PipelineConfig, RadiusRule

STEP_MM = 0.5
"""Step of the radius slider, about a percent of a room's largest ball. A typed radius may have tenths."""
ADVANCED = (
    Number(
        "Points",
        "surface.max_points",
        2_000,
        60_000,
        1_000,
        hint="Number of points, approximately, to which the clouds are averaged over voxels before the "
        "ball rolls. It is lower where such voxels would be smaller than twice the sensors' noise.",
    ),
    Number(
        "Smoothing passes",
        "surface.smoothing_passes",
        0,
        5,
        1,
        hint="How often every point is moved along its normal onto the plane of its neighbours. 0 keeps "
        "the sensor's noise, as the thesis does, and leaves more holes.",
    ),
)


def with_rule(rule: RadiusRule, radius_mm: float) -> Callable[[PipelineConfig], PipelineConfig]:
    """Return the edit that chooses a radius rule; the manual rule rolls one ball of ``radius_mm``."""
    radii_m = (round(float(radius_mm), 3) / 1000.0,) if rule == "manual" else ()
    return lambda config: replace(config, surface=replace(config.surface, radius_rule=rule, radii_m=radii_m))


def on_slider_mm(radius_m: float) -> float:
    """Return the radius of the slider's step nearest to this one."""
    return STEP_MM * round(1000.0 * radius_m / STEP_MM)


def slider_range_mm(spacing: SpacingView, radii_m: Sequence[float]) -> tuple[float, float]:
    """Return the slider's range, mm: from half the mean spacing, at least 0.5, to clearly too large balls."""
    widest_m = 1.5 * (spacing.r_F_m + 4.0 * spacing.sigma_D_m)
    most_m = max(*radii_m, widest_m, 6.5 * spacing.r_F_m)
    return max(0.5, math.floor(500.0 * spacing.r_F_m)), math.ceil(1000.0 * most_m)


def picked(
    shown: viser.GuiDropdownHandle[str],
    on_shown: Callable[[], None],
    coloring: viser.GuiDropdownHandle[str],
    on_coloring: Callable[[], None],
) -> dict[str, InAddress]:
    """Return the screen's lists, each with its callback, by their keys in the address."""
    colors: dict[str, str] = {key: label for label, key in COLORINGS.items()}
    return {"surface": Picked(shown, PLACES, on_shown), "color": Picked(coloring, colors, on_coloring)}
