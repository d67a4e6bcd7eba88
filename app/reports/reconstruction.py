"""The report of one reconstruction: inputs, results of each stage, and quality."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from app.drawing.pictures import depth_picture, depth_range_m
from app.reports.html import picture, pictures, table, write_page
from app.reports.measures import measured_sections
from app.web.markup import Markup
from pipeline.folders.walk import lost_sentences
from pipeline.io.textures import Texture
from pipeline.reconstruct import Reconstruction
from pipeline.stages import cameras_of, dressed
from pipeline.surface.boundary import LONGEST_HOLE_M
from pipeline.surface.pictures import MeshPainter, beside

MOST_SHOWN = 6
"""Most nodes of which the report has pictures."""
QUALITY_ROWS = (
    ("no_hit_ray_share", "rays without a surface (%)", 100.0),
    ("gaps.area_m2", "area of the holes that the cameras see (m²)", 1.0),
    ("gaps.large", "holes from 100 cm²", None),
    ("guessed_ray_share", "rays on inferred surface (%)", 100.0),
    (
        "within_2pct_share",
        "measured pixels whose ray meets the surface within 2 % of the measurement (%)",
        100.0,
    ),
    ("within_5pct_share", "the same within 5 % of the measurement (%)", 100.0),
    ("area_m2", "area (m²)", 1.0),
    ("triangles", "triangles", None),
    ("vertices", "vertices", None),
)
"""Key of a quality measure, label, and factor to the label's unit; None for a count."""
RIM_ROWS = (
    ("boundary_loops", "rims, of any length", None),
    ("boundary_length_m", "length of the rims (m)", 1.0),
    ("hole_area_m2", f"area inside rims shorter than {LONGEST_HOLE_M:g} m, outer rims left out (m²)", 1.0),
    ("gaps.count", "holes of any size that the cameras see", None),
    ("components", "connected pieces", None),
    ("non_manifold_edges", "edges with more than two faces", None),
    ("unused_points", "points without a triangle", None),
)
"""Measures of the mesh's edges and pieces, as in ``QUALITY_ROWS``."""
HOLES = (
    "A hole is a patch of a camera's picture whose rays are without a surface. Its area is taken at the "
    "depth of the surface next to it; a hole that two cameras see counts twice."
)
RIMS = (
    "A rim is a line of edges with one triangle: around a hole of any size, at the end of the surface, and "
    "where one thing hides another. Fusion fills the middle of a hole and can leave a seam of tiny holes "
    "where inferred and measured surface do not quite meet, so there can be more rims after it, although the "
    "holes that the cameras see are smaller."
)


def write_reconstruction_report(
    result: Reconstruction,
    metrics: dict[str, Any],
    path: Path,
    texture: Texture,
    measures: dict[str, Any] | None = None,
) -> None:
    """Write the self-contained HTML report of a run to ``path``.

    Args:
        result: the reconstruction.
        metrics: its metrics.
        path: file of the report.
        texture: photographs on the surface after fusion.
        measures: record of what was measured on the surface (``app.measuring.results``); None for nothing.
    """
    sections = Markup("").join(_sections(result, metrics, texture, measures))
    write_page(path, f"PacketMesh: {metrics['scene']}", sections)


def _sections(
    result: Reconstruction, metrics: dict[str, Any], texture: Texture, measures: dict[str, Any] | None
) -> Iterator[Markup]:
    before, after = metrics["surface_before"], metrics["surface_after"]
    yield Markup("<h1>{}</h1>").format(metrics["scene"])
    yield Markup(
        '<p class="lead">Preset <code>{}</code>. Of all camera rays, <b>{:.1%}</b> are without a surface '
        "before fusion and <b>{:.1%}</b> after it.{}{}</p>"
    ).format(
        metrics["preset"],
        before["no_hit_ray_share"],
        after["no_hit_ray_share"],
        _use_sentences(metrics["measured"]),
        _agreeing(metrics["measured"], "keyframes" if "recording" in metrics else "cameras"),
    )
    yield from _recording(metrics)
    yield from _doubts(metrics)
    yield from _surfaces(result, texture, before, after)
    if measures is not None:
        yield from measured_sections(measures)
    yield from _truth(metrics)
    yield from _nodes(result, metrics)
    yield from _registrations(metrics)
    yield Markup("<h2>Time and settings</h2>")
    yield table(
        ("stage", "seconds"), ((stage, f"{time_s:.3f}") for stage, time_s in metrics["timings_s"].items())
    )
    yield Markup(
        '<p class="note">At most {:,.0f} MB of memory. All settings are in <code>config.json</code>, all '
        "numbers in <code>metrics.json</code>.</p>"
    ).format(metrics["peak_memory_bytes"] / 1e6)


