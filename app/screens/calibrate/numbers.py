"""Tables of one camera's calibration; every number has a definition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from app.drawing.colors import ramp
from app.drawing.pictures import EQUAL, FARTHER, NEARER
from app.screens.calibrate.labels import (
    BENT,
    CORRELATION,
    HELD_OUT,
    INTERVAL,
    RMS,
    STANDARD_ERROR,
    TRUTH,
    VIEWS,
)
from app.screens.calibrate.view import CameraView
from app.web.markup import Markup
from app.window.tables import number, table, term
from app.window.ui import Ui
from pipeline.calibration.correlation import DISTANCE, Correlations, Pair
from pipeline.calibration.estimate import Calibration, rms_px
from pipeline.calibration.lens import FREE

UNITS = {"fx": "px", "fy": "px", "cx": "px", "cy": "px"}
MEANING = {
    "fx": "Focal length in pixel widths: pixels per radian near the optical axis.",
    "fy": "Focal length in pixel heights.",
    "cx": "Column of the principal point, where the optical axis meets the image.",
    "cy": "Row of the principal point.",
    "k1": (
        "Radial distortion, term with the square of the distance from the axis; negative: barrel distortion."
    ),
    "k2": "Radial distortion, term with the fourth power of the distance.",
    "k3": "Radial distortion, term with the sixth power of the distance.",
    "p1": "Tangential distortion of a lens that is tilted against the sensor, vertical.",
    "p2": "Tangential distortion, horizontal.",
    **dict.fromkeys(("k4", "k5", "k6"), "Term in the denominator of the rational model."),
}
FISHEYE = {
    f"k{index}": f"Distortion of a fisheye, term with the {power} power of the angle from the axis."
    for index, power in enumerate(("third", "fifth", "seventh", "ninth"), start=1)
}


def meanings(names: Sequence[str]) -> Mapping[str, str]:
    """Return the meanings of the parameters of the lens model that has these, by name."""
    return MEANING | FISHEYE if tuple(names) == FREE["fisheye"] else MEANING


def unseen_rms_px(camera: CameraView) -> float | None:
    """Return the RMS over all points of the views that were held out in turn, px; None without any."""
    apart = [view.residuals_px for view in camera.unseen if view.name not in camera.dropped]
    return rms_px(np.concatenate(apart)) if apart else None


def summary_table(cameras: Sequence[CameraView], names: Sequence[str] = ()) -> Markup:
    """Return a table in HTML, a column per calibration: views used, errors, fx, k1 and the board's bend."""
    found = [camera.calibration for camera in cameras]

    def row(name: str, meaning: str, values: Sequence[str]) -> tuple[str, ...]:
        return (name, meaning, *values)

    rows = [
        row("Views used", VIEWS, [views_used(camera) for camera in cameras]),
        row("RMS error", RMS, [number(None if one is None else one.rms_px, 3, "px") for one in found]),
        row("Held-out RMS", HELD_OUT, [number(unseen_rms_px(camera), 3, "px") for camera in cameras]),
    ]
    meaning = meanings(next((one.names for one in found if one is not None), ()))
    rows += [
        row(f"{name} ± 95 %", meaning[name], [within(one, name) for one in found]) for name in ("fx", "k1")
    ]
    if any(camera.warp for camera in cameras):
        rows.append(row("Board bent by", BENT, [bend(camera) for camera in cameras]))
    return table(rows, names)


def views_used(camera: CameraView) -> str:
    """Return the numbers of used and of all views as text."""
    used = len(camera.calibration.views) if camera.calibration else 0
    return f"{used} of {len(camera.photographs)}"


def bend(camera: CameraView) -> str:
    """Return the board's bend as text, and whether it is used."""
    warp = camera.warp
    return "–" if warp is None else f"{1000.0 * warp.bend_m:.2g} mm, {'' if warp.used else 'not '}used"


def within(found: Calibration | None, name: str) -> str:
    """Return a parameter with half its 95 % interval as text; a dash without a calibration."""
    if found is None:
        return "–"
    value, (low, high) = found.parameters[name], found.intervals[name]
    digits = 2 if name in UNITS else 4
    return f"{value:.{digits}f} ± {0.5 * (high - low):.{digits}f}{' px' if name in UNITS else ''}"


def parameter_table(camera: CameraView) -> Markup:
    """Return a table in HTML of every parameter, standard error, 95 % interval and known true value."""
    found = camera.calibration
    if found is None:
        return Markup("")
    rows, meaning = [], meanings(found.names)
    for name, error in found.standard_errors.items():
        digits, unit = (3, ", px") if name in UNITS else (5, "")
        low, high = found.intervals[name]
        values = [f"{found.parameters[name]:.{digits}f}", f"{error:.{digits}f}"]
        values.append(f"{low:.{digits}f} to {high:.{digits}f}")
        if camera.truth:
            values.append(number(camera.truth.get(name), digits))
        rows.append((f"{name}{unit}", meaning[name], *values))
    truth = (("truth", TRUTH),) if camera.truth else ()
    return table(rows, ("value", ("std. error", STANDARD_ERROR), ("95 % interval", INTERVAL), *truth))


