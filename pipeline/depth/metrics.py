"""Errors of a depth map against the truth (SPEC 3.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import FloatArray

NEAREST_M = 0.1


@dataclass(frozen=True, slots=True)
class DepthErrors:
    """Common error measures of one image; lower is better except for the deltas."""

    rmse_m: float
    """sqrt(mean (p - g)^2)."""
    rmse_log: float
    """sqrt(mean (ln p - ln g)^2)."""
    abs_rel: float
    """mean |p - g| / g, a fraction."""
    sq_rel: float
    """mean (p - g)^2 / g, metres."""
    delta_1: float
    """Share of pixels with max(p / g, g / p) < 1.25."""
    delta_2: float
    """The same for 1.25^2."""
    delta_3: float
    """The same for 1.25^3."""
    silog: float
    """Standard deviation of ln p - ln g: the logarithmic error that no scale can remove."""


def depth_errors(predicted_m: FloatArray, truth_m: FloatArray, cap_m: float = 10.0) -> DepthErrors:
    """Compute errors over the pixels with both depths known and the truth in (0.1 m, ``cap_m``).

    Args:
        predicted_m: (H, W), metres, NaN where unknown.
        truth_m: (H, W), metres, NaN where unknown.
        cap_m: largest true depth that is compared, metres.

    Raises:
        InputError: the sizes differ, or no pixel can be compared.
    """
    predicted_m, truth_m = np.asarray(predicted_m, np.float64), np.asarray(truth_m, np.float64)
    if predicted_m.shape != truth_m.shape:
        raise InputError(
            f"A depth map of {predicted_m.shape} pixels cannot be compared with a true one of "
            f"{truth_m.shape}: give both the same size."
        )
    with np.errstate(invalid="ignore"):
        compared = np.isfinite(predicted_m) & (predicted_m > 0) & (truth_m > NEAREST_M) & (truth_m < cap_m)
    if not compared.any():
        raise InputError(f"No pixel has both a predicted and a true depth between {NEAREST_M} and {cap_m} m.")
    p, g = predicted_m[compared], truth_m[compared]
    error, log_error = p - g, np.log(p) - np.log(g)
    ratio = np.exp(np.abs(log_error))
    return DepthErrors(
        rmse_m=float(np.sqrt(np.mean(error**2))),
        rmse_log=float(np.sqrt(np.mean(log_error**2))),
        abs_rel=float(np.mean(np.abs(error) / g)),
        sq_rel=float(np.mean(error**2 / g)),
        delta_1=float(np.mean(ratio < 1.25)),
        delta_2=float(np.mean(ratio < 1.25**2)),
        delta_3=float(np.mean(ratio < 1.25**3)),
        silog=float(np.std(log_error)),
    )