def _use_sentences(measured: dict[str, float]) -> Markup:
    """Return two sentences on the use of the measurements."""
    return Markup(
        " Of the measured pixels, the outlier filter keeps <b>{kept_share:.2%}</b>; the surface agrees "
        "with the measurement within 2 % at <b>{within_2pct_before:.1%}</b> of them before and at "
        "<b>{within_2pct_after:.1%}</b> after fusion. After fusion <b>{measured_ray_share:.1%}</b> of "
        "all rays meet measured surface and <b>{guessed_ray_share:.1%}</b> inferred surface."
    ).format(**measured)


def _agreeing(measured: dict[str, float], nodes: str) -> Markup:
    """Return a sentence on the agreement of the nodes, cameras or keyframes; empty if none share a place."""
    share = measured["agreement_between_nodes"]
    if not math.isfinite(share):
        return Markup("")
    return Markup(
        " Where two {} measured the same surface, <b>{:.1%}</b> of the points agree within 2 %."
    ).format(nodes, share)


def _recording(metrics: dict[str, Any]) -> Iterator[Markup]:
    """Yield paragraphs on how a recording was tracked; none if the images are no recording."""
    if "recording" not in metrics:
        return
    recording = metrics["recording"]
    yield Markup(
        '<p class="lead">A recording of <b>{frames:,}</b> frames: the camera went {path_m:.1f} m; '
        "keyframes: {keyframes}, loops: {loops}; {map_points:,} points measured in voxels of "
        "{voxel_mm:.0f} mm. Tracking and mapping: {frames_per_s:.0f} frames a second.</p>"
    ).format(voxel_mm=1000.0 * recording["voxel_m"], **recording)
    for sentence in lost_sentences(recording, metrics["measured"]["agreement_between_nodes"]):
        yield Markup('<p class="lead"><b>{}.</b></p>').format(sentence)


def _doubts(metrics: dict[str, Any]) -> Iterator[Markup]:
    """Yield doubts about the images, and about nodes with no pose or an uncertain one."""
    for note in metrics.get("import", {"notes": ()})["notes"]:
        yield Markup('<p class="lead">{}.</p>').format(note)
    for node in metrics["nodes"]:
        for note in node["notes"]:
            yield Markup('<p class="lead"><b>{}: {}.</b></p>').format(node["name"], note)
        if node["place"]["sentence"]:
            yield Markup('<p class="lead"><b>{}.</b></p>').format(node["place"]["sentence"])


def _surfaces(
    result: Reconstruction, texture: Texture, before: dict[str, Any], after: dict[str, Any]
) -> Iterator[Markup]:
    yield Markup("<h2>The surface before and after fusion</h2>")
    radii = ", ".join(f"{1000 * radius:.1f}" for radius in before["radii_m"])
    yield Markup(
        '<p class="note">Ball radii {} mm for both. Magenta: a ray without a surface. '
        "First with the photographs' colours, from a place next to the first camera; then from {}.</p>"
    ).format(radii, _whose(len(result.placement.placed(result.rig.frames))))
    frames, placed = result.placement.placed(result.rig.frames), cameras_of(result.rig, result.placement)
    view = beside(placed[0], result.after)
    painters = {"before": MeshPainter(result.before), "after": MeshPainter(result.after)}
    textures = {"before": dressed(result.rig, result.placement, result.before), "after": texture}
    yield pictures(
        (
            picture(painters[when].picture(view, texture=worn), f"{when} fusion, in the nodes' photographs")
            for when, worn in textures.items()
        ),
        columns=2,
    )
    for frame, camera in zip(frames[:MOST_SHOWN], placed[:MOST_SHOWN], strict=True):
        figures = (
            picture(painter.picture(camera, colored), f"{frame.name}, {when} fusion{how}")
            for colored, how in ((True, ""), (False, ", shape only"))
            for when, painter in painters.items()
        )
        yield pictures(figures, columns=2)
    yield from quality_tables(before, after)


def quality_tables(before: dict[str, Any], after: dict[str, Any]) -> Iterator[Markup]:
    """Yield tables of both surfaces' measures (``surface_metrics``): those that the app shows, then rims."""
    yield _measures(QUALITY_ROWS, before, after)
    yield Markup(
        '<p class="note">{}</p><details><summary>More about the mesh: rims and pieces</summary>'
    ).format(HOLES)
    yield _measures(RIM_ROWS, before, after)
    yield Markup('<p class="note">{}</p></details>').format(RIMS)


