"""Tables of the surfaces' numbers, each with an explanation."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from app.compute.records import MeshView
from app.screens.surface.labels import BASELINE_HEADS
from app.screens.surface.view import BaselineView, PaintedView, SurfaceView
from app.web.markup import Markup
from app.window.tables import UNKNOWN, WAITING, Row, number, table, truth_rows


def quality_table(view: SurfaceView, baselines: Iterable[BaselineView], has_truth: bool) -> Markup:
    """Return a table in HTML of the surfaces before and after fusion and of the computed baselines."""
    columns: dict[str, MeshView | None] = {"before": view.before, "after fusion": view.after}
    columns |= {BASELINE_HEADS[baseline.name]: baseline.mesh for baseline in baselines}

    def row(name: str, hint: str, value: Callable[[MeshView], str]) -> Row:
        return (name, hint, *(WAITING if mesh is None else value(mesh) for mesh in columns.values()))

    rows = [
        row(
            "Rays without a surface",
            "Share of the cameras' pixel rays that meet no surface: the holes that the cameras see.",
            lambda m: number(m.quality.no_hit_ray_share, 1, "%", 100),
        ),
        row(
            "Area of holes",
            "Area of all holes that the cameras see, at the depth of the surface next to them; a hole that "
            "two cameras see counts twice.",
            lambda m: UNKNOWN if m.quality.gaps is None else number(m.quality.gaps.area_m2, 2, "m²"),
        ),
        row(
            "Holes from 100 cm²",
            "Holes as large as a hand or larger. Smaller ones count in the area only.",
            lambda m: UNKNOWN if m.quality.gaps is None else f"{m.quality.gaps.large:,}",
        ),
        row(
            "On inferred surface",
            "Share of the rays that meet inferred surface: most of its points were inferred, not measured.",
            lambda m: number(m.quality.guessed_ray_share, 1, "%", 100),
        ),
        row(
            "Measured within 2 %",
            "Share of the measured pixels whose ray meets the surface within 2 % of the measurement. "
            "Filling only the holes should not lower it, because it replaces no measurement.",
            lambda m: number(m.quality.within_2pct_share, 1, "%", 100),
        ),
        row(
            "Measured within 5 %",
            "The same within 5 % of the measurement.",
            lambda m: number(m.quality.within_5pct_share, 1, "%", 100),
        ),
        row("Area", "Area of all triangles.", lambda m: number(m.quality.area_m2, 2, "m²")),
        row("Triangles", "Triangles of the surface.", lambda m: f"{m.triangles:,}"),
        row(
            "Rim length",
            "Length of all edges with one triangle: around holes, at the outer rim of the scene, and where "
            "an object occludes its background.",
            lambda m: number(m.quality.boundary_length_m, 1, "m"),
        ),
        row("Pieces", "Connected components.", lambda m: f"{m.quality.components:,}"),
        row(
            "Unused points", "Points that the ball never rested on.", lambda m: f"{m.quality.unused_points:,}"
        ),
        row(
            "Bad edges", "Edges with more than two triangles.", lambda m: f"{m.quality.non_manifold_edges:,}"
        ),
    ]
    if has_truth:
        rows[1:1] = truth_rows(list(columns.values()))
    head = ", ".join(f"{1000 * radius_m:.1f}" for radius_m in view.radii_m)
    caption = Markup(
        "<div class='packetmesh-numbers' style='padding: 0 0.8em; font-size: 13px'>Ball radii: {} mm</div>"
    ).format(head)
    return caption + table(rows, tuple(columns)) + _rule(view) + _price(view)


WAIT = Markup("<div style='padding: 0 0.8em; font-size: 13px'>Computing the baseline …</div>")


def note_html(view: BaselineView) -> Markup:
    """Return HTML with a baseline's note and computing time."""
    text = f"{view.note} It took {view.elapsed_s:.1f} s."
    return Markup("<div style='padding: 0 0.8em; font-size: 13px'>{}</div>").format(text)


def quick_line(view: PaintedView) -> Markup:
    """Return the line about a quick look, which stands above the table of the previous surface."""
    mesh, radius_mm = next(iter(view.meshes.values())), 1000 * (view.request.radius_m or 0.0)
    part = (
        ""
        if view.points == view.all_points
        else (f" of {view.all_points:,}; all points when you release the slider")
    )
    return Markup(
        "<div style='padding: 0 0.8em; font-size: 13px'><b>{:.1f} mm</b>: "
        "{:,} triangles over {:,} points{}; rolled in "
        "{:.0f} ms</div>"
    ).format(radius_mm, mesh.triangles, view.points, part, 1000 * view.roll_s)


def _rule(view: SurfaceView) -> Markup:
    """Return the definition of a hole, and the number of small holes, which the table leaves out."""
    text = Markup(
        "A <b>hole</b> is a patch of a camera's picture whose rays are without a surface. The outer rim "
        "counts only where a camera looks past it."
    )
    before, after = (mesh and mesh.quality.gaps for mesh in (view.before, view.after))
    if before and after:
        text += Markup(
            " There are {:,} smaller holes before and {:,} after fusion, most of them of a few rays."
        ).format(before.count - before.large, after.count - after.large)
        if after.count > before.count and after.area_m2 < before.area_m2:
            text += Markup(
                " Fusion fills the middle of a hole and leaves a seam of tiny ones where inferred and "
                "measured surface do not quite meet."
            )
    return Markup("<div style='padding: 0.2em 0.8em; font-size: 13px'>{}</div>").format(text)


def _price(view: SurfaceView) -> Markup:
    """Return a sentence if the F-score, to 0.1 %, is lower after fusion than before; else empty."""
    if view.before is None or view.before.truth is None or view.after.truth is None:
        return Markup("")
    before, after = (round(mesh.truth["f_score_5cm"], 3) for mesh in (view.before, view.after) if mesh.truth)
    if after >= before:
        return Markup("")
    return Markup(
        "<div style='padding: 0.4em 0.8em; font-size: 13px'>Filling holes with inferred surface has a price "
        "here: the F-score falls from {:.1%} to {:.1%}.</div>"
    ).format(before, after)
