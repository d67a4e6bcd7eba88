"""Plots of a camera's calibration, each with its quantity and unit, in colours safe for colour-blind people.
Positions in an image are in pixels from its upper left corner.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from app.drawing.colors import DELIVERED, DISTANCE_STOPS, LOSS, NEUTRAL, SOURCE, TARGET, css
from app.drawing.plots import BAND95, faint, image_figure, titled_figure
from app.web.markup import escape
from pipeline.calibration.diagnosis import Coverage, RadialCurve, RadialResiduals
from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.calibration.next_view import NextView
from pipeline.calibration.trust import ErrorMap, HalfDifference
from pipeline.calibration.verdict import Verdict
from pipeline.types import FloatArray

RAMP = [(index / 4.0, css(color)) for index, color in enumerate(DISTANCE_STOPS)]
ARROW_SHARE = 0.03
"""Approximate length of the median residual's arrow over the image's width."""
MOST_ARROWS = 1500


def views_figure(
    fitted: Sequence[FittedView], unseen: Sequence[FittedView] = (), outliers: Sequence[str] = ()
) -> go.Figure:
    """Draw two bars per view: its error in the fit, red for an outlier, and its held-out error."""
    figure = titled_figure("Error of each view", "", "RMS, px")
    names = [escape(view.name) for view in fitted]
    colors = [css(LOSS) if view.name in outliers else css(TARGET) for view in fitted]
    figure.add_bar(x=names, y=[view.rms_px for view in fitted], name="in the fit", marker_color=colors)
    if unseen:
        figure.add_bar(
            x=[escape(view.name) for view in unseen],
            y=[view.rms_px for view in unseen],
            name="held out",
            marker_color=css(SOURCE),
        )
    figure.update_traces(hovertemplate="%{x}: %{y:.3f} px<extra>%{fullData.name}</extra>")
    figure.update_layout(barmode="group", showlegend=bool(unseen), xaxis={"type": "category"})
    return figure


def distortion_figure(curve: RadialCurve) -> go.Figure:
    """Plot the lens's radial distortion against the distance from the principal point, with a 95 % band."""
    figure = titled_figure(
        "Distortion of the lens", "distance from the principal point, px", "moved outward, px"
    )
    low, high = curve.moved_px - BAND95 * curve.sd_px, curve.moved_px + BAND95 * curve.sd_px
    figure.add_scatter(
        x=np.concatenate([curve.radius_px, curve.radius_px[::-1]]),
        y=np.concatenate([high, low[::-1]]),
        fill="toself",
        fillcolor=faint(TARGET),
        line={"width": 0},
        name="95 %",
        hoverinfo="skip",
    )
    figure.add_scatter(
        x=curve.radius_px,
        y=curve.moved_px,
        line={"color": css(TARGET)},
        name="lens",
        customdata=curve.angle_deg,
        hovertemplate="%{x:.0f} px, %{customdata:.1f}° off the axis: %{y:+.2f} px<extra></extra>",
    )
    if len(curve.radius_px) and curve.seen_to_px < curve.radius_px[-1]:
        figure.add_vrect(
            x0=curve.seen_to_px,
            x1=float(curve.radius_px[-1]),
            fillcolor=css(NEUTRAL),
            opacity=0.15,
            line_width=0,
            annotation_text="no points",
            annotation_position="top left",
        )
    return figure


