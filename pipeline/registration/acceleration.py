"""Safeguarded Anderson acceleration: a pose that raises the energy is undone (Zhang, Yao, Deng 2021)."""

from __future__ import annotations

import numpy as np

from pipeline.registration.anderson import Anderson
from pipeline.registration.weighting import PairWeights
from pipeline.types import FloatArray


class Acceleration:
    """Anderson extrapolation of poses that never lets the method's energy rise."""

    def __init__(self, moved_m: FloatArray) -> None:
        """For a cloud of (N, 3) points at the start pose, whose middle and spread give the frame and unit."""
        center_m = moved_m.mean(axis=0)
        spread_m = float(np.sqrt(np.mean(np.sum((moved_m - center_m) ** 2, axis=1))))
        self._mixer = Anderson(center_m=center_m, spread_m=spread_m or 1.0)
        self._energy = float("inf")
        self._sigma_m = float("nan")
        self._plain: FloatArray | None = None

    def fallback(self, kept: PairWeights) -> FloatArray | None:
        """The pose of the last plain update, if the extrapolated one raised the energy; else None."""
        if kept.sigma_m != self._sigma_m:
            self._mixer.reset()
        elif self._plain is not None and kept.energy > self._energy:
            self._mixer.reset()
            plain, self._plain = self._plain, None
            return plain
        return None

    def extrapolated(self, T: FloatArray, T_plain: FloatArray, kept: PairWeights) -> FloatArray:
        """The next pose, from the present one and its plain update."""
        self._energy, self._sigma_m, self._plain = kept.energy, kept.sigma_m, T_plain
        return self._mixer.mix(T, T_plain)
