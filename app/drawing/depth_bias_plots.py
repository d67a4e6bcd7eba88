"""The bias of a depth sensor in pictures: over the distance, over the image, and its noise (SPEC 1.5)."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from app.drawing.colors import BRAND, DELIVERED, LOSS, NEUTRAL, TARGET, css
from pipeline.calibration.depth_bias import DepthFit

BAND95 = 1.96
STEPS = 80
MAP_EVERY = 8
"""Pixels of the image from one of the map's to the next."""
DIVERGING = [(0.0, "#0072b2"), (0.5, "#f7f7f7"), (1.0, "#d55e00")]
"""Too near is blue, too far is orange, right is white."""


def bias_figure(fit: DepthFit, to_m: float | None = None) -> go.Figure:
    """Measured less true depth over the distance: each view before and after, and the terms with their band.

    Args:
        fit: what was found.
        to_m: how far the curve goes; None is a little beyond the farthest view, where it is a guess.
    """
    figure = _figure("What the sensor is off by", "measured depth, m", "measured less true, mm")
    near_m, far_m = fit.correction.range_m
    z_m = np.linspace(min(near_m, 0.4), to_m or 1.25 * far_m, STEPS)
    off_m, sd_m = fit.bias_m(z_m)
    figure.add_scatter(
        x=np.concatenate([z_m, z_m[::-1]]),
        y=1000.0 * np.concatenate([off_m - BAND95 * sd_m, (off_m + BAND95 * sd_m)[::-1]]),
        fill="toself",
        fillcolor=_faint(TARGET),
        line={"width": 0},
        name="95 %",
        hoverinfo="skip",
    )
    figure.add_scatter(
        x=z_m,
        y=1000.0 * off_m,
        line={"color": css(TARGET)},
        name=" + ".join(fit.terms) or "no bias",
        hovertemplate="%{x:.2f} m: %{y:+.1f} mm<extra></extra>",
    )
    for name, values_m, color, symbol in (
        ("views, measured", fit.points.before_m, LOSS, "circle"),
        ("views, corrected", fit.points.after_m, DELIVERED, "diamond"),
    ):
        figure.add_scatter(
            x=fit.points.z_m,
            y=1000.0 * values_m,
            mode="markers",
            marker={"color": css(color), "symbol": symbol, "size": 7},
            name=name,
            hovertemplate="%{x:.2f} m: %{y:+.1f} mm<extra>" + name + "</extra>",
        )
    figure.add_hline(y=0.0, line={"color": css(NEUTRAL), "width": 1})
    if z_m[-1] > far_m:
        figure.add_vrect(
            x0=far_m,
            x1=float(z_m[-1]),
            fillcolor=css(NEUTRAL),
            opacity=0.12,
            line_width=0,
            annotation_text="no views",
            annotation_position="top right",
        )
    return figure


def bias_map_figure(fit: DepthFit, at_m: float = 1.5) -> go.Figure:
    """Measured less true depth over the image, where that much is measured, in millimetres."""
    width, height = fit.correction.size_px
    figure = _figure(f"What the sensor is off by at {at_m:g} m", "column, px", "row, px")
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
    figure.update_layout(
        xaxis={"range": [-0.5, width - 0.5], "showgrid": False, "constrain": "domain"},
        yaxis={"range": [height - 0.5, -0.5], "showgrid": False, "scaleanchor": "x", "constrain": "domain"},
    )
    return figure


def noise_figure(fit: DepthFit) -> go.Figure:
    """Standard deviation of the depth over the distance: parts of boards by their tilt, and the law."""
    figure = _figure("Noise of the depth", "depth, m", "standard deviation, mm")
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
                name=f"law at {tilt_deg:.0f}°",
                hovertemplate="%{x:.2f} m: %{y:.2f} mm<extra>%{fullData.name}</extra>",
            )
    figure.update_layout(yaxis={"rangemode": "tozero"})
    return figure


def depth_bias_figures(fit: DepthFit, at_m: float = 1.5) -> dict[str, go.Figure]:
    """All of them by name, the map only where there is one."""
    figures = {"bias": bias_figure(fit), "noise": noise_figure(fit)}
    return figures | ({"map": bias_map_figure(fit, at_m)} if "map" in fit.terms else {})


def _figure(title: str, x_title: str, y_title: str) -> go.Figure:
    figure = go.Figure()
    figure.update_layout(
        template="plotly_white",
        title={"text": title, "font": {"size": 13, "color": css(BRAND)}, "x": 0.02},
        margin={"l": 56, "r": 10, "t": 34, "b": 40},
        xaxis={"title": x_title},
        yaxis={"title": y_title},
        font={"size": 11},
        legend={"orientation": "h", "y": -0.25},
    )
    return figure


def _faint(color: tuple[int, int, int]) -> str:
    return "rgba({}, {}, {}, 0.25)".format(*color)
