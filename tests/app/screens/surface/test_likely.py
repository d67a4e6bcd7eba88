"""What is computed ahead is what a hand on the slider asks for."""

from dataclasses import replace

import numpy as np
import pytest

from app.compute import jobs
from app.compute.state import CHAIN
from app.screens.surface.likely import is_likely, likely, likely_radii_mm
from app.screens.surface.panel import SurfacePanel
from app.screens.surface.settings import STEP_MM, on_slider_mm, with_rule
from app.screens.surface.view import SpacingView, SurfaceView
from packetmesh.settings import differences, with_settings
from pipeline.config import PRESETS, PipelineConfig
from pipeline.sources import RigFolder
from tests.app.fakes import START, Bench, Impatient, ui_of

SPACING = SpacingView(0.0174, 0.007, np.zeros(2), np.zeros(1, int))
VIEW = SurfaceView(SPACING, (0.0174, 0.0456), None, None, 0.0)


def test_the_radii_are_the_sliders_up_to_the_largest_ball_those_like_the_spacing_first():
    radii_mm = likely_radii_mm(VIEW)
    assert sorted(radii_mm) == [8.0 + STEP_MM * step for step in range(76)]
    assert max(radii_mm) == 45.5
    assert radii_mm[0] == 17.5
    assert set(radii_mm[1:3]) == {17.0, 18.0}


def test_a_radius_is_on_the_slider_to_half_a_step():
    assert on_slider_mm(0.0456) == 45.5
    assert on_slider_mm(0.04579) == 46.0
    assert on_slider_mm(0.001) == 1.0


@pytest.mark.parametrize("radius_mm", [*(STEP_MM * step for step in range(2, 241)), 17.3, 20.1])
def test_a_radius_comes_back_from_the_address_exactly(radius_mm):
    config = with_rule("manual", radius_mm)(PipelineConfig())
    assert config.surface.radii_m == pytest.approx((radius_mm / 1000.0,), rel=1e-12)
    assert with_settings(PipelineConfig(), differences(config, PipelineConfig())) == config


def test_what_a_dragged_slider_asks_for_is_likely(server, store):
    asked = []

    class Noting(Bench):
        def quick_job(self, job, *arguments, on_end, key=None):
            asked.append(key)
            super().quick_job(job, *arguments, on_end=on_end)

        def show_staleness(self):
            """Nothing is dimmed."""

    ui = ui_of(server.scene, kind=Impatient)
    bench = Noting(SurfacePanel, ui, store)
    bench.advance()
    view = bench.results.view("surface")
    jobs_by_key = {job.key: job for job in likely(store, bench.spec, view)}
    radius_mm = likely_radii_mm(view)[3]
    bench.gui.set("Radius (mm)", radius_mm)
    key = asked[0]
    assert jobs_by_key[key].function is jobs.run_kept
    assert jobs_by_key[key].arguments[1] == key
    assert bench.spec.config.surface.radii_m == (radius_mm / 1000.0,)
    job = jobs_by_key[bench.spec.key("surface")]
    assert job.function is jobs.run_step
    assert job.arguments[2].key("surface") == bench.spec.key("surface")


def test_the_other_presets_come_last(store):
    rest = list(likely(store, START, VIEW))[2 * len(likely_radii_mm(VIEW)) :]
    assert [job.key for job in rest] == [
        START.with_preset(name).key(step) for name in PRESETS for step in CHAIN
    ]


def test_only_a_demo_scene_with_a_presets_settings_is_what_many_ask_for():
    assert is_likely(START)
    assert is_likely(START.with_preset("thesis"))
    assert not is_likely(replace(START, source=RigFolder("mine")))
    assert not is_likely(replace(START, config=with_rule("manual", 20.0)(START.config)))
