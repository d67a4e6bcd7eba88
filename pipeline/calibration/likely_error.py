"""Distribution of a camera's error at a distance, due to noise, a lens model that does not fit the lens, and
a bent board.

The residuals of the views are explained by a linear model around the fit: changes of the lens's parameters
and of the boards' poses, a free distortion (polynomials over the image) and a bend of the board (quadratic).
Free distortion and bend have several possible sizes, each pair with a probability from the evidence of the
residuals (MacKay, "Bayesian interpolation", Neural Computation 1992); size 0 means that the lens model is
right, or the board flat. Each view has its own noise, because some are blurred. Random draws of the changes
that the residuals leave possible give the errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.calibration.lens import FREE, Optics
from pipeline.calibration.trust import Sight, sight
from pipeline.types import FloatArray

DEGREE = 5
"""Degree of the polynomials of the free distortion."""
DISTORTIONS = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""Sizes of the free distortion: standard deviation of a coefficient over that of the noise."""
BENDS = (0.0, 3e-4, 1e-3, 3e-3, 1e-2)
"""Sizes of the bend: standard deviation of its height over the board's larger half side."""
DRAWS = 600
ROUNDS = 3
"""Rounds in which the noise of the views is estimated."""
LEAST_NOISE = 0.3
"""Least noise of a view over the median of all."""
POSE, BEND = 6, 3
_FLAT = 1e-13
"""Ridge of the lens's parameters, relative to the information: their size is not limited."""


@dataclass(frozen=True, slots=True)
class LikelyError:
    """Random draws of the error over the image, for points at one distance."""

    range_m: float
    shape: tuple[int, int]
    """Rows and columns of the grid."""
    error_m: FloatArray
    """(D, R * C) distances of points from the rays of their pixels; infinite without a ray."""
    wrong_lens: float
    """Probability that the lens model does not fit the lens."""
    bent: float
    """Probability that the board is bent."""

    def within(self, accuracy_m: float, share: float) -> float:
        """Return the probability that errors are at most ``accuracy_m`` over a ``share`` of the image."""
        return float(((self.error_m <= accuracy_m).mean(axis=1) >= share).mean())

    def of_share_m(self, share: float, level: float) -> float:
        """Return the error, metres, not exceeded over a ``share`` of the image with probability ``level``."""
        of_each = np.quantile(self.error_m, share, axis=1, method="higher")
        return float(np.quantile(of_each, level, method="higher"))

    def share_within(self, accuracy_m: float, level: float) -> float:
        """Return the share of the image with errors of at most ``accuracy_m``, with probability ``level``."""
        return float(np.quantile((self.error_m <= accuracy_m).mean(axis=1), 1.0 - level, method="lower"))

    def map_m(self, level: float) -> FloatArray:
        """Return the (R, C) error, metres, that a point does not exceed with probability ``level``; NaN where
        there is no ray.
        """
        exceeded = np.quantile(self.error_m, level, axis=0, method="higher").reshape(self.shape)
        return np.where(np.isfinite(exceeded), exceeded, np.nan)


def likely_error(calibration: Calibration, range_m: float, seed: int = 0) -> LikelyError:
    """Draw the errors that the residuals of a camera's views leave possible.

    Args:
        calibration: the camera with its views.
        range_m: distance of the points.
        seed: seed of the random draws.

    Raises:
        InputError: the distance is impossible.
    """
    optics = calibration.optics
    seen = sight(optics, calibration.size_px, range_m)
    views = calibration.views
    parts = [_linear(view, optics, calibration.size_px) for view in views]
    noise_px = _noise_px(parts, np.full(len(parts), _typical_px(parts, calibration)))
    sizes = list(product(DISTORTIONS, BENDS))
    for _ in range(ROUNDS):
        normal, pull, squares = _system(parts, noise_px)
        typical_px = float(np.median(noise_px))
        found = [_solved(normal, pull, squares, _ridge(normal, optics, one, typical_px)) for one in sizes]
        best = max(found, key=lambda one: one[0])
        noise_px = _noise_px(parts, noise_px, best[1])
    evidence = np.array([one[0] + _prior(size) for one, size in zip(found, sizes, strict=True)])
    weights = np.exp(evidence - evidence.max())
    weights /= weights.sum()
    change = _change(seen, views, optics, calibration.size_px)
    error_m = _drawn(change, seen, found, weights, np.random.default_rng(seed))
    wrong_lens, bent = (
        float(sum(weight for weight, one in zip(weights, sizes, strict=True) if one[part])) for part in (0, 1)
    )
    return LikelyError(range_m, (len(seen.rows_px), len(seen.columns_px)), error_m, wrong_lens, bent)


