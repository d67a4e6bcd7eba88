"""How a depth sensor is wrong in a way that does not average out (SPEC 1.5)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.types import DepthMap, FloatArray


@dataclass(frozen=True, slots=True)
class DepthBias:
    """The true depth of what is measured at z in pixel (u, v): a + b z + c z^2 + z s(u, v)."""

    a_m: float = 0.0
    b: float = 1.0
    c_per_m: float = 0.0
    waves: FloatArray = field(default_factory=lambda: np.zeros((1, 1)))
    """(K, L) of s, a share of the depth: how much of cos(k pi v') cos(l pi u') it holds, u' and v' from 0 to
    1 across the image. Without the first, s has no mean; it is no spline, which a calibration may fit."""

    def share(self, shape: tuple[int, int]) -> FloatArray:
        """(H, W) s at every pixel."""
        height, width = shape
        down, across = (
            np.cos(np.pi * np.outer((np.arange(size) + 0.5) / size, np.arange(count)))
            for size, count in zip((height, width), self.waves.shape, strict=True)
        )
        return down @ self.waves @ across.T

    def measured(self, true: DepthMap) -> DepthMap:
        """What a sensor with this bias reports where one without it reports ``true``."""
        above_m = true.z_m.astype(np.float64) - self.a_m
        slope = self.b + self.share(true.z_m.shape)
        root = np.sqrt(np.maximum(slope**2 + 4.0 * self.c_per_m * above_m, 0.0))
        return DepthMap((2.0 * above_m / (slope + root)).astype(np.float32), true.kind)
