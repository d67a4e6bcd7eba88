"""The bias of a camera's depth, from the depth images beside the photographs of the board."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.screens.calibrate.request import board_of, shots_of
from app.screens.calibrate.view import BiasView, CameraView
from app.state import BoardViews
from app.store import Store
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress
from pipeline.calibration.depth_bias import DepthFit, fit_depth
from pipeline.calibration.depth_samples import DepthSamples, board_depth_samples
from pipeline.io.depth_correction import DepthCorrection
from pipeline.io.images import read_depth
from pipeline.types import FloatArray

MOST_POINTS = 900
CURVE_POINTS = 60
GRID = 9
"""Of places along either side of the image over which a curve is averaged."""
UNITS = {
    "offset_m": ("Offset", 1000.0, "mm"),
    "scale": ("Scale", 100.0, "%"),
    "curvature_per_m": ("Curvature", 1000.0, "mm at 1 m"),
}
"""What the terms are called, and units shown in one of the field's."""


@dataclass(frozen=True, slots=True)
class DepthFound:
    """A correction, and what the panel shows of it."""

    correction: DepthCorrection
    view: BiasView


def bias_of(
    store: Store, views: BoardViews, camera: CameraView, done: float = 0.5
) -> Generator[Progress, None, DepthFound | str]:
    """The bias of a camera's depth, or why it is not known; ``done`` is the share of the work before it."""

    def compute() -> Generator[Progress, None, DepthFound | str]:
        yield Progress(f"depth of {camera.name} against the board", done)
        try:
            fit, samples = fit_bias(views, camera)
        except PacketMeshError as error:
            return str(error)
        return DepthFound(fit.correction, bias_view(fit, samples))

    key = (f"bias-{camera.name}", views)
    return (yield from store.remember(key, compute))


def fit_bias(views: BoardViews, camera: CameraView) -> tuple[DepthFit, DepthSamples]:
    """Estimate the bias.

    Args:
        views: the photographs.
        camera: that took some of them.

    Raises:
        InputError: no lens, or too few depth images.
        ReconstructionError: no pose of the board explains a view.
    """
    lens = camera.calibration
    if lens is None:
        raise InputError(f"{camera.name} has no lens yet, and depth is judged through it; {camera.reason}")
    files = [depth_file(views, camera.name, view.name) for view in lens.views]
    if not any(files):
        raise InputError(
            f"There are no depth images beside the photographs of {camera.name}; add depth_00.png beside "
            "color_00.png and so on"
        )
    depths = [None if file is None else read_depth(file) for file in files]
    samples = board_depth_samples(lens, depths, board_of(views))
    return fit_depth(samples), samples


def depth_file(views: BoardViews, camera: str, moment: str) -> Path | None:
    """The depth image of a view, on the pixels of its photograph; None without one."""
    (node,) = (one for one in shots_of(views) if one.name == camera)
    return next((shot.depth for shot in node.shots if shot.moment == moment and shot.infrared is None), None)


def bias_view(fit: DepthFit, samples: DepthSamples) -> BiasView:
    """What the panel shows of it."""
    correction = fit.correction
    rows = np.linspace(0, len(samples) - 1, min(len(samples), MOST_POINTS)).round().astype(int)
    some = samples.select(rows)
    z_m = np.linspace(float(samples.measured_m.min()), float(samples.measured_m.max()), CURVE_POINTS)
    noise = correction.noise
    return BiasView(
        terms=fit.terms,
        rows=_rows(correction),
        rms_before_m=fit.rms_before_m,
        rms_after_m=fit.rms_after_m,
        true_m=some.true_m,
        before_m=some.measured_m - some.true_m,
        after_m=correction.corrected_m(some.measured_m, some.pixels) - some.true_m,
        curve_z_m=z_m,
        curve_m=z_m - _mean_over_image_m(correction, z_m),
        sd_m=np.full(len(z_m), np.nan) if noise is None else noise.sd_m(z_m, np.ones(len(z_m))),
        note=fit.note,
    )


def _mean_over_image_m(correction: DepthCorrection, z_m: FloatArray) -> FloatArray:
    """(K,) corrected depth of measured ones, in the mean over the image."""
    sides = ((np.arange(GRID) + 0.5) * size / GRID - 0.5 for size in correction.size_px)
    pixels = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    every = correction.corrected_m(np.repeat(z_m, len(pixels)), np.tile(pixels, (len(z_m), 1)))
    return every.reshape(len(z_m), -1).mean(axis=1)


def _rows(correction: DepthCorrection) -> tuple[tuple[str, float, float, float, str], ...]:
    rows = []
    for name, (title, times, unit) in UNITS.items():
        if name in correction.ci95:
            low, high = (times * float(end) for end in correction.ci95[name])
            value = times * float(getattr(correction, name))
            start = 100.0 if name == "scale" else 0.0
            rows.append((title, value - start, low - start, high - start, unit))
    return tuple(rows)
