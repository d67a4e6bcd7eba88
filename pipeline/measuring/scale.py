"""Comparison of a measured length with its true length, and the surface scaled by their ratio."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.propagation import Z95
from pipeline.measuring.surface import MeasuredSurface
from pipeline.measuring.values import Measure

LEAST_SCALE_SD = 1e-4
"""Least relative standard deviation of a scale that was set."""


@dataclass(frozen=True, slots=True)
class ScaleCheck:
    """A measured length compared with its true length."""

    factor: float
    """True over measured length."""
    agrees: bool
    """Whether the true length is inside the measure's interval."""
    sentence: str


def with_scale(
    surface: MeasuredSurface, true_m: float, measured: Measure
) -> tuple[MeasuredSurface, ScaleCheck]:
    """Compare a measured length with its true one, and scale the surface so that they agree.

    The relative standard deviation of the measure, without that of the scale before, is the scaled surface's
    ``scale_sd``. Marks and planes of the surface before have to be taken again on the scaled one.

    Args:
        surface: the surface on which the length was measured.
        true_m: the true length.
        measured: a measure whose only value is a length.

    Raises:
        InputError: the measure is no single length, is guessed or not surely above 0, or the true length is
            not positive.
    """
    one = measured.values[0]
    if len(measured.values) != 1 or one.unit != "m":
        raise InputError("The scale is set by one length; measure the distance of two points, or of a plane")
    if one.guessed:
        raise InputError("An end of this length was guessed, so it sets no scale; mark measured points")
    if not (np.isfinite(true_m) and true_m > 0.0):
        raise InputError(f"A true length of {true_m:g} m is not possible; try a positive one, in metres")
    if one.ci95[0] <= 0.0:
        raise InputError(
            f"The measured {one.value:.3g} m may be 0 m within its interval, so it sets no scale; "
            "mark a longer length"
        )
    (low_m, high_m), factor = one.ci95, true_m / one.value
    relative = (high_m - one.value) / Z95 / one.value
    own = max(LEAST_SCALE_SD, float(np.sqrt(max(relative**2 - surface.scale_sd**2, 0.0))))
    agrees = low_m <= true_m <= high_m
    verb = "agrees with" if agrees else "does not agree with"
    sentence = (
        f"The true length {true_m:.4g} m {verb} the measured {one.value:.4g} m ({low_m:.4g} to "
        f"{high_m:.4g}); scaled by {factor:.4f}, the surface has the true length"
    )
    to_scaled = np.diag([1.0, 1.0, 1.0, factor, factor, factor])
    scaled = replace(
        surface,
        vertices_m=surface.vertices_m * factor,
        sigma_m=surface.sigma_m * factor,
        ranges_m=None if surface.ranges_m is None else surface.ranges_m * factor,
        pose_covariances=to_scaled @ surface.pose_covariances @ to_scaled,
        scale_sd=own,
        scale_source=f"A true length of {true_m:.4g} m sets the scale, with a standard deviation of "
        f"{100.0 * own:.2g} %",
    )
    return scaled, ScaleCheck(factor, agrees, sentence)