def residuals_figure(calibration: Calibration) -> go.Figure:
    """Draw the residuals of all views: arrows from predicted towards observed points, lengthened."""
    points_px = np.concatenate([view.points_px for view in calibration.views])
    residuals_px = np.concatenate([view.residuals_px for view in calibration.views])
    median_px = float(np.median(np.linalg.norm(residuals_px, axis=1)))
    times = _round_number(ARROW_SHARE * calibration.size_px[0] / max(median_px, 1e-6))
    figure = image_figure(f"Residuals, drawn {times:g} times as long", calibration.size_px)
    every = max(1, -(-len(points_px) // MOST_ARROWS))
    begin_px = (points_px - residuals_px)[::every]
    end_px = begin_px + times * residuals_px[::every]
    figure.add_scatter(
        x=begin_px[:, 0],
        y=begin_px[:, 1],
        mode="markers",
        marker={"size": 3, "color": css(TARGET)},
        name="predicted",
        customdata=np.linalg.norm(residuals_px[::every], axis=1),
        hovertemplate="(%{x:.0f}, %{y:.0f}): %{customdata:.2f} px<extra></extra>",
    )
    lines = np.full((len(begin_px), 3, 2), np.nan)
    lines[:, 0], lines[:, 1] = begin_px, end_px
    figure.add_scatter(
        x=lines[..., 0].ravel(),
        y=lines[..., 1].ravel(),
        mode="lines",
        line={"color": css(SOURCE), "width": 1},
        name="towards the detected point",
        hoverinfo="skip",
    )
    return figure


def radial_residuals_figure(residuals: RadialResiduals) -> go.Figure:
    """Plot the residuals' radial component over the distance from the principal point, with the mean of each
    band of distances; a wave means a wrong lens model.
    """
    figure = titled_figure(
        "Residuals along the radius", "distance from the principal point, px", "outward, px"
    )
    figure.add_scatter(
        x=residuals.radius_px,
        y=residuals.outward_px,
        mode="markers",
        marker={"size": 3, "color": css(NEUTRAL), "opacity": 0.4},
        name="points",
        hoverinfo="skip",
    )
    figure.add_scatter(
        x=0.5 * (residuals.edges_px[1:] + residuals.edges_px[:-1]),
        y=residuals.mean_px,
        error_y={"type": "data", "array": BAND95 * residuals.sd_of_mean_px},
        mode="lines+markers",
        line={"color": css(SOURCE)},
        name="mean, 95 %",
        hovertemplate="%{x:.0f} px: %{y:+.3f} px<extra></extra>",
    )
    return figure


def uncertainty_figure(sd: ErrorMap, size_px: tuple[int, int], most_mm: float | None = None) -> go.Figure:
    """Draw a map of a point's standard deviation at the distance ``sd.range_m``, perpendicular to the ray, in
    millimetres; the colours end at ``most_mm``, by default at the 98 % quantile.
    """
    title = f"Uncertainty at {sd.range_m:g} m, one standard deviation"
    return _map_figure(sd, 1000.0 * sd.error_m, title, size_px, most_mm)


def difference_figure(
    halves: HalfDifference, size_px: tuple[int, int], most_mm: float | None = None
) -> go.Figure:
    """Draw a map of the difference, in millimetres at ``halves.map.range_m``, between the cameras calibrated
    from the even and from the odd views; the colours end at ``most_mm``, by default at the 98 % quantile.
    """
    judged = "more than" if halves.beyond_noise else "no more than"
    title = f"Difference of two halves at {halves.map.range_m:g} m: {judged} noise"
    return _map_figure(halves.map, 1000.0 * halves.map.error_m, title, size_px, most_mm)


def verdict_figure(judged: Verdict, sd: ErrorMap, size_px: tuple[int, int]) -> go.Figure:
    """Draw a map of the error that is not exceeded with a probability of 95 %, in millimetres, with a line at
    the required accuracy.
    """
    title = f"Error at {judged.range_m:g} m (95 %), required: {1000.0 * judged.accuracy_m:g} mm"
    figure = _map_figure(sd, 1000.0 * judged.error_m, title, size_px, 2000.0 * judged.accuracy_m)
    # The text leaves out the pixels of ``sd``: they are one standard deviation, not 95 %.
    figure.update_traces(hovertemplate="(%{x:.0f}, %{y:.0f}): %{z:.2f} mm<extra></extra>")
    figure.add_contour(
        x=sd.columns_px,
        y=sd.rows_px,
        z=1000.0 * judged.error_m,
        contours={"coloring": "none", "type": "constraint", "value": 1000.0 * judged.accuracy_m},
        line={"color": "white", "width": 2},
        hoverinfo="skip",
        showlegend=False,
    )
    return figure


def coverage_figure(
    coverage: Coverage, size_px: tuple[int, int], views: Sequence[FittedView] = ()
) -> go.Figure:
    """Draw a map of the number of points seen in each cell of the image; empty cells stay white."""
    title = f"Points in {100.0 * coverage.share:.0f} % of the image"
    figure = image_figure(title, size_px)
    figure.add_heatmap(
        x=coverage.columns_px,
        y=coverage.rows_px,
        z=np.where(coverage.counts > 0, coverage.counts, np.nan),
        colorscale=RAMP,
        zmin=0,
        colorbar={"title": {"text": "points"}},
        hovertemplate="%{z} points<extra></extra>",
    )
    if views:
        points_px = np.concatenate([view.points_px for view in views])
        figure.add_scatter(
            x=points_px[:, 0],
            y=points_px[:, 1],
            mode="markers",
            marker={"size": 2, "color": css(SOURCE)},
            hoverinfo="skip",
        )
    return figure


def next_view_figure(
    following: NextView, size_px: tuple[int, int], views: Sequence[FittedView] = ()
) -> go.Figure:
    """Draw where to hold the board next, over the points seen so far."""
    title = (
        f"Next: {following.distance_m:.2f} m away, tilted by {following.tilt_deg:.0f}°; "
        f"{1000.0 * following.error_before_m:.2g} mm → {1000.0 * following.error_after_m:.2g} mm"
    )
    figure = image_figure(title, size_px)
    if views:
        points_px = np.concatenate([view.points_px for view in views])
        _dots(figure, points_px, NEUTRAL, 2, "so far")
    outline_px = np.concatenate([following.outline_px, following.outline_px[:1]])
    figure.add_scatter(
        x=outline_px[:, 0],
        y=outline_px[:, 1],
        mode="lines",
        line={"color": css(DELIVERED), "width": 2},
        name="outline",
        hoverinfo="skip",
    )
    _dots(figure, following.points_px, DELIVERED, 4, "next")
    _dots(figure, following.points_px[:1], LOSS, 8, "first point")
    return figure


def _dots(
    figure: go.Figure, points_px: FloatArray, color: tuple[int, int, int], size: int, name: str
) -> None:
    figure.add_scatter(
        x=points_px[:, 0],
        y=points_px[:, 1],
        mode="markers",
        marker={"size": size, "color": css(color)},
        name=name,
        hoverinfo="skip",
    )


def _map_figure(
    errors: ErrorMap, values_mm: FloatArray, title: str, size_px: tuple[int, int], most_mm: float | None
) -> go.Figure:
    """Draw a map of (R, C) millimetres over the image; the pointer shows place, millimetres and error in px.

    The colours end at ``most_mm``; None takes the 98 % quantile.
    """
    figure = image_figure(title, size_px)
    known = values_mm[np.isfinite(values_mm)]
    most_mm = most_mm or (float(np.quantile(known, 0.98)) if len(known) else 1.0)
    figure.add_heatmap(
        x=errors.columns_px,
        y=errors.rows_px,
        z=values_mm,
        customdata=errors.error_px,
        colorscale=RAMP,
        zmin=0.0,
        zmax=most_mm,
        zsmooth="best",
        colorbar={"title": {"text": "mm"}},
        hovertemplate="(%{x:.0f}, %{y:.0f}): %{z:.2f} mm, %{customdata:.2f} px<extra></extra>",
    )
    return figure


def _round_number(value: float) -> float:
    """Return the largest of ..., 0.5, 1, 2, 5, 10, 20, ... that is not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9)))
