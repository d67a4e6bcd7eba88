"""The settings of the ball: fields with a control of their own, and what the radius slider sets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from app.controls import Number
from pipeline.config import PipelineConfig, RadiusRule

ADVANCED = (
    Number(
        "Points",
        "surface.max_points",
        2_000,
        60_000,
        1_000,
        hint="The clouds are voxel-averaged to about this many points before the ball rolls.",
    ),
    Number(
        "Smoothing passes",
        "surface.smoothing_passes",
        0,
        5,
        1,
        hint="How often every point is moved along its normal onto the plane of its neighbours. "
        "0 leaves the sensor's noise in, as the thesis does, and the ball gets caught in it.",
    ),
)


def with_rule(rule: RadiusRule, radius_mm: float) -> Callable[[PipelineConfig], PipelineConfig]:
    """The edit that chooses a radius rule; the manual one rolls a single ball."""
    radii_m = (round(float(radius_mm), 3) / 1000.0,) if rule == "manual" else ()
    return lambda config: replace(config, surface=replace(config.surface, radius_rule=rule, radii_m=radii_m))
