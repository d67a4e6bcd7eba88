"""Going further than one update says, and back when that was too far (Zhang, Yao, Deng 2021)."""

from __future__ import annotations

from pipeline.registration.anderson import Anderson
from pipeline.registration.weighting import PairWeights
from pipeline.types import FloatArray


class Acceleration:
    """Anderson extrapolation of poses that never lets the method's energy rise."""

    def __init__(self) -> None:
        self._mixer = Anderson()
        self._energy = float("inf")
        self._sigma_m = float("nan")
        self._plain: FloatArray | None = None

    def way_back(self, kept: PairWeights) -> FloatArray | None:
        """The plain pose to take instead, if the extrapolated one raised the energy; else None."""
        if kept.sigma_m != self._sigma_m:
            self._mixer.reset()
        elif self._plain is not None and kept.energy > self._energy:
            self._mixer.reset()
            plain, self._plain = self._plain, None
            return plain
        return None

    def onward(self, T: FloatArray, T_plain: FloatArray, kept: PairWeights) -> FloatArray:
        """The next pose, from the present one and its plain update."""
        self._energy, self._sigma_m, self._plain = kept.energy, kept.sigma_m, T_plain
        return self._mixer.mix(T, T_plain)
