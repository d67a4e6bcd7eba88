"""Tables and a histogram of one node's depth; every number has a definition."""

from __future__ import annotations

import plotly.graph_objects as go

from app.compute.records import DepthNode, ResidualView
from app.drawing.colors import BRAND, LOSS, css
from app.drawing.marks import add_bars, bar_figure, mark
from app.screens.depth.labels import ALIGNMENTS
from app.web.markup import Markup
from app.window.tables import number, table

LINES = {
    "none": "z′ = z",
    "median": "z′ = {scale:.3f} z",
    "affine_depth": "z′ = {a:.3f} z {b:+.3f} m",
    "affine_inverse": "1/z′ = {a:.3f}/z {b:+.3f} 1/m",
    "local": "z′ = ({a:.3f} z {b:+.3f} m) · exp C",
    "local of disparity": "1/z′ = ({a:.3f}/z {b:+.3f} 1/m) / exp C",
}
"""Equation of every alignment mode: z is the network's depth, z′ the aligned one."""


def fitted_line(node: DepthNode) -> str:
    """Return the equation of the alignment with its fitted numbers."""
    local_of_disparity = node.disparity and node.alignment_mode == "local"
    line = LINES["local of disparity" if local_of_disparity else node.alignment_mode]
    return line.format(**node.coefficients)


def depth_table(node: DepthNode) -> Markup:
    """Return a table in HTML of the network, the alignment and the points."""
    duration = "remembered" if node.inference_s is None else number(node.inference_s, 0, "ms", 1000)
    kept, rejected = node.sensor.total, node.outliers.total
    share = rejected / max(1, kept + rejected)
    return table(
        [
            ("Network", "File of the depth network. Its only input is the colour image.", node.network),
            (
                "Network ran on",
                "The execution provider that onnxruntime really used, and its time for this image.",
                f"{node.provider}, {duration}",
            ),
            (
                "Holes filled by",
                "File of the network whose depth fills the sensor's holes.",
                f"{node.completion} (colours and depth)" if node.completion else f"{node.network} (aligned)",
            ),
            ("Alignment", "How inferred depth was made metric.", ALIGNMENTS[node.alignment_mode]),
            (
                "Residual",
                "RMS difference of aligned and sensed depth where both are known.",
                number(node.residuals.rms_m, 1, "cm", 100),
            ),
            (
                "Inliers",
                "Share of those pixels whose aligned depth is within 5 % of the sensor's.",
                number(node.inlier_share, 0, "%", 100),
            ),
            (
                "Error in holes",
                "Median error of the inferred depth in the sensor's holes, against the truth.",
                number(node.truth_error_m, 1, "cm", 100),
            ),
            (
                "Outliers",
                "Sensor points that the filter rejects, and what share of the measured pixels it keeps.",
                f"{rejected:,} ({1.0 - share:.2%} kept)",
            ),
            ("Sensor points", "Points that pass the filter.", f"{kept:,}"),
            ("Filled points", "Inferred points that fusion adds.", f"{node.filled.total:,}"),
        ]
    )


def residual_table(node: DepthNode) -> Markup:
    """Return a table in HTML of the fit and its residuals."""
    return table(
        [
            (
                "Fitted line",
                "z is the network's depth, z′ the aligned one; C is a smooth correction, different for every "
                "pixel, that only the local mode has.",
                fitted_line(node),
            ),
            (
                "Median",
                "Median of aligned minus sensor depth; a value far from 0 is a bias.",
                number(node.residuals.median_m, 2, "cm", 100),
            ),
            (
                "RMS",
                "Root mean square of aligned minus sensor depth where both are known.",
                number(node.residuals.rms_m, 1, "cm", 100),
            ),
            (
                "Pixels compared",
                "Pixels that have both sensor depth and inferred depth.",
                f"{int(node.residuals.counts.sum()):,}",
            ),
        ]
    )


def confidence_table(node: DepthNode) -> Markup:
    """Return a table in HTML of how many inferred pixels in holes are accepted, flying or out of reach."""
    judged = node.judged
    return table(
        [
            (
                "Accepted",
                "Share of the inferred pixels without sensor depth that fusion may use.",
                number(judged.kept_share, 1, "%", 100),
            ),
            (
                "Flying",
                "Share of these pixels that float between two surfaces at a depth step; they are left out.",
                number(judged.flying_share, 1, "%", 100),
            ),
            (
                "Out of reach",
                "Share of these pixels that are farther than the reach from any measured pixel; they are "
                "left out.",
                number(judged.out_of_reach_share, 1, "%", 100),
            ),
        ]
    )


def residual_figure(view: ResidualView | None) -> go.Figure:
    """Return a histogram in centimetres with lines at the median and at ± the RMS; empty for None."""
    figure = bar_figure("aligned minus sensor depth, cm", "pixels")
    if view is None:
        return figure
    add_bars(figure, 100.0 * view.edges_m, view.counts, "cm", "pixels")
    if view.counts.any():
        mark(figure, 100.0 * view.median_m, "median", css(LOSS), "center")
        if view.rms_m <= view.edges_m[-1]:
            mark(figure, -100.0 * view.rms_m, "−RMS", css(BRAND), "right")
            mark(figure, 100.0 * view.rms_m, "+RMS", css(BRAND), "left")
    return figure
