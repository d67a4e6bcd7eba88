"""The report of a camera's calibration on one page: numbers, verdict and interactive figures."""

from __future__ import annotations

import json
from pathlib import Path

import plotly
import plotly.graph_objects as go

from app.drawing import calibration_plots as plots
from app.drawing.depth_bias_plots import depth_bias_figures
from app.reports.document import json_block, shipped
from app.reports.html import pictures, table, write_page
from app.web.markup import Markup
from pipeline.calibration.assess import Trust
from pipeline.calibration.diagnosis import radial_curve, radial_residuals
from pipeline.calibration.from_images import CameraReport

HEIGHT_PX = 380
_PLOTLY = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
_SCRIPT = Path(__file__).parent / "calibration.js"


def write_calibration_report(report: CameraReport, trust: Trust, path: Path) -> None:
    """Write the report of a camera as one HTML page; an error leaves no partial file.

    Raises:
        InputError: the file cannot be written.
    """
    found = report.calibration
    mark, judged = "reproduced" if trust.verdict.passed else "not-reproduced", trust.verdict.word
    body = Markup(
        '<h1>Calibration of a camera: <span class="{}">{}</span></h1>'
        '<p class="lead">{}</p><p class="note">{}</p>'
    ).format(mark, judged, trust.verdict.sentence, _made_of(report))
    errors = found.standard_errors
    rows = [
        (name, f"{found.parameters[name]:.6g}", f"{errors[name]:.2g}", f"{low:.6g} to {high:.6g}")
        for name, (low, high) in found.intervals.items()
    ]
    body += Markup("<h2>The lens</h2>")
    body += table(("parameter", "value", "standard error", "95 % interval"), rows)
    if trust.outliers:
        proposed = Markup("").join(Markup("<li>{}</li>").format(one.reason) for one in trust.outliers)
        body += Markup("<h2>Images to consider leaving out</h2><ul>{}</ul>").format(proposed)
    figures = _all_figures(report, trust)
    body += Markup("<h2>Pictures</h2>") + _places(len(figures))
    missing = [(name, one.reason) for name, one in report.detections.items() if not one.found]
    if missing:
        body += Markup("<h2>Images without the board</h2>") + table(("image", "why"), missing)
    body += json_block("figures", [json.loads(figure.to_json()) for figure in figures])
    write_page(path, "PacketMesh: calibration", body, (shipped(_PLOTLY), shipped(_SCRIPT)))


def _made_of(report: CameraReport) -> str:
    found, unseen = report.calibration, report.held_out_rms_px
    width, height = found.size_px
    held_out = "" if unseen is None else f", {unseen:.3f} px in held-out images"
    return (
        f"{len(found.views)} images of {width} x {height} pixels; {report.board.title}; lens {found.lens}; "
        f"RMS {found.rms_px:.3f} px{held_out}."
    )


def _all_figures(report: CameraReport, trust: Trust) -> list[go.Figure]:
    found = report.calibration
    size_px, views = found.size_px, found.views
    figures = [
        plots.views_figure(views, report.held_out, [one.name for one in trust.outliers]),
        plots.coverage_figure(trust.coverage, size_px, views),
        plots.verdict_figure(trust.verdict, trust.sd, size_px),
        plots.uncertainty_figure(trust.sd, size_px),
    ]
    if trust.halves is not None:
        figures.append(plots.difference_figure(trust.halves, size_px))
    if trust.following is not None:
        figures.append(plots.next_view_figure(trust.following, size_px, views))
    return [
        *figures,
        plots.distortion_figure(radial_curve(found)),
        plots.radial_residuals_figure(radial_residuals(found)),
        plots.residuals_figure(found),
        *({} if report.depth is None else depth_bias_figures(report.depth)).values(),
    ]


def _places(count: int) -> Markup:
    """Return HTML elements, two to a row, in which ``calibration.js`` draws the figures."""
    place = Markup('<div class="plotly-graph-div" id="figure-{}" style="min-width: 0; height: {}px"></div>')
    return pictures((place.format(row, HEIGHT_PX) for row in range(count)), 2)