def _measures(
    rows: Sequence[tuple[str, str, float | None]], before: dict[str, Any], after: dict[str, Any]
) -> Markup:
    """Return a table of measures of both surfaces. A key ``gaps.area_m2`` is that of an inner record."""

    def value(quality: dict[str, Any], key: str, scale: float | None) -> float | int:
        record, _, name = key.rpartition(".")
        number: float | int = (quality[record] if record else quality)[name]
        return number if scale is None else float(scale * number)

    return table(
        ("", "before", "after"),
        ((label, *(value(quality, key, scale) for quality in (before, after))) for key, label, scale in rows),
    )


def _whose(nodes: int) -> str:
    """Return the words for the cameras from which the report's pictures are seen."""
    return "each node's camera" if nodes <= MOST_SHOWN else f"the cameras of the first {MOST_SHOWN} nodes"


def _truth(metrics: dict[str, Any]) -> Iterator[Markup]:
    if metrics["truth"] is None:
        return
    before, after = metrics["truth"]["surface_before"], metrics["truth"]["surface_after"]
    yield Markup(
        "<h2>Against the ground truth</h2>"
        '<p class="note">Only surface that the cameras can see counts. Coverage: share of the true surface '
        "with a mesh point within the distance; accuracy: share of the mesh with true surface within it; "
        "F-score: their harmonic mean.</p>"
    )
    rows = ((_truth_label(key), *_in_units(key, before, after)) for key in before or after)
    yield table(("", "before", "after"), rows)


def _truth_label(key: str) -> str:
    known = {
        "no_hit_ray_share": "rays without a surface where the truth has one (%)",
        "within_5pct_depth_share": "rays that hit within 5 % of the true depth (%)",
        "median_depth_error_m": "median depth error of the rays that hit (mm)",
    }
    name, _, distance = key.rpartition("_")
    return known.get(key, f"{name.replace('f_score', 'F-score')} at {distance.replace('cm', ' cm')} (%)")


def _in_units(key: str, *records: dict[str, float] | None) -> tuple[float | None, ...]:
    """Return a measure of each surface; None for a surface without a triangle."""
    unit = 1000.0 if key.endswith("_m") else 100.0
    return tuple(None if record is None else record[key] * unit for record in records)


def _nodes(result: Reconstruction, metrics: dict[str, Any]) -> Iterator[Markup]:
    yield Markup("<h2>Measured and inferred depth of the nodes</h2>")
    for frame, node in zip(result.rig.frames[:MOST_SHOWN], result.nodes[:MOST_SHOWN], strict=True):
        range_m = depth_range_m(frame.depth)
        sensor = depth_picture(frame.depth, range_m, f"sensor depth ({frame.depth.coverage:.0%} known)")
        inferred = depth_picture(
            node.alignment.depth,
            range_m,
            f"inferred depth (alignment {node.alignment.mode}, {node.network.provider})",
        )
        figures = (
            picture(frame.rgb, f"{frame.name}, colour"),
            picture(sensor.rgb, sensor.caption),
            picture(inferred.rgb, inferred.caption),
        )
        yield pictures(figures, columns=3)
    rows = (
        (
            *(node[key] for key in ("name", "sensor_points", "outliers")),
            100.0 * node["kept_share"],
            node["filled_points"],
            1000 * node["alignment"]["residual_rms_m"],
        )
        for node in metrics["nodes"]
    )
    head = (
        "node",
        "sensor points",
        "outliers removed",
        "measured pixels kept (%)",
        "inferred points kept",
        "alignment residual (mm)",
    )
    yield table(head, rows)


def _registrations(metrics: dict[str, Any]) -> Iterator[Markup]:
    if not metrics["registration"]:
        return
    yield Markup("<h2>Registration of the nodes</h2>")
    head = ("node", "onto", "method", "iterations", "reason of the stop")
    rows = (
        (
            *(item[key] for key in ("source", "target", "method", "iterations", "stop_reason")),
            None if item["rmse_m"] is None else 1000 * item["rmse_m"],
            1000 * item["loop_error_m"] if math.isfinite(item["loop_error_m"]) else None,
            100 * item["within_2pct_share"] if math.isfinite(item["within_2pct_share"]) else None,
            "yes" if item["used"] else "no",
        )
        for item in metrics["registration"]
    )
    yield table(
        (*head, "weighted RMSE (mm)", "loop error (mm)", "points that agree within 2 % (%)", "used"), rows
    )
