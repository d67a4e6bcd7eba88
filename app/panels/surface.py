"""Surface: a ball rolls over the points; its radius decides what becomes a surface and what a hole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from app.controls import Controls, Number
from app.drawing.cameras import stage_of
from app.drawing.surfaces import SurfaceDrawing
from app.jobs.records import MeshView, SceneView, SurfaceView
from app.panel import Panel
from app.plots.spacing import spacing_figure
from app.state import Spec, Step
from app.tables import Row, number, table
from pipeline.config import PipelineConfig, RadiusRule
from pipeline.types import FloatArray

TEXT = """**What you see.** A ball rolls over the points and leaves a triangle wherever it rests on three.
Too small, and it falls through between the points; too large, and it skips detail. Red lines are the rims
of holes. Drag the radius, and compare before and after fusion. Go on with **Export**."""
AFTER, BEFORE, BOTH = "after fusion", "before fusion (sensor only)", "side by side"
RULES: dict[str, RadiusRule] = {
    "r_F + {0, 1, 2, 4} σ_D": "thesis+",
    "thesis: r_F + {0, ¼, ½, 1} σ_D": "thesis",
    "one radius (slider)": "manual",
}
NAMES = {rule: name for name, rule in RULES.items()}
LEAST_MM, MOST_MM = 1.0, 120.0
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


class SurfacePanel(Panel):
    """The surface before and after fusion, live while the radius is dragged."""

    title = "Surface"
    step: ClassVar[Step | None] = "surface"
    drawn_below = "/surface"

    def build(self) -> None:
        """Radius, rule, what to draw; histogram and quality."""
        gui, session = self.gui, self.session
        gui.add_markdown(TEXT)
        self._radius = gui.add_slider(
            "Radius (mm)", LEAST_MM, MOST_MM, 0.5, 20.0, hint="Radius of the ball; drag to roll it anew."
        )
        self.when_changed(self._radius, self._dragged)
        rule = session.spec.config.surface.radius_rule
        self._rule = gui.add_dropdown(
            "Radii",
            list(RULES),
            initial_value=NAMES[rule],
            hint="r_F and σ_D: mean and standard deviation of the distance to the nearest neighbour in the "
            "fused cloud. Several balls roll one after the other, the small ones first.",
        )
        self.when_changed(self._rule, self._picked_rule)
        self._shown = gui.add_dropdown("Show", [AFTER, BEFORE, BOTH], hint="Which surface is drawn.")
        self._loops = gui.add_checkbox("Hole rims", True, hint="Edges with one triangle only, in red.")
        for handle in (self._shown, self._loops):
            self.when_changed(handle, self._arrange)
        self._table = gui.add_html("")
        self._histogram = gui.add_plotly(spacing_figure(None), aspect=0.45, config={"displayModeBar": False})
        with gui.add_folder("Advanced", expand_by_default=False):
            self._controls = Controls(
                gui, ADVANCED, session.spec.config, lambda change: session.post(session.edit, change)
            )
        self._after = SurfaceDrawing(self.scene, "/surface/after", AFTER)
        self._before = SurfaceDrawing(self.scene, "/surface/before", BEFORE)
        self._drawn: tuple[MeshView | None, MeshView | None] = (None, None)

    @property
    def wide(self) -> bool:
        """Whether both surfaces are shown."""
        return self._shown.value == BOTH

    def on_spec(self, spec: Spec) -> None:
        """Show the settings that are wanted."""
        self._controls.write(spec.config)
        self._rule.value = NAMES[spec.config.surface.radius_rule]

    def on_view(self, step: Step, view: Any) -> None:
        """Draw both surfaces."""
        if step == "surface":
            self._draw(view)

    def on_partial(self, view: SurfaceView) -> None:
        """Draw the surface after fusion while the other is still being made."""
        self._draw(view)

    def _draw(self, view: SurfaceView) -> None:
        self._last = view
        with self.session.target.atomic():
            if self._drawn[0] is None or self._drawn[0].glb != view.after.glb:
                self._after.draw(view.after)
            old = self._drawn[1]
            if view.before is not None and (old is None or old.glb != view.before.glb):
                self._before.draw(view.before)
            self._drawn = (view.after, view.before or self._drawn[1])
            if view.before is not None or self._shown.value == AFTER:
                self._arrange()
            if self.session.spec.config.surface.radius_rule != "manual":
                self._fit_slider(view)
                self._radius.value = round(2000.0 * view.radii_m[-1]) / 2.0
            scene: SceneView | None = self.session.results.view("scene")
            self._table.content = _quality_table(view, scene is not None and scene.has_truth)
        if view.before is not None:
            self._histogram.figure = spacing_figure(view.spacing, view.radii_m)

    def _fit_slider(self, view: SurfaceView) -> None:
        """Let the slider reach from half the spacing of the points to twice the largest sensible ball."""
        self._radius.min = max(0.5, float(np.floor(500.0 * view.spacing.r_F_m)))
        widest_m = max(view.radii_m[-1], view.spacing.r_F_m + 4.0 * view.spacing.sigma_D_m)
        self._radius.max = float(np.ceil(1500.0 * widest_m))

    def _dragged(self) -> None:
        self.session.edit(_with_rule("manual", self._radius.value))

    def _picked_rule(self) -> None:
        self.session.edit(_with_rule(RULES[self._rule.value], self._radius.value))

    def _arrange(self) -> None:
        both = self._shown.value == BOTH
        scene: SceneView | None = self.session.results.view("scene")
        offset_m: FloatArray = np.zeros(3)
        top_m: FloatArray | None = None
        if both and scene is not None:
            stage = stage_of(scene.nodes)
            offset_m, top_m = 0.55 * stage.width_m * stage.right, stage.top_m
        loops = bool(self._loops.value)
        with self.session.target.atomic():
            self._after.show(self._shown.value in (AFTER, BOTH), loops, offset_m, top_m)
            self._before.show(self._shown.value in (BEFORE, BOTH), loops, -offset_m, top_m)
        self.session.frame_view()


def _with_rule(rule: RadiusRule, radius_mm: float) -> Callable[[PipelineConfig], PipelineConfig]:
    radii_m = (round(float(radius_mm), 3) / 1000.0,) if rule == "manual" else ()
    return lambda config: replace(config, surface=replace(config.surface, radius_rule=rule, radii_m=radii_m))


def _quality_table(view: SurfaceView, has_truth: bool) -> str:
    both = (view.before, view.after)

    def row(name: str, hint: str, value: Callable[[MeshView], str]) -> Row:
        return Row(name, hint, tuple("…" if mesh is None else value(mesh) for mesh in both))

    rows = [
        row(
            "No-hit rays",
            "Share of the cameras' pixel rays that miss the surface: what one sees as holes.",
            lambda m: number(m.quality.no_hit_ray_share, 1, "%", 100),
        ),
        row(
            "Hole area",
            "Area of the holes whose rim is shorter than 1 m, filled flat.",
            lambda m: number(m.quality.hole_area_m2, 3, "m²"),
        ),
        row(
            "Rims",
            "Boundary loops: chains of edges with one triangle. More of them can mean fewer holes.",
            lambda m: f"{m.quality.boundary_loops:,}",
        ),
        row(
            "Rim length", "Length of all these edges.", lambda m: number(m.quality.boundary_length_m, 1, "m")
        ),
        row("Area", "Area of all triangles.", lambda m: number(m.quality.area_m2, 2, "m²")),
        row("Triangles", "Triangles of the surface.", lambda m: f"{m.triangles:,}"),
        row("Pieces", "Connected components.", lambda m: f"{m.quality.components:,}"),
        row(
            "Unused points", "Points that the ball never rested on.", lambda m: f"{m.quality.unused_points:,}"
        ),
        row(
            "Bad edges", "Edges with more than two triangles.", lambda m: f"{m.quality.non_manifold_edges:,}"
        ),
    ]
    if has_truth:
        rows[1:1] = [row(name, hint, _truth_number(key, unit)) for name, hint, key, unit in TRUTH_ROWS]
    head = ", ".join(f"{1000 * radius_m:.1f}" for radius_m in view.radii_m)
    caption = f"<div style='padding: 0 0.8em; font-size: 13px'>Ball radii: {head} mm</div>"
    return caption + table(rows, ("before", "after fusion")) + _price(view)


def _price(view: SurfaceView) -> str:
    """Says so if the filled surface is nearer to complete but farther from the truth; empty otherwise."""
    if view.before is None or view.before.truth is None or view.after.truth is None:
        return ""
    before, after = (mesh.truth["f_score_5cm"] for mesh in (view.before, view.after) if mesh.truth)
    if after >= before:
        return ""
    return (
        "<div style='padding: 0.4em 0.8em; font-size: 13px'>Fewer holes have a price here: what fills them "
        f"is guessed, and the F-score falls from {before:.1%} to {after:.1%}.</div>"
    )


def _truth_number(key: str, unit: str) -> Callable[[MeshView], str]:
    return lambda mesh: "…" if mesh.truth is None else number(mesh.truth.get(key), 1, unit, 100.0)


TRUTH_ROWS = (
    (
        "F-score 5 cm",
        "Harmonic mean of coverage and accuracy within 5 cm of the true surface.",
        "f_score_5cm",
        "%",
    ),
    (
        "Depth error",
        "Median depth error of the rays that hit, against the truth.",
        "median_depth_error_m",
        "cm",
    ),
)