WEAK = 0.8
"""Least correlation for which the sentence gives a reason."""
DARK = -0.6
"""Correlation below which its blue is dark enough for white text."""
SHORT, AWAY = "dist.", "Mean distance of the board from the camera over the views."
FOCAL, CENTER, LEANING = ("fx", "fy"), ("cx", "cy"), ("p1", "p2")


class ParameterFolder:
    """A table of the parameters, and a matrix of their correlations."""

    def __init__(self, ui: Ui) -> None:
        """Add the folder."""
        with ui.gui.add_folder("All parameters and their uncertainty", expand_by_default=False):
            self._table = ui.gui.add_html(Markup(""))
            self._together = ui.gui.add_html(Markup(""))

    def load(self, camera: CameraView | None) -> None:
        """Show another camera; None shows nothing."""
        self._table.content = Markup("") if camera is None else parameter_table(camera)
        if camera is None:
            self.load_correlations(None)

    def load_correlations(self, together: Correlations | None) -> None:
        """Show the correlations of the camera's parameters; None while they are not known."""
        self._together.content = Markup("") if together is None else correlation_html(together)


def correlation_html(together: Correlations) -> Markup:
    """Return HTML: a sentence on the strongest pair, over the lower half of the coloured matrix."""
    names = [short(name) for name in together.names]
    heads = [term(name, AWAY) if name == SHORT else name for name in names]
    rows = [
        Markup('<tr><th style="text-align: right; padding-right: 6px">{}</th>').format(heads[row])
        + Markup("").join(
            _cell(names[column], name, float(together.matrix[row, column])) for column in range(row)
        )
        + Markup("</tr>")
        for row, name in enumerate(names)
        if row
    ]
    below = Markup("").join(Markup("<th>{}</th>").format(head) for head in heads[:-1])
    return Markup(
        '<div style="padding: 0 0.8em 0.8em; font-size: 13px"><b>{}</b>: '
        "{}"
        '<table style="width: 100%; margin-top: 0.5em; border-collapse: separate; border-spacing: 2px; '
        'table-layout: fixed; font-size: 12px; font-variant-numeric: tabular-nums">{}'
        "<tr><th></th>{}</tr></table></div>"
    ).format(
        term("Correlation", CORRELATION),
        strongest_sentence(together.strongest),
        Markup("").join(rows),
        below,
    )


def _cell(one: str, other: str, value: float) -> Markup:
    red, green, blue = ramp(np.array([value + 1.0]), 2.0, (NEARER, EQUAL, FARTHER))[0].tolist()
    ink = "white" if value < DARK else "black"
    return Markup(
        '<td title="{} and {}: {}" style="background: rgb({}, {}, {}); '
        'color: {}; text-align: center; padding: 3px 0">{}</td>'
    ).format(one, other, signed(value), red, green, blue, ink, signed(value))


def signed(value: float) -> str:
    """Return a correlation with two decimals: .97, −.30, 1.00."""
    digits = f"{abs(value):.2f}"
    return ("−" if value < -0.005 else "") + (digits[1:] if digits[0] == "0" else digits)


def short(name: str) -> str:
    """Return a parameter's name in the matrix."""
    return SHORT if name == DISTANCE else name


def strongest_sentence(pair: Pair) -> str:
    """Return a sentence on the most correlated pair and the views that separate it."""
    one, other = ("the board's distance" if name == DISTANCE else name for name in (pair.first, pair.second))
    size = signed(abs(pair.correlation))
    if abs(pair.correlation) < WEAK:
        return (
            f"the views separate all parameters; the strongest correlation is {size}, of {one} and {other}."
        )
    way = "positively" if pair.correlation > 0.0 else "negatively"
    return f"{one} and {other} are correlated {way} ({size}): {separating_views(pair)}."


def separating_views(pair: Pair) -> str:
    """Return the end of a sentence: which views separate two correlated parameters, often with the reason."""
    names = {pair.first, pair.second}
    if names == set(FOCAL):
        return "both depend on the distance of the board; more tilted views determine it"
    if names <= {*FOCAL, DISTANCE}:
        return (
            "a longer focal length with a board farther away looks nearly the same; more tilted views "
            "separate them"
        )
    if names & set(CENTER) and names & set(LEANING):
        return (
            "a tilted lens looks nearly like a shifted one; boards in all corners, some of them turned "
            "by 90°, separate them"
        )
    if names & {*CENTER, *LEANING}:
        return "views tilted to opposite sides separate them"
    if names & {*FOCAL, DISTANCE}:
        return "points from the centre to the corners of the image separate them"
    return "both bend the edge of the image; points nearer to its corners separate them"
