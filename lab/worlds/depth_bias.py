"""A model of a depth sensor's systematic errors, which averaging does not remove (SPEC 1.5)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.types import DepthMap, FloatArray


@dataclass(frozen=True, slots=True)
class DepthBias:
    """A sensor's bias: where pixel (u, v) measures z, the true depth is a + b z + c z^2 + z s(u, v)."""

    a_m: float = 0.0
    b: float = 1.0
    c_per_m: float = 0.0
    waves: FloatArray = field(default_factory=lambda: np.zeros((1, 1)))
    """(K, L) coefficients w of s, a share of the depth: s = sum of w_kl cos(k pi v') cos(l pi u'), u' and v'
    from 0 to 1 across the image. With w_00 = 0, s has mean zero; s is no spline, unlike the model that a
    calibration fits to it."""

    def share(self, shape: tuple[int, int]) -> FloatArray:
        """Return (H, W) s at every pixel."""
        height, width = shape
        down, across = (
            np.cos(np.pi * np.outer((np.arange(size) + 0.5) / size, np.arange(count)))
            for size, count in zip((height, width), self.waves.shape, strict=True)
        )
        return down @ self.waves @ across.T

    def measured(self, true: DepthMap) -> DepthMap:
        """Return the depth that a sensor with this bias reports for the depth ``true``; NaN stays NaN."""
        above_m = true.z_m.astype(np.float64) - self.a_m
        slope = self.b + self.share(true.z_m.shape)
        root = np.sqrt(np.maximum(slope**2 + 4.0 * self.c_per_m * above_m, 0.0))
        return DepthMap((2.0 * above_m / (slope + root)).astype(np.float32), true.kind)
