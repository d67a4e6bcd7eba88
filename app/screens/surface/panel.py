"""The Surface screen's panel: the ball radius, the surfaces and their quality."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

from app.compute.records import SceneView
from app.compute.state import Spec, Step
from app.lesson.files import Numbers
from app.lesson.on_screen import ScreenLessons
from app.looking.folder import LookFolder
from app.screens.surface import labels
from app.screens.surface.advice import AdviceFolder
from app.screens.surface.baselines import Baselines
from app.screens.surface.export import measure_offers, surface_offers
from app.screens.surface.frames import FramesSlider
from app.screens.surface.holes import HolesFolder
from app.screens.surface.lesson import KIND, SHIPPED, SurfaceLook, numbers, surface_of
from app.screens.surface.measures import SurfaceMeasures
from app.screens.surface.numbers import quality_table, quick_line
from app.screens.surface.quick import QuickLook
from app.screens.surface.rolling import Walks
from app.screens.surface.settings import ADVANCED, STEP_MM, on_slider_mm, picked, slider_range_mm, with_rule
from app.screens.surface.stage import PARTS, ChosenBall, SurfaceStage
from app.screens.surface.sweep_plot import spacing_figure
from app.screens.surface.view import (
    BaselineName,
    ExplainView,
    FilledView,
    PaintedView,
    PaintRequest,
    SurfaceView,
    Which,
)
from app.web.markup import Markup
from app.window.controls import Controls
from app.window.in_address import STOP
from app.window.panel import Offers, Panel
from pipeline.types import FloatArray


class SurfacePanel(Panel):
    """The surface before and after fusion, drawn live while the radius is dragged."""

    title = "Surface"
    step: ClassVar[Step | None] = "surface"
    drawn_below = "/surface"

    def build(self) -> None:
        """Add radius, rule, drawing choices, histogram and quality."""
        gui, session, hints = self.gui, self.session, labels.HINTS
        self._view: SurfaceView | None = None
        self._quick_line = Markup("")
        self._by_click = self._quickly_drawn = False
        self._key = session.spec.key("surface")
        gui.add_markdown(labels.TEXT)
        shipped = {STOP: SHIPPED}
        self._lessons = ScreenLessons(self.ui, KIND, shipped, self._take_look, self._lesson_numbers)
        self._radius = gui.add_slider("Radius (mm)", 1.0, 120.0, STEP_MM, 20.0, hint=hints["Radius"])
        self.ui.when_changed(self._radius, self._dragged)
        self._frames = FramesSlider(session)
        rule = labels.RULE_NAMES[session.spec.config.surface.radius_rule]
        self._rule = gui.add_dropdown("Radii", list(labels.RULES), initial_value=rule, hint=hints["Radii"])
        self.ui.when_changed(self._rule, self._picked_rule)
        self._shown = gui.add_dropdown("Show", list(labels.SHOWN), hint=hints["Show"])
        self._coloring = gui.add_dropdown("Colours", list(labels.COLORINGS), hint=hints["Colours"])
        self._legend = gui.add_html(labels.legend_html("photo", False))
        self._loops = gui.add_checkbox("Hole rims", True, hint="Edges with one triangle only, in red.")
        self._unused = gui.add_checkbox("Points left out", True, hint="Points that the ball never rested on.")
        self.ui.when_changed(self._coloring, self._picked_coloring)
        self.ui.when_changed(self._shown, self._picked_shown)
        for shown in (self._loops, self._unused):
            self.ui.when_changed(shown, self._arrange)
        self._stage = SurfaceStage(self.scene)
        self._measures = SurfaceMeasures(session)
        self._looking = LookFolder(session, self.drawn_below, PARTS)
        self._quick = gui.add_html(Markup(""))
        self._table = gui.add_html(Markup(""))
        self._histogram = gui.add_plotly(spacing_figure(None), aspect=0.62, config={"displayModeBar": False})
        self._build_folders()
        self.in_address |= self._lessons.in_address
        self.in_address |= {"ball": self._walks.folder, "look": self._looking}
        self.always_in_address["measure"] = self._measures
        self.in_address |= picked(self._shown, self._picked_shown, self._coloring, self._picked_coloring)
        self._ball = ChosenBall(session, self._stage)
        self._baselines = Baselines(session, self._stage, self._quick, self._made)
        self.ui.when_clicked(self.drawn_below, self._clicked)

    def _build_folders(self) -> None:
        gui, session = self.gui, self.session
        self._advice = AdviceFolder(self.ui, self._sweep, session.cancel_side_job, self._take_radius)
        self._holes = HolesFolder(session, self._explain, self._fill)
        self._walks = Walks(session, self._arrange)
        self._rolling = self._walks.folder
        with gui.add_folder("Advanced", expand_by_default=False):
            self._controls = Controls(self.ui, ADVANCED, session.spec.config, session.edit)
            self._look_quickly = QuickLook(session, self._painted, self._drawn, self._rested)

    def on_show(self) -> None:
        """Show the walk's dock again."""
        self._rolling.visit(True)

    def on_hide(self) -> None:
        """Hide the walk's dock."""
        self._rolling.visit(False)

    @property
    def wide(self) -> bool:
        """Whether both surfaces are shown."""
        return self._shown.value == labels.BOTH

    @property
    def ahead(self) -> bool:
        """Whether a quick look is drawn, or about to be."""
        return self._quickly_drawn or self._look_quickly.moving

    def on_spec(self, spec: Spec) -> None:
        """Show the current settings; remove results of other settings."""
        if spec.key("surface") == self._key:
            return
        self._key = spec.key("surface")
        self._looking.on_spec()
        self._controls.write(spec.config)
        self._frames.write(spec.config)
        self._rule.value = labels.RULE_NAMES[spec.config.surface.radius_rule]
        self._advice.keep_for(spec.config.surface)
        self._baselines.forget()
        if self._shown.value in labels.BASELINES:
            self._shown.value = labels.AFTER
        self._walks.close()
        self._measures.follow()
        self._arrange()

    def on_view(self, step: Step, view: Any) -> None:
        """Draw both surfaces; a new cloud drops the suggested radii and the holes."""
        if step == "fuse":
            self._advice.forget()
            self._holes.forget()
        if step == "scene":
            self._ball.forget()
            self._looking.redraw()
            self._frames.show(view.averaged)
        if step == "surface":
            self.on_partial(view)
            self._measures.follow()

    def on_partial(self, view: SurfaceView) -> None:
        """Draw the partial result; while the radius is dragged, only store it."""
        self._view = view
        if not self._look_quickly.moving:
            self._take(view)

    def _dragged(self) -> None:
        """Show this ball's surface at once, and compute everything when the slider rests."""
        if self._shown.value in labels.BASELINES:
            self._shown.value = labels.AFTER
            self._arrange()
        which, coloring = self._stage.which, labels.COLORINGS[self._coloring.value]
        request = PaintRequest(which, coloring, self._radius.value / 1000.0)
        self._look_quickly.want(request)
        self.session.show_staleness()

    def _drawn(self) -> None:
        """Remove older meshes and show the quick look's numbers, which would have slowed its drawing."""
        with self.ui.atomic():
            self._stage.drop_old()
            if self._look_quickly.moving:
                self._quick.content = self._quick_line

    def _rested(self) -> None:
        session = self.session
        session.edit(with_rule("manual", self._radius.value))
        if self._view is not None and session.results.fresh("surface", session.spec):
            self._take(self._view)
            session.show_staleness()

    def _take_radius(self, radius_m: float) -> None:
        self.session.edit(with_rule("manual", 1000.0 * radius_m))
        self._radius.value = on_slider_mm(radius_m)

    def _picked_rule(self) -> None:
        self.session.edit(with_rule(labels.RULES[self._rule.value], self._radius.value))

    # Drawing.

    def _take(self, view: SurfaceView) -> None:
        """Show the surfaces and numbers of a result of the chain."""
        with self.ui.atomic():
            self._quickly_drawn = False
            self._ball.hide()
            self._stage.draw_unused(view.unused)
            if labels.COLORINGS[self._coloring.value] == "photo":
                self._look_quickly.sent(self._stage.draw({"after": view.after, "before": view.before}))
            if self.session.spec.config.surface.radius_rule != "manual":
                self._radius.min, self._radius.max = slider_range_mm(view.spacing, view.radii_m)
                self._radius.value = on_slider_mm(view.radii_m[-1])
            self._show_numbers()
            self._quick.content = Markup("")
            self._arrange()
        if view.before is not None:
            suggested_m = [row.radius_m for row in view.suggestions]
            self._histogram.figure = spacing_figure(view.spacing, view.radii_m, suggested_m)
            self._repaint()
        if view.holes:
            with self.ui.atomic():
                self._advice.suggest(view.suggestions)
                self._holes.parts(view.parts)
                self._load_holes()
            self._show_look()
            self._lessons.refresh()
            if labels.BASELINES.get(self._shown.value) not in (None, *self._baselines.views):
                self._picked_shown()  # the address requested a baseline before there was a surface
            self._walks.folder.resume()

    def _show_numbers(self) -> None:
        if self._view is not None:
            self._table.content = quality_table(self._view, self._baselines.views.values(), self._has_truth())
            self._lessons.refresh()

    def _repaint(self) -> None:
        """Request the surfaces of the settings in the chosen colours."""
        coloring = labels.COLORINGS[self._coloring.value]
        if coloring != "photo" and self.session.results.view("fuse") is not None:
            session = self.session
            request = PaintRequest(("after", "before"), coloring)
            session.quick_job(request.job, request, on_end=self._painted, key=request.key(session.spec))

    def _painted(self, view: PaintedView | None) -> None:
        """Draw a painted surface, unless the colours or the slider's motion have changed meanwhile."""
        if view is None or view.request.coloring != labels.COLORINGS[self._coloring.value]:
            return
        quick = view.request.radius_m is not None
        if quick != self._look_quickly.moving:
            return
        with self.ui.atomic():
            self._look_quickly.sent(self._stage.draw(view.meshes, quick))
            if quick:
                self._stage.draw_unused(view.unused)
                self._ball.show(view.request)
                self._quickly_drawn = True
        self._quick_line = quick_line(view) if quick else Markup("")
        self.ui.flush()

    def _picked_shown(self) -> None:
        """Show another surface; a baseline is computed first."""
        name = labels.BASELINES.get(self._shown.value)
        self._quick.content = Markup("")
        if name is None or self._view is None:
            self._load_holes()
        else:
            self._baselines.show(name)
        self._arrange()

    def _made(self, name: BaselineName, made: bool) -> None:
        """Handle a baseline that was computed or failed."""
        if not made:
            self._shown.value, self._quick.content = labels.AFTER, Markup("")
        else:
            self._show_numbers()
            if labels.BASELINES.get(self._shown.value) == name:
                self._baselines.show(name)
        self._arrange()

    def _picked_coloring(self) -> None:
        self._holes.unfill()
        self._legend.content = labels.legend_html(labels.COLORINGS[self._coloring.value], self._has_truth())
        if self._view is not None:
            self._take(self._view)

    def _has_truth(self) -> bool:
        scene: SceneView | None = self.session.results.view("scene")
        return scene is not None and scene.has_truth

    def _arrange(self) -> None:
        scene: SceneView | None = self.session.results.view("scene")
        with self.ui.atomic():
            self._stage.shown = self._shown.value
            place = None if scene is None else scene.stage
            loops, unused = bool(self._loops.value), bool(self._unused.value)
            self._stage.arrange(place, loops, unused, self._rolling.showing)
            baseline = self._shown.value in labels.BASELINES
            self._coloring.disabled = baseline  # its vertices are not points of the cloud
            self._legend.content = labels.legend_html(
                labels.COLORINGS[self._coloring.value], self._has_truth(), baseline
            )
        shown = labels.SHOWN[self._shown.value]
        if shown != self.session.spec.shown:
            self.session.want(replace(self.session.spec, shown=shown))
        self.session.frame_view()

    def offers(self) -> tuple[Offers, ...]:
        """Return the offers of the surfaces as they are drawn."""
        surface = surface_offers(self._shown.value, self._coloring.value, bool(self._loops.value))
        return (surface, *measure_offers(self.session.spec.tape))

    # The folders.

    def _sweep(self) -> None:
        if self.session.results.view("fuse") is not None:
            load = self._advice.load
            self.session.side_job("surface.sweep_job:sweep_job", on_partial=load, on_end=load)

    def _load_holes(self) -> None:
        if self._view is not None and self._view.holes:
            shown = None if self.wide or self._shown.value in labels.BASELINES else self._stage.which[0]
            self._holes.load(self._view.holes, shown)

    def _clicked(self, origin_m: FloatArray, direction: FloatArray) -> None:
        """Measure at the click, or explain the hole that was clicked."""
        cut = self._looking.cut
        measures = self._measures.clicked(origin_m, direction, cut)
        if measures or self._rolling.showing or self._shown.value in labels.BASELINES:
            return
        self._ball.clicked(origin_m, direction, cut)
        for which in self._stage.which:
            if self._holes.picked(origin_m, direction, which, self._stage.offset_m(which), cut):
                self._by_click = True
                return

    def _explain(self, which: Which, index: int) -> None:
        session = self.session
        if session.results.fresh("surface", session.spec):
            session.quick_job("surface.holes_job:explain_job", which, index, on_end=self._explained)
        else:
            self._explained(None)  # the listed holes belong to a surface that is computed again

    def _explained(self, answer: ExplainView | None) -> None:
        self._holes.explain(answer)
        if answer is not None and self._by_click:
            found = answer.found
            self.session.notify(found.reason.capitalize(), f"{found.sentence} {found.remedy}", "blue")
        self._by_click = False

    def _fill(self, longest_m: float | None) -> None:
        if longest_m is None:
            self._filled(None)
        else:
            self.session.side_job("surface.holes_job:fill_job", 100.0 * longest_m, on_end=self._filled)

    def _filled(self, view: FilledView | None) -> None:
        with self.ui.atomic():
            self._holes.filled(view)
            if view is not None and self._holes.filling:
                self._look_quickly.sent(self._stage.draw({"after": view.mesh}))
            elif self._view is not None:
                self._take(self._view)

    def look(self) -> bool:
        """Turn the view to a close-up's patch. Returns False if there is none; the session then turns it."""
        return self._walks.look()

    def _take_look(self, look: SurfaceLook) -> None:
        """Set the controls for a stop of the lesson; parts that need the surface wait for it."""
        session = self.session
        with self.ui.atomic():
            self._shown.value = look.shown
            self._coloring.value = labels.COLORING_NAMES[look.coloring]
            self._loops.value = look.rims
            self._walks.close()
            self._picked_coloring()
        self._lessons.waiting = look
        session.edit(lambda config: replace(config, surface=surface_of(look, config.surface)))
        if self._view is not None and session.results.fresh("surface", session.spec):
            self._take(self._view)

    def _lesson_numbers(self) -> Numbers:
        """Return the numbers of the current surfaces; empty while they are computed."""
        session, view = self.session, self._view
        scene: SceneView | None = session.results.view("scene")
        if scene is None or view is None:
            return {}
        fresh = session.results.fresh("surface", session.spec) and view.holes
        return numbers(scene.title, view, self._baselines.views) if fresh else {}

    def _show_look(self) -> None:
        """Apply the stop's settings that needed the surface, which has just been computed."""
        look, session = self._lessons.waiting, self.session
        if look is None or self._view is None or not session.results.fresh("surface", session.spec):
            return
        if look.radius_in_r_F is not None:
            self._lessons.waiting = replace(look, radius_in_r_F=None)
            self._take_radius(look.radius_in_r_F * self._view.spacing.r_F_m)
            if session.results.fresh("surface", session.spec):
                self._show_look()
            return
        self._lessons.waiting = None
        if look.shown in labels.BASELINES:
            self._shown.value = look.shown
        self._picked_shown()
        if look.holes:
            self._holes.choose_largest()
        if look.watch != "off":
            self._rolling.watch(look.watch == "close up")
