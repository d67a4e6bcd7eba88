"""Rows of numbers, with units, that a notebook shows of each kind of result."""

from __future__ import annotations

import base64
from functools import singledispatch

import numpy as np
from markupsafe import Markup

from pipeline.kernels.geometry import rotation_angle_rad
from pipeline.notebook.pictures import cloud_picture, png_of, seen_picture, small_photograph, surface_picture
from pipeline.quality import SurfaceQuality
from pipeline.reconstruct import Reconstruction
from pipeline.spec import whole_s
from pipeline.surface.radii import spacing
from pipeline.types import ByteArray, PointCloud, PointSource, RegistrationResult, Rig, Surface, SurfaceResult

UNKNOWN = "–"
SHOWN_NODES = 4
SPACING_POINTS = 200_000
"""Largest number of points whose spacing is measured; more would take too long for a table."""
_CELL = Markup('<td style="text-align: {}; padding: 1px 10px 1px 0">{}</td>')
_FIGURE = Markup(
    '<figure style="margin: 0 12px 0 0; display: inline-block">'
    '<img src="data:image/png;base64,{}" alt="{}" style="max-width: 100%">'
    '<figcaption style="font-size: 12px">{}</figcaption></figure>'
)
Rows = list[tuple[str, str]]
"""Name and value with its unit."""
Figures = list[tuple[str, ByteArray]]
"""Caption and (H, W, 3) RGB."""


@singledispatch
def html_of(result: object) -> str:
    """Return the table of a result, with its pictures, as HTML."""
    raise TypeError(f"no table for {type(result).__name__}")


@html_of.register
def _cloud(cloud: PointCloud) -> str:
    rows: Rows = [("Points", f"{len(cloud):,}")]
    if len(cloud):
        rows.append(_extent(cloud.points_m))
    if 2 <= len(cloud) <= SPACING_POINTS:
        mean_m, deviation_m = spacing(cloud.points_m)
        rows.append(("Spacing, mean and deviation", f"{1000 * mean_m:.1f} and {1000 * deviation_m:.1f} mm"))
    if cloud.sigma_m is not None and np.isfinite(cloud.sigma_m).any():
        rows.append(("Noise, median", f"{1000 * np.nanmedian(cloud.sigma_m):.1f} mm"))
    if cloud.source is not None and len(cloud):
        rows.append(("Inferred points", _percent(float(np.mean(cloud.source == PointSource.INFERRED)))))
    columns = [name for name in ("colors", "normals", "pixels", "sigma_m", "source") if _has(cloud, name)]
    rows.append(("Columns", ", ".join(["points_m", *columns])))
    return _page("Point cloud", rows, [("", cloud_picture(cloud))] if len(cloud) else [])


@html_of.register
def _surface(surface: Surface) -> str:
    quality = surface.quality if isinstance(surface, SurfaceResult) else None
    rows = _size_rows(surface) + ([] if quality is None else _quality_rows(quality))
    return _page("Surface", rows, [("", surface_picture(surface))] if len(surface.triangles) else [])


@html_of.register
def _registration(result: RegistrationResult) -> str:
    T = result.T_target_source
    scale = float(np.cbrt(np.linalg.det(T[:3, :3])))
    rows: Rows = [
        ("End", f"{result.stop_reason} after {_count(len(result.steps), 'iteration')}"),
        ("Rotation", f"{np.degrees(rotation_angle_rad(T[:3, :3] / scale)):.3f}°"),
        ("Translation", f"{np.linalg.norm(T[:3, 3]):.4f} m"),
    ]
    if abs(scale - 1.0) > 1e-6:
        rows.append(("Scale", f"{scale:.5f}"))
    if result.steps:
        first, last = result.steps[0], result.steps[-1]
        rows += [
            ("RMSE of the pairs, first to last", f"{1000 * first.rmse_m:.2f} to {1000 * last.rmse_m:.2f} mm"),
            ("Pairs, by count and by weight", f"{len(last.pairs):,} and {last.effective_pairs:,.0f}"),
        ]
    cells = Markup("").join(
        Markup("<tr>{}</tr>").format(Markup("").join(_CELL.format("right", f"{value:.5f}") for value in line))
        for line in T
    )
    matrix = Markup("<div>T_target_source (m)<table>{}</table></div>").format(cells)
    return _page("Registration", rows, [], matrix)


