"""The numbers of one camera's calibration, each with its definition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.screens.calibrate.terms import BENT, HELD_OUT, INTERVAL, RMS, STANDARD_ERROR, TRUTH, VIEWS
from app.screens.calibrate.view import CameraView
from app.web.markup import Markup
from app.window.tables import number, table
from pipeline.calibration.estimate import Calibration, rms_px

UNITS = {"fx": "px", "fy": "px", "cx": "px", "cy": "px"}
MEANING = {
    "fx": "Focal length in widths of a pixel: how many pixels an angle takes.",
    "fy": "Focal length in heights of a pixel.",
    "cx": "Column of the principal point, where the optical axis meets the image.",
    "cy": "Row of the principal point.",
    "k1": "Radial distortion that grows with the square of the distance from the axis; negative is a barrel.",
    "k2": "Radial distortion with the fourth power.",
    "k3": "Radial distortion with the sixth power.",
    "p1": "Tangential distortion, of a lens that is tilted against the sensor.",
    "p2": "Tangential distortion in the other direction.",
}


def unseen_rms_px(camera: CameraView) -> float | None:
    """Over all points of the views that were held out in turn."""
    apart = [view.residuals_px for view in camera.unseen if view.name not in camera.dropped]
    return rms_px(np.concatenate(apart)) if apart else None


def summary_table(cameras: Sequence[CameraView], names: Sequence[str] = ()) -> Markup:
    """HTML: errors and the focal length, a column for each: now, and before views were dropped."""
    found = [camera.calibration for camera in cameras]

    def row(name: str, meaning: str, values: Sequence[str]) -> tuple[str, ...]:
        return (name, meaning, *values)

    rows = [
        row("Views used", VIEWS, [views_used(camera) for camera in cameras]),
        row("RMS error", RMS, [number(None if one is None else one.rms_px, 3, "px") for one in found]),
        row("Held-out RMS", HELD_OUT, [number(unseen_rms_px(camera), 3, "px") for camera in cameras]),
    ]
    rows += [
        row(f"{name} ± 95 %", MEANING[name], [within(one, name) for one in found]) for name in ("fx", "k1")
    ]
    if any(camera.warp for camera in cameras):
        rows.append(row("Board bent by", BENT, [bend(camera) for camera in cameras]))
    return table(rows, names)


def views_used(camera: CameraView) -> str:
    """How many of how many."""
    used = len(camera.calibration.views) if camera.calibration else 0
    return f"{used} of {len(camera.photographs)}"


def bend(camera: CameraView) -> str:
    """By how much the board is bent, and whether that is used."""
    warp = camera.warp
    return "–" if warp is None else f"{1000.0 * warp.bend_m:.2g} mm, {'' if warp.used else 'not '}used"


def within(found: Calibration | None, name: str) -> str:
    """A parameter with the half of its 95 % interval."""
    if found is None:
        return "–"
    value, (low, high) = found.parameters[name], found.intervals[name]
    digits = 2 if name in UNITS else 4
    return f"{value:.{digits}f} ± {0.5 * (high - low):.{digits}f}{' px' if name in UNITS else ''}"


def parameter_table(camera: CameraView) -> Markup:
    """HTML: every parameter, its standard error, its 95 % interval, and the truth where it is known."""
    found = camera.calibration
    if found is None:
        return Markup("")
    rows = []
    for name, error in found.standard_errors.items():
        digits, unit = (3, ", px") if name in UNITS else (5, "")
        low, high = found.intervals[name]
        meaning = MEANING.get(name, "Part of the denominator of a rational lens.")
        values = [f"{found.parameters[name]:.{digits}f}", f"{error:.{digits}f}"]
        values.append(f"{low:.{digits}f} to {high:.{digits}f}")
        if camera.truth:
            values.append(number(camera.truth.get(name), digits))
        rows.append((f"{name}{unit}", meaning, *values))
    truth = (("truth", TRUTH),) if camera.truth else ()
    return table(rows, ("value", ("std. error", STANDARD_ERROR), ("95 % interval", INTERVAL), *truth))
