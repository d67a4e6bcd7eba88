"""Plots of a depth sensor's bias over the distance and over the image, and of its noise (SPEC 1.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go

from app.drawing.colors import DELIVERED, LOSS, NEUTRAL, TARGET, css
from app.drawing.plots import BAND95, faint, image_figure, titled_figure
from pipeline.types import FloatArray

if TYPE_CHECKING:
    from pipeline.calibration.depth_bias import DepthFit

STEPS = 80
MAP_EVERY = 8
"""Every so many columns and rows of the map are drawn."""
DIVERGING = [(0.0, "#0072b2"), (0.5, "#f7f7f7"), (1.0, "#d55e00")]
"""Measured too near is blue, too far is orange, correct is white."""


@dataclass(frozen=True, slots=True)
class BiasCurve:
    """A depth sensor's error over the distance, as numbers to draw."""

    terms: tuple[str, ...]
    z_m: FloatArray
    """(K,) measured depth."""
    off_m: FloatArray
    """(K,) measured minus true depth, without the map term."""
    band_m: FloatArray
    """(K,) half-width of the 95 % interval of ``off_m``."""
    noise_m: FloatArray | None
    """(K,) standard deviation of the depth of a board that faces the sensor; None if unknown."""
    far_m: float
    """Largest measured depth in the fit; beyond it the curve is an extrapolation."""
    view_z_m: FloatArray
    """(V,) mean depth of each view."""
    before_m: FloatArray
    """(V,) mean of measured minus true depth of each view."""
    after_m: FloatArray
    """(V,) the same mean after the correction."""


def bias_curve(fit: DepthFit, to_m: float | None = None) -> BiasCurve:
    """Return the numbers of ``bias_figure``.

    Args:
        fit: result of the depth calibration.
        to_m: depth at which the curve ends; None extrapolates to 1.25 times the largest measured depth.
    """
    near_m, far_m = fit.correction.range_m
    z_m = np.linspace(min(near_m, 0.4), to_m or 1.25 * far_m, STEPS)
    off_m, band_m = fit.bias_m(z_m)
    law, points = fit.correction.noise, fit.points
    noise_m = None if law is None else law.sd_m(z_m, np.ones(STEPS))
    return BiasCurve(
        fit.terms, z_m, off_m, band_m, noise_m, far_m, points.z_m, points.before_m, points.after_m
    )


def bias_figure(curve: BiasCurve) -> go.Figure:
    """Plot measured minus true depth over the distance: each view before and after the correction, the sum of
    the fitted terms with its 95 % band, and the noise of a pixel.
    """
    figure = titled_figure("Bias of the depth sensor", "measured depth, m", "measured minus true, mm")
    z_m, off_m, band_m = curve.z_m, curve.off_m, curve.band_m
    figure.add_scatter(
        x=np.concatenate([z_m, z_m[::-1]]),
        y=1000.0 * np.concatenate([off_m - band_m, (off_m + band_m)[::-1]]),
        fill="toself",
        fillcolor=faint(TARGET),
        line={"width": 0},
        name="95 %",
        hoverinfo="skip",
    )
    figure.add_scatter(
        x=z_m,
        y=1000.0 * off_m,
        line={"color": css(TARGET)},
        name=" + ".join(curve.terms) or "no bias",
        hovertemplate="%{x:.2f} m: %{y:+.1f} mm<extra></extra>",
    )
    for name, values_m, color, symbol in (
        ("views, measured", curve.before_m, LOSS, "circle"),
        ("views, corrected", curve.after_m, DELIVERED, "diamond"),
    ):
        figure.add_scatter(
            x=curve.view_z_m,
            y=1000.0 * values_m,
            mode="markers",
            marker={"color": css(color), "symbol": symbol, "size": 7},
            name=name,
            hovertemplate="%{x:.2f} m: %{y:+.1f} mm<extra>" + name + "</extra>",
        )
    if curve.noise_m is not None:
        _add_noise(figure, z_m, curve.noise_m)
    figure.add_hline(y=0.0, line={"color": css(NEUTRAL), "width": 1})
    if z_m[-1] > curve.far_m:
        figure.add_vrect(
            x0=curve.far_m,
            x1=float(z_m[-1]),
            fillcolor=css(NEUTRAL),
            opacity=0.12,
            line_width=0,
            annotation_text="no views",
            annotation_position="top right",
        )
    return figure