def _prior(sizes: tuple[float, float]) -> float:
    """Return the logarithm of the prior probability of two sizes: a right lens model is as likely as a wrong
    one, a flat board as a bent one.
    """
    others = (len(DISTORTIONS) - 1, len(BENDS) - 1)
    return -sum(float(np.log(2.0 * (many if size else 1))) for size, many in zip(sizes, others, strict=True))


@dataclass(frozen=True, slots=True)
class _Part:
    """One view, linearised, with its pose eliminated."""

    columns: FloatArray
    """(2 N, Q) derivatives of the pixels by lens, free distortion and bend, orthogonal to those by the
    pose.
    """
    residuals_px: FloatArray
    """(2 N,) observed minus predicted."""


def _linear(view: FittedView, optics: Optics, size_px: tuple[int, int]) -> _Part:
    linear = optics.linearised(view.board_m, view.T_camera_board)
    by_free = _free(linear.points_px, size_px)
    by_depth = linear.by_pose[:, 3:] @ view.T_camera_board[:3, 2]
    by_bend = by_depth[:, None] * np.repeat(_bends_m(view.board_m), 2, axis=0)
    columns = np.hstack([linear.by_lens, by_free, by_bend])
    base = np.linalg.qr(linear.by_pose)[0]
    residuals = view.residuals_px.ravel()
    return _Part(columns - base @ (base.T @ columns), residuals - base @ (base.T @ residuals))


