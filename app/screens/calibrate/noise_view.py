"""Request and result of the replayed noise experiment."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.types import BoolArray, FloatArray

TRIALS = 200
CLOSE = 0.005
"""The thesis's claim: fx, fy, cx and cy are all within this share of the truth."""
INSIDE_95 = 5.991
"""Squared Mahalanobis distance that 95 % of a 2-D normal distribution do not exceed."""


@dataclass(frozen=True, slots=True)
class NoiseRequest:
    """Repeat a calibration with noise on its points."""

    camera: str
    sigma_px: float
    """Standard deviation of the noise of each coordinate."""
    other_lens: bool = False
    """Whether the points are projected through a lens with more distortion (p1, p2, k3) than the estimated
    one, which must not be a fisheye."""
    trials: int = TRIALS


@dataclass(frozen=True, slots=True)
class NoiseView:
    """The completed trials."""

    request: NoiseRequest
    names: tuple[str, ...]
    """Names of the P parameters."""
    truth: FloatArray
    """(P,) true parameters."""
    found: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """(T, P) estimated parameters."""
    covariance: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """(P, P) mean of the covariances that the trials predict."""
    rms_px: float = 0.0
    """Mean over the trials of the RMS reprojection error."""
    halved: int = 0
    """Number of trials in which two halves of the views were compared."""
    beyond_noise: int = 0
    """Number of these in which the halves differed by more than noise explains."""

    @property
    def trials(self) -> int:
        """Number of completed trials."""
        return len(self.found)

    def column(self, name: str) -> FloatArray:
        """Return a parameter's (T,) estimates."""
        return self.found[:, self.names.index(name)]

    def true(self, name: str) -> float:
        """Return a parameter's true value."""
        return float(self.truth[self.names.index(name)])

    def rmse(self, name: str) -> float:
        """Return the root mean square error of a parameter over the trials."""
        return float(np.sqrt(np.mean((self.column(name) - self.true(name)) ** 2)))

    def predicted(self, name: str) -> float:
        """Return a parameter's standard error: the root of the mean variance that the trials predict."""
        at = self.names.index(name)
        return float(np.sqrt(self.covariance[at, at]))

    def pair_covariance(self, x: str, y: str) -> FloatArray:
        """Return the (2, 2) covariance of two parameters."""
        at = [self.names.index(x), self.names.index(y)]
        return self.covariance[np.ix_(at, at)]

    def inside(self, x: str, y: str) -> BoolArray:
        """Return (T,) whether a trial is in the ellipse that should hold 95 % of them."""
        apart = np.column_stack([self.column(x) - self.true(x), self.column(y) - self.true(y)])
        far = np.einsum("ti,ij,tj->t", apart, np.linalg.pinv(self.pair_covariance(x, y)), apart)
        return far <= INSIDE_95

    @property
    def close_share(self) -> float:
        """Share of the trials with fx, fy, cx and cy all within 0.5 %."""
        places = [self.names.index(name) for name in ("fx", "fy", "cx", "cy")]
        relative = np.abs(self.found[:, places] / self.truth[places] - 1.0)
        return float((relative <= CLOSE).all(axis=1).mean())
