"""What the replay of the noise experiment asks for, and its answer."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.types import BoolArray, FloatArray

TRIALS = 200
CLOSE = 0.005
"""The thesis's claim: all four of fx, fy, cx, cy within this share."""
INSIDE_95 = 5.991
"""Squared Mahalanobis distance that 95 % of a normal distribution in the plane do not exceed."""


@dataclass(frozen=True, slots=True)
class NoiseRequest:
    """Repeat a calibration with noise on its points."""

    camera: str
    sigma_px: float
    """Standard deviation, of either coordinate."""
    other_lens: bool = False
    """Whether the views are taken through a lens of another kind than the one that is estimated."""
    trials: int = TRIALS


@dataclass(frozen=True, slots=True)
class NoiseView:
    """The trials that are done."""

    request: NoiseRequest
    names: tuple[str, ...]
    """Of the P parameters."""
    truth: FloatArray
    """(P,)"""
    found: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """(T, P)"""
    covariance: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """(P, P) that the trials predict of themselves, their mean."""
    rms_px: float = 0.0
    """Of the trials' points, their mean."""
    halved: int = 0
    """In so many trials two halves of the views were compared."""
    beyond_noise: int = 0
    """In so many of these they differed by more than noise explains."""

    @property
    def trials(self) -> int:
        """How many are done."""
        return len(self.found)

    def column(self, name: str) -> FloatArray:
        """(T,) what the trials found of a parameter."""
        return self.found[:, self.names.index(name)]

    def true(self, name: str) -> float:
        """Of a parameter."""
        return float(self.truth[self.names.index(name)])

    def rmse(self, name: str) -> float:
        """Root mean square error of the trials."""
        return float(np.sqrt(np.mean((self.column(name) - self.true(name)) ** 2)))

    def predicted(self, name: str) -> float:
        """Standard error that the trials predict."""
        at = self.names.index(name)
        return float(np.sqrt(self.covariance[at, at]))

    def pair_covariance(self, x: str, y: str) -> FloatArray:
        """(2, 2) of two parameters."""
        at = [self.names.index(x), self.names.index(y)]
        return self.covariance[np.ix_(at, at)]

    def inside(self, x: str, y: str) -> BoolArray:
        """(T,) which trials lie in the ellipse that should hold 95 % of them."""
        apart = np.column_stack([self.column(x) - self.true(x), self.column(y) - self.true(y)])
        far = np.einsum("ti,ij,tj->t", apart, np.linalg.pinv(self.pair_covariance(x, y)), apart)
        return far <= INSIDE_95

    @property
    def close_share(self) -> float:
        """Share of the trials with fx, fy, cx and cy all within 0.5 %."""
        places = [self.names.index(name) for name in ("fx", "fy", "cx", "cy")]
        relative = np.abs(self.found[:, places] / self.truth[places] - 1.0)
        return float((relative <= CLOSE).all(axis=1).mean())
