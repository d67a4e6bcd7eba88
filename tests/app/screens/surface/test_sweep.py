"""The radius advice in the app: jobs, figures, sentence and folder."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from app.compute.state import Spec
from app.screens.surface.advice import NO_ADVICE, STOPPED, WAITING, AdviceFolder
from app.screens.surface.sweep_job import suggestions_of, sweep_job
from app.screens.surface.sweep_plot import (
    ADVISED,
    OF_THESIS,
    POINTS,
    USED,
    spacing_figure,
    sweep_figure,
    sweep_sentence,
)
from app.screens.surface.view import SpacingView, SweepView
from packetmesh.progress import Progress, drain
from pipeline.config import PipelineConfig, SurfaceConfig
from pipeline.sources import Demo
from pipeline.surface.findings import Suggestion, SweepPoint
from tests.app.fakes import ui_of

SPEC = Spec(Demo("box-on-table"), config=PipelineConfig(surface=SurfaceConfig(max_points=4_000)))
NAN = float("nan")
RAYS = "% of rays without a surface"
ROWS = (
    Suggestion("finest", 0.0246, 0.49, "Wide enough for 50% of the surface; rolled, it closes 49%."),
    Suggestion("even", 0.0312, 0.88, "Wide enough for 90% of the surface; rolled, it closes 88%."),
)


def run(job):
    """All that a job says, and what it answers."""
    steps = []
    return steps, drain(job, steps.append)


def row(radius_mm, no_hit, accuracy=NAN, triangles=100):
    return SweepPoint(radius_mm / 1000, triangles, 0.1, 0.2, no_hit, accuracy, accuracy, 0.01)


def swept(*rows):
    return SweepView(rows, 0.010, 0.005, len(rows))


@pytest.fixture(scope="module")
def sweep(store):
    return run(sweep_job(store, SPEC))


def test_the_sweep_grows_ball_by_ball_and_ends_complete(sweep):
    steps, view = sweep
    partial = [one for one in steps if isinstance(one, SweepView)]
    assert [len(one.points) for one in partial] == list(range(1, view.planned + 1))
    assert [one.done for one in partial] == [False] * (view.planned - 1) + [True]
    assert all(one.points == view.points[: len(one.points)] for one in partial)
    assert partial[-1] == view
    rolling = [one.fraction for one in steps if isinstance(one, Progress) and one.stage.startswith("a ball")]
    assert rolling == sorted(rolling)
    assert len(rolling) == view.planned


def test_the_sweep_reaches_from_half_the_spacing_to_six_and_holds_the_advice(store, sweep):
    view = sweep[1]
    radii_m = [one.radius_m for one in view.points]
    assert radii_m == sorted(radii_m)
    assert (radii_m[0], radii_m[-1]) == pytest.approx((view.r_F_m / 2, 6 * view.r_F_m))
    _, advice = run(suggestions_of(store, SPEC))
    assert {one.radius_m for one in advice} <= set(radii_m)
    assert len(radii_m) == 12 + len(advice)


def test_larger_balls_leave_fewer_rays_until_they_no_longer_fit(sweep):
    points = sweep[1].points
    missed = [one.no_hit_ray_share for one in points]
    best = int(np.argmin(missed))
    assert max(np.diff(missed[: best + 1])) < 0.01  # a few triangles of a plateau come and go
    assert missed[0] > 0.9
    assert missed[best] < 0.5
    for one in points:
        assert 0.0 <= one.unused_share <= 1.0
        assert math.isnan(one.accuracy_1cm) == (one.triangles == 0)


def test_the_advice_is_for_the_cloud_after_fusion_and_is_kept(store):
    _, advice = run(suggestions_of(store, SPEC))
    _, clouds = run(store.stage(SPEC, "clouds"))
    assert [one.name for one in advice] == ["finest", "even", "widest"]
    assert [one.radius_m for one in advice] == sorted(one.radius_m for one in advice)
    assert all(clouds.r_F_m / 2 < one.radius_m < 20 * clouds.r_F_m for one in advice)
    assert all(0.0 < one.share <= 1.0 for one in advice)
    again, same = run(suggestions_of(store, SPEC))
    assert same == advice
    assert again == []


def test_the_radii_of_the_spec_do_not_matter_to_a_sweep(store, sweep):
    surface = replace(SPEC.config.surface, radius_rule="manual", radii_m=(0.5,))
    steps, view = run(sweep_job(store, replace(SPEC, config=replace(SPEC.config, surface=surface))))
    assert steps == []
    np.testing.assert_equal(view, sweep[1])


def test_the_sentence_finds_where_the_rays_level_off_and_what_accuracy_does():
    view = swept(row(5, 1.0, NAN, 0), row(10, 0.60, 0.97), row(28, 0.205, 0.93), row(60, 0.20, 0.88))
    assert sweep_sentence(view) == (
        "From 28 mm on, larger balls close less than 1% more of the rays (20.5% are without a surface); "
        "accuracy within 1 cm falls from 93 to 88 % up to 60 mm."
    )
    assert "rises from 80 to 88 %" in sweep_sentence(swept(row(28, 0.2, 0.80), row(60, 0.2, 0.88)))
    assert "stays at 88 %" in sweep_sentence(swept(row(28, 0.2, 0.881), row(60, 0.2, 0.884)))


def test_the_sentence_says_when_the_widest_balls_miss_more_again():
    sentence = sweep_sentence(swept(row(10, 0.60), row(28, 0.20), row(60, 0.30)))
    assert sentence == (
        "From 28 mm on, larger balls close less than 1% more of the rays (20.0% are without a surface); "
        "with the widest ball, 60 mm, 30.0% are without a surface again."
    )


def test_the_sentence_without_any_triangle():
    assert sweep_sentence(swept(row(5, 1.0, NAN, 0))) == "No ball of the sweep leaves a triangle."


def test_the_sweep_figure_shows_all_four_curves_in_the_units_it_names(sweep):
    view = sweep[1]
    traces = {trace.hovertemplate: trace for trace in sweep_figure(view).data}
    found = {
        unit: next(trace for hover, trace in traces.items() if unit in hover)
        for unit in (RAYS, "% of the surface within 1 cm", "triangles", "ms for the ball")
    }
    for trace in found.values():
        np.testing.assert_allclose(trace.x, [1000 * one.radius_m for one in view.points])
    values = {unit: np.array(trace.y, float) for unit, trace in found.items()}
    np.testing.assert_allclose(values[RAYS], [100 * one.no_hit_ray_share for one in view.points])
    np.testing.assert_allclose(
        values["% of the surface within 1 cm"], [100 * one.accuracy_1cm for one in view.points]
    )
    np.testing.assert_allclose(values["triangles"], [one.triangles for one in view.points])
    np.testing.assert_allclose(values["ms for the ball"], [1000 * one.elapsed_s for one in view.points])


def test_without_truth_there_is_no_accuracy_curve():
    figure = sweep_figure(swept(row(10, 0.6), row(28, 0.2)))
    assert len(figure.data) == 3


def test_the_sweep_figure_marks_the_spacing_inside_its_axis():
    figure = sweep_figure(swept(row(5, 1.0, NAN, 0)))
    assert [shape.x0 for shape in figure.layout.shapes] == pytest.approx([10.0, 15.0])
    places = [note.x for note in figure.layout.annotations]
    assert places == pytest.approx(np.log10([10.0, 15.0]).tolist())
    low, high = figure.layout.xaxis.range
    assert low < math.log10(5.0) < max(places) < math.log10(60.0) < high
    assert [note.xanchor for note in figure.layout.annotations] == ["right", "left"]
    assert len(sweep_figure(None).data) == 0


def test_the_histogram_tells_the_radii_of_the_thesis_the_advice_and_those_in_use_apart():
    view = SpacingView(0.010, 0.004, np.linspace(0.0, 0.03, 31), np.arange(30))
    figure = spacing_figure(view, (0.013,), (0.012, 0.02, 0.03))
    marks = {trace.name: trace for trace in figure.data if trace.type == "scatter"}
    assert set(marks) == {USED, ADVISED, OF_THESIS}
    np.testing.assert_allclose(marks[OF_THESIS].x, [10.0, 11.0, 12.0, 14.0])
    np.testing.assert_allclose(marks[USED].x, [13.0])
    np.testing.assert_allclose(marks[ADVISED].x, [12.0, 20.0, 30.0])
    assert len({trace.y[0] for trace in marks.values()}) == 3
    assert len({trace.marker.symbol for trace in marks.values()}) == 3
    assert len({trace.marker.color for trace in marks.values()}) == 3
    assert [shape.x0 for shape in figure.layout.shapes] == pytest.approx([10.0, 14.0])
    assert [note.xanchor for note in figure.layout.annotations] == ["right", "left"]
    assert figure.layout.yaxis.domain[1] < figure.layout.yaxis2.domain[0]
    assert len(spacing_figure(None).data) == 0


class Advice:
    """The folder, and what it called."""

    def __init__(self):
        ui, self.calls = ui_of(), []
        sweep, stop = (partial(self.calls.append, word) for word in ("sweep", "stop"))
        self.gui, self.folder = ui.gui, AdviceFolder(ui, sweep, stop, self.calls.append)

    @property
    def curves(self):
        """What is drawn of the sweep; None while nothing is."""
        plots = self.gui.all("plotly")
        return plots[0].figure.data if plots else None


@pytest.fixture
def advice():
    return Advice()


def test_a_suggestion_is_taken_with_its_button(advice):
    take = advice.gui.find("Take")
    assert not take.seen
    advice.folder.suggest(ROWS)
    assert take.seen
    assert take.options == ("finest", "even")
    for one in (ROWS[1], ROWS[0], ROWS[0]):
        advice.gui.press("Take", one.name)
    assert advice.calls == [0.0312, 0.0246, 0.0246]
    for part in ("finest", "24.6 mm", "49 %", "even", "31.2 mm", "88 %", ROWS[0].sentence):
        assert part in advice.gui.text()
    advice.folder.forget()
    advice.gui.press("Take", "even")
    assert len(advice.calls) == 3
    assert not take.seen


def test_without_a_suggestion_the_folder_says_why(advice):
    advice.folder.suggest(())
    assert not advice.gui.find("Take").seen
    assert NO_ADVICE in advice.gui.text()


def test_the_sweep_is_asked_for_followed_and_stopped(advice):
    view, gui = swept(row(10, 0.6), row(28, 0.2, 0.93), row(60, 0.2, 0.88)), advice.gui
    gui.press("All radii", "Sweep the radius")
    assert WAITING in gui.text()
    advice.folder.load(replace(view, points=view.points[:2]))
    assert "2 of 3 balls have rolled." in gui.text()
    assert len(advice.curves[0].x) == 2
    advice.folder.load(view)
    assert sweep_sentence(view) in gui.text()
    assert len(advice.curves[0].x) == 3
    gui.press("All radii", "Sweep the radius")
    assert advice.curves is None
    advice.folder.load(replace(view, points=view.points[:1]))
    gui.press("All radii", "Stop the sweep")
    advice.folder.load(None)
    assert STOPPED in gui.text()
    assert advice.curves is not None
    assert advice.calls == ["sweep", "sweep", "stop"]


def test_the_lower_plot_can_be_chosen(advice):
    advice.folder.load(swept(row(10, 0.6), row(28, 0.2)))
    np.testing.assert_allclose(advice.curves[1].y, [100, 100])
    advice.gui.set("Lower plot", POINTS)
    np.testing.assert_allclose(advice.curves[1].y, [10, 10])
    np.testing.assert_allclose(advice.curves[2].y, [0.2, 0.2])
    advice.folder.forget()
    assert advice.curves is None
    assert not advice.gui.find("Lower plot").seen
    advice.folder.load(None)
    assert "No curves: the computation was stopped or failed." in advice.gui.text()
