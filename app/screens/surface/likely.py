"""Jobs computed in advance for a demo scene: every step of the radius slider, and the other presets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from app.compute import jobs
from app.compute.ahead import LikelyJob
from app.compute.state import CHAIN, Spec
from app.compute.store import Store
from app.screens.surface.settings import STEP_MM, on_slider_mm, slider_range_mm, with_rule
from app.screens.surface.view import PaintRequest, SurfaceView
from pipeline.config import PRESETS
from pipeline.sources import Demo


def likely(store: Store, spec: Spec, view: SurfaceView) -> Iterator[LikelyJob]:
    """Yield the quick looks of the slider's radii, their complete surfaces, and the other presets' chains."""
    radii_mm = likely_radii_mm(view)
    for radius_mm in radii_mm:
        request = PaintRequest(("after",), "photo", radius_mm / 1000.0)
        key = request.key(spec)
        yield LikelyJob(key, jobs.run_kept, (request.job, key, store, spec, request))
    for radius_mm in radii_mm:
        rolled = replace(spec, config=with_rule("manual", radius_mm)(spec.config))
        yield LikelyJob(rolled.key("surface"), jobs.run_step, ("surface", store, rolled))
    for name in PRESETS:
        preset = spec.with_preset(name)
        for step in CHAIN:
            yield LikelyJob(preset.key(step), jobs.run_step, (step, store, preset))


def likely_radii_mm(view: SurfaceView) -> list[float]:
    """Return the slider's radii up to the largest ball of the settings; by ratio to r_F, nearest first."""
    least_mm, _ = slider_range_mm(view.spacing, view.radii_m)
    steps = range(round(least_mm / STEP_MM), round(on_slider_mm(view.radii_m[-1]) / STEP_MM) + 1)
    r_F_mm = 1000.0 * view.spacing.r_F_m
    return sorted((STEP_MM * step for step in steps), key=lambda mm: abs(math.log(mm / r_F_mm)))


def is_likely(spec: Spec) -> bool:
    """Return whether many users request this spec's surfaces: a demo scene with the settings of a preset."""
    return isinstance(spec.source, Demo) and spec.config in PRESETS.values()