def _free(points_px: FloatArray, size_px: tuple[int, int]) -> FloatArray:
    """Return (2 N, K) displacements of pixels by K products of Legendre polynomials over the image."""
    scaled = 2.0 * (points_px + 0.5) / size_px - 1.0
    x, y = (np.polynomial.legendre.legvander(np.clip(one, -1.5, 1.5), DEGREE) for one in scaled.T)
    terms = [x[:, i] * y[:, j] for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    both = np.zeros((len(points_px), 2, 2 * len(terms)))
    both[:, 0, : len(terms)] = both[:, 1, len(terms) :] = np.stack(terms, axis=1)
    return both.reshape(2 * len(points_px), -1)


def _bends_m(board_m: FloatArray) -> FloatArray:
    """Return (N, 3) heights of a bent board's points, metres, for the bends x^2, y^2 and x y in units of the
    larger half side.
    """
    half_m = 0.5 * float(np.ptp(board_m[:, :2], axis=0).max())
    x, y = ((board_m[:, :2] - board_m[:, :2].mean(axis=0)) / half_m).T
    return half_m * np.column_stack([x * x, y * y, x * y])


def _typical_px(parts: Sequence[_Part], calibration: Calibration) -> float:
    squares = sum(float(one.residuals_px @ one.residuals_px) for one in parts)
    count = sum(len(one.residuals_px) for one in parts) - POSE * len(parts) - len(FREE[calibration.lens])
    return float(np.sqrt(squares / max(count, 1))) or 1e-6


def _noise_px(
    parts: Sequence[_Part], before_px: FloatArray, explained: FloatArray | None = None
) -> FloatArray:
    """Return (V,) standard deviations of the views' coordinates, pixels, from the unexplained residuals."""
    if explained is None:
        explained = np.zeros(parts[0].columns.shape[1])
    left = [one.residuals_px - one.columns @ explained for one in parts]
    sds_px = np.array([np.sqrt(off @ off / max(len(off) - POSE, 1)) for off in left])
    return np.maximum(sds_px, max(LEAST_NOISE * float(np.median(sds_px)), 1e-9 * float(before_px.max())))


def _system(parts: Sequence[_Part], noise_px: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return (Q, Q) information, (Q,) right side and the sum of squared residuals, all over the variance of
    the noise.
    """
    weights = noise_px**-2.0
    normal = sum(
        (w * one.columns.T @ one.columns for w, one in zip(weights, parts, strict=True)), np.zeros(())
    )
    pull = sum(
        (w * one.columns.T @ one.residuals_px for w, one in zip(weights, parts, strict=True)), np.zeros(())
    )
    squares = sum(
        float(w * one.residuals_px @ one.residuals_px) for w, one in zip(weights, parts, strict=True)
    )
    return np.asarray(normal), np.asarray(pull), squares


def _ridge(normal: FloatArray, optics: Optics, sizes: tuple[float, float], noise_px: float) -> FloatArray:
    """Return (Q,) inverse prior variances; infinite for parts of size 0."""
    lens = len(FREE[optics.lens])
    ridge = np.empty(len(normal))
    ridge[:lens] = _FLAT * np.diag(normal)[:lens]
    with np.errstate(divide="ignore"):
        ridge[lens:-BEND] = (np.float64(sizes[0]) * noise_px) ** -2.0
        ridge[-BEND:] = np.float64(sizes[1]) ** -2.0
    return ridge


def _solved(
    normal: FloatArray, pull: FloatArray, squares: float, ridge: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Return the logarithm of the evidence up to a constant, the (Q,) most likely changes, and a (Q, U) root
    of their covariance, where U changes have a finite ``ridge``.
    """
    used = np.isfinite(ridge)
    scale = 1.0 / np.sqrt(np.diag(normal)[used] + ridge[used])
    whole = (normal[np.ix_(used, used)] + np.diag(ridge[used])) * np.outer(scale, scale)
    values, turns = np.linalg.eigh(whole)
    values = np.maximum(values, 1e-14)
    root = np.zeros((len(normal), used.sum()))
    root[used] = scale[:, None] * turns / np.sqrt(values)
    mean = root @ (root.T @ pull)
    log_whole = float(np.log(values).sum() - 2.0 * np.log(scale).sum())
    return -0.5 * (squares - pull @ mean + log_whole - np.log(ridge[used]).sum()), mean, root


def _change(seen: Sight, views: Sequence[FittedView], optics: Optics, size_px: tuple[int, int]) -> FloatArray:
    """Return (G, 2, Q) derivatives of the grid's pixels by lens, free distortion and bend (0), with the
    camera in the pose that fits the boards best.
    """
    linear = [optics.linearised(view.board_m, view.T_camera_board) for view in views]
    boards = [
        np.hstack([optics_told.by_lens, _free(optics_told.points_px, size_px)]) for optics_told in linear
    ]
    # The camera moves as a whole, so that derivatives by its pose are those of points in its own frame.
    in_camera = np.concatenate(
        [view.board_m @ view.T_camera_board[:3, :3].T + view.T_camera_board[:3, 3] for view in views]
    )
    by_pose = optics.linearised(in_camera).by_pose
    placing = -np.linalg.lstsq(by_pose, np.concatenate(boards), rcond=None)[0]
    grid_px = np.stack(np.meshgrid(seen.columns_px, seen.rows_px), axis=-1).reshape(-1, 2)
    free = _free(grid_px, size_px).reshape(len(grid_px), 2, -1)
    change = np.concatenate([seen.by_lens, free], axis=2) + seen.by_pose @ placing
    return np.concatenate([change, np.zeros((len(grid_px), 2, BEND))], axis=2)


def _drawn(
    change: FloatArray,
    seen: Sight,
    found: Sequence[tuple[float, FloatArray, FloatArray]],
    weights: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Return (D, G) drawn distances of points from the rays of their pixels."""
    by_all_m = (seen.metres @ change).reshape(2 * len(change), -1)
    drawn_m = []
    for count, (_, mean, root) in zip(rng.multinomial(DRAWS, weights), found, strict=True):
        drawn = mean[:, None] + root @ rng.standard_normal((root.shape[1], count))
        drawn_m.append(np.linalg.norm((by_all_m @ drawn).reshape(len(change), 2, count), axis=1).T)
    error_m = np.concatenate(drawn_m)
    return np.where(np.isfinite(error_m), error_m, np.inf)