@html_of.register
def _rig(rig: Rig) -> str:
    shares = [frame.depth.coverage for frame in rig.frames]
    sizes = {frame.rgb.shape[1::-1] for frame in rig.frames}
    rows: Rows = [
        ("Nodes", f"{len(rig.frames):,}"),
        ("Images", ", ".join(sorted(f"{width} × {height} px" for width, height in sizes))),
        ("Measured pixels", _percent(float(np.mean(shares)))),
        ("True surface", "known" if rig.truth is not None else "unknown"),
    ]
    rows += [("Note", note) for note in rig.notes]
    figures = [(frame.name, small_photograph(frame)) for frame in rig.frames[:SHOWN_NODES]]
    return _page(f"Rig {rig.name}", rows, figures)


@html_of.register
def _reconstruction(result: Reconstruction) -> str:
    before, after = result.before.quality, result.after.quality
    rows: Rows = [
        ("Nodes", f"{len(result.nodes):,}"),
        *_size_rows(result.after),
        ("Rays without a surface before fusion", _percent(before.no_hit_ray_share)),
        ("Rays without a surface after fusion", _percent(after.no_hit_ray_share)),
        ("Rays on inferred parts", _percent(after.guessed_ray_share)),
        ("Boundary (holes and outer rims)", f"{after.boundary_length_m:.1f} m"),
    ]
    if result.truth_after is not None and "f_score_5cm" in result.truth_after:
        rows.append(("F-score at 5 cm", _percent(result.truth_after["f_score_5cm"])))
    rows.append(("Time of all stages", f"{whole_s(result.timings_s):.1f} s"))
    placement = result.placement
    frame, T = placement.placed(list(zip(result.rig.frames, placement.T_world_camera, strict=True)))[0]
    figures = [
        (
            f"{name} fusion, seen by {frame.name}; magenta: a ray without a surface",
            seen_picture(surface, frame, T),
        )
        for name, surface in (("before", result.before), ("after", result.after))
        if len(surface.triangles)
    ]
    return _page(f"Reconstruction of {result.rig.name}", rows, figures)


def _size_rows(surface: Surface) -> Rows:
    rows: Rows = [
        ("Triangles", f"{len(surface.triangles):,}"),
        ("Vertices", f"{len(surface.vertices_m):,}"),
    ]
    if len(surface.triangles):
        rows.append(_extent(surface.vertices_m[np.unique(surface.triangles)]))
    if surface.radii_m:
        rows.append(("Ball radii", ", ".join(f"{1000 * r:.1f}" for r in surface.radii_m) + " mm"))
    return rows


def _quality_rows(quality: SurfaceQuality) -> Rows:
    return [
        ("Rays without a surface", _percent(quality.no_hit_ray_share)),
        ("Area", f"{quality.area_m2:.2f} m²"),
        ("Pieces", f"{quality.components:,}"),
        (
            "Boundary (holes and outer rims)",
            f"{quality.boundary_length_m:.1f} m in {_count(quality.boundary_loops, 'loop')}",
        ),
    ]


def _extent(points_m: np.ndarray) -> tuple[str, str]:
    sides = " × ".join(f"{side_m:.2f}" for side_m in np.ptp(points_m, axis=0))
    return "Extent along x, y and z", f"{sides} m"


def _percent(share: float) -> str:
    return UNKNOWN if share != share else f"{share:.1%}".replace("%", " %")


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def _has(cloud: PointCloud, column: str) -> bool:
    return getattr(cloud, column) is not None


def _page(title: str, rows: Rows, figures: Figures, more: str = "") -> str:
    """Return HTML of a title, the table of name and value, pictures, and more markup below."""
    lines = Markup("").join(
        Markup("<tr>{}{}</tr>").format(_CELL.format("left", name), _CELL.format("right", value))
        for name, value in rows
    )
    pictures = Markup("").join(
        _FIGURE.format(base64.b64encode(png_of(rgb)).decode(), caption or title, caption)
        for caption, rgb in figures
    )
    return str(
        Markup("<div><strong>{}</strong><table>{}</table>{}{}</div>").format(title, lines, pictures, more)
    )