def _add_noise(figure: go.Figure, z_m: FloatArray, noise_m: FloatArray) -> None:
    """Add the two lines between which 95 % of the pixels would be if the sensor had noise but no bias."""
    for side in (-BAND95, BAND95):
        figure.add_scatter(
            x=z_m,
            y=1000.0 * side * noise_m,
            mode="lines",
            line={"color": css(NEUTRAL), "dash": "dot", "width": 1},
            name="noise of one pixel, 95 %",
            showlegend=side > 0.0,
            hoverinfo="skip",
        )


def bias_map_figure(fit: DepthFit, at_m: float = 1.5) -> go.Figure:
    """Draw a map of measured minus true depth over the image at ``at_m`` measured depth, in millimetres."""
    width, height = fit.correction.size_px
    figure = image_figure(f"Bias of the depth sensor at {at_m:g} m", (width, height))
    u, v = np.arange(0, width, MAP_EVERY), np.arange(0, height, MAP_EVERY)
    pixels = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    true_m = fit.correction.corrected_m(np.full(len(pixels), at_m), pixels)
    off_mm = 1000.0 * (at_m - true_m).reshape(len(v), len(u))
    most_mm = max(float(np.abs(off_mm).max()), 1.0)
    figure.add_heatmap(
        x=u,
        y=v,
        z=off_mm,
        colorscale=DIVERGING,
        zmin=-most_mm,
        zmax=most_mm,
        zsmooth="best",
        colorbar={"title": {"text": "mm"}},
        hovertemplate="(%{x}, %{y}): %{z:+.1f} mm<extra></extra>",
    )
    return figure


def noise_figure(fit: DepthFit) -> go.Figure:
    """Plot the depth's standard deviation over the distance: as measured on parts of boards, coloured by
    tilt, and by the fitted noise law at tilts of 0° and 45°.
    """
    figure = titled_figure("Noise of the depth", "depth, m", "standard deviation, mm")
    points, law = fit.noise_points, fit.correction.noise
    angle_deg = np.degrees(np.arccos(np.clip(points.cosine, 0.0, 1.0)))
    figure.add_scatter(
        x=points.z_m,
        y=1000.0 * points.sd_m,
        mode="markers",
        marker={
            "color": angle_deg,
            "colorscale": "Viridis",
            "size": 6,
            "colorbar": {"title": {"text": "tilt, °"}},
        },
        customdata=angle_deg,
        name="parts of boards",
        hovertemplate="%{x:.2f} m, %{customdata:.0f}°: %{y:.2f} mm<extra></extra>",
    )
    if law is not None:
        z_m = np.linspace(float(points.z_m.min()), float(points.z_m.max()), STEPS)
        for tilt_deg, dash in ((0.0, "solid"), (45.0, "dash")):
            figure.add_scatter(
                x=z_m,
                y=1000.0 * law.sd_m(z_m, float(np.cos(np.radians(tilt_deg)))),
                line={"color": css(TARGET), "dash": dash},
                name=f"model at {tilt_deg:.0f}°",
                hovertemplate="%{x:.2f} m: %{y:.2f} mm<extra>%{fullData.name}</extra>",
            )
    figure.update_layout(yaxis={"rangemode": "tozero"})
    return figure


def depth_bias_figures(fit: DepthFit, at_m: float = 1.5) -> dict[str, go.Figure]:
    """Return all figures by name; the map, at ``at_m`` measured depth, only if the fit has one."""
    figures = {"bias": bias_figure(bias_curve(fit)), "noise": noise_figure(fit)}
    return figures | ({"map": bias_map_figure(fit, at_m)} if "map" in fit.terms else {})
