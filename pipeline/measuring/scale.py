"""Comparison of a measured length with its true length, and the surface scaled by their ratio."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.propagation import Z95
from pipeline.measuring.surface import MeasuredSurface
from pipeline.measuring.values import Measure

LEAST_SCALE_SD = 1e-4
"""Least relative standard deviation of a measured ratio of lengths."""


@dataclass(frozen=True, slots=True)
class ScaleCheck:
    """A measured length compared with its true length."""

    factor: float
    """Scale of the new surface over that of the one before."""
    ratio: float
    """True over measured length."""
    agrees: bool
    """Whether the true length is inside the measure's interval."""
    sentence: str
    advice: str
    """What to measure instead of a length that is known less well than the scale before; else empty."""


def with_scale(
    surface: MeasuredSurface, true_m: float, measured: Measure
) -> tuple[MeasuredSurface, ScaleCheck]:
    """Compare a measured length with its true one, and scale the surface by what both scales tell together.

    The ratio r of true and measured length has the relative variance o^2 of the measure without its scale;
    the scale before, 1, has s^2. Weighted by their inverses, the scale is r^(s^2 / (s^2 + o^2)) with the
    variance s^2 o^2 / (s^2 + o^2), smaller than both. Where the true length is outside the measure's
    interval, the two contradict each other, and the true length alone counts: r and o^2. The length itself
    has its true value from then on (``declared``). Marks and planes of the surface before have to be taken
    again on the scaled one.

    Args:
        surface: the surface on which the length was measured.
        true_m: the true length.
        measured: a measure whose only value is a length.

    Raises:
        InputError: the measure is no single length, is guessed or not surely above 0, or the true length is
            not positive.
    """
    one = measured.values[0]
    _check(measured, true_m)
    (low_m, high_m), ratio = one.ci95, true_m / one.value
    relative = (high_m - one.value) / Z95 / one.value
    before = surface.scale_sd
    own = max(LEAST_SCALE_SD, float(np.sqrt(max(relative**2 - before**2, 0.0))))
    total = float(np.hypot(own, before))
    agrees = low_m <= true_m <= high_m
    factor, sd = (ratio ** ((before / total) ** 2), before * own / total) if agrees else (ratio, own)
    verb = "agrees with" if agrees else "does not agree with"
    why = (
        f"because the scale before is known to {100.0 * before:.2g} % and this length to {100.0 * own:.2g} %"
        if agrees
        else f"by this length alone, which is known to {100.0 * own:.2g} %"
    )
    sentence = (
        f"The true length {true_m:.4g} m {verb} the measured {one.value:.4g} m ({low_m:.4g} to "
        f"{high_m:.4g}); all other lengths are scaled by {factor:.4f}, {why}"
    )
    advice = f"This length is known to {100.0 * own:.2g} % only; measure a longer one" if own > before else ""
    to_scaled = np.diag([1.0, 1.0, 1.0, factor, factor, factor])
    scaled = replace(
        surface,
        vertices_m=surface.vertices_m * factor,
        sigma_m=surface.sigma_m * factor,
        ranges_m=None if surface.ranges_m is None else surface.ranges_m * factor,
        pose_covariances=to_scaled @ surface.pose_covariances @ to_scaled,
        scale_sd=sd,
        scale_source=f"The scale has a standard deviation of {100.0 * sd:.2g} %, from a true length"
        f"{' and the scale before' if agrees else ''}",
        bent_sd=surface.tilting_sd,
    )
    return scaled, ScaleCheck(factor, ratio, agrees, sentence, advice)


def declared(measured: Measure, true_m: float) -> Measure:
    """Return the measure that set the scale with its true length, which has no error."""
    (one,) = measured.values
    return replace(measured, values=(replace(one, value=true_m, ci95=(true_m, true_m)),))


def _check(measured: Measure, true_m: float) -> None:
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
