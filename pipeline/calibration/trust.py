"""Accuracy of a camera at its working distance: the effect of noise, and the agreement of two halves of the
views (SPEC 1.3 e).

Both compare cameras with slightly different lenses. A camera whose lens changes gets the new pose that fits
the unmoved boards of the calibration best. So an error that a rotation or translation compensates does not
count, but a wrong focal length counts at distances other than the boards'. The idea is that of mrcal's
uncertainty (Kogan, "mrcal: camera calibrations and more", 2021).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.estimate import (
    LEAST_VIEWS,
    Calibration,
    View,
    best_fit,
    settle,
)
from pipeline.calibration.lens import FREE, Optics
from pipeline.config import Lens
from pipeline.kernels.geometry import apply
from pipeline.types import FloatArray

CELLS = 24
"""Number of a map's cells along the longer side of the image."""
CIRCLE95 = 2.4477
"""Radius, in sd, that contains 95 % of a round normal distribution in the plane."""
MOST_UNSURE = 20.0
"""Halves are not compared if the sd of one is more than this many times that of the whole."""
DRAWS = 2000
"""Number of random lenses that are drawn to find how much two halves differ by noise alone."""


@dataclass(frozen=True, slots=True)
class ErrorMap:
    """An error over the image, for points at one distance."""

    range_m: float
    """Distance of the points from the camera, along the pixel's ray."""
    columns_px: FloatArray
    """(C,) centres of the cells."""
    rows_px: FloatArray
    """(R,) centres of the cells."""
    error_px: FloatArray
    """(R, C) error in the image; NaN where the lens has no ray for the pixel."""
    error_m: FloatArray
    """(R, C) error perpendicular to the ray, at the distance."""


@dataclass(frozen=True, slots=True)
class HalfDifference:
    """Difference of two cameras, one calibrated from the even views and one from the odd views."""

    map: ErrorMap
    """Length of the difference of the two projections of a point."""
    ratio: float
    """Difference over that expected from noise alone, root mean square over the image: near 1 if the lens
    model is right."""
    most_by_noise: float
    """Value below which ``ratio`` is in 95 of 100 cases by noise alone."""

    @property
    def beyond_noise(self) -> bool:
        """Whether the difference exceeds noise, by a wrong lens model or a board that is not flat."""
        return self.ratio > self.most_by_noise


@dataclass(frozen=True, slots=True)
class Sight:
    """Points at one distance on the rays of a grid of pixels, with the derivatives of their images."""

    range_m: float
    columns_px: FloatArray
    rows_px: FloatArray
    points_m: FloatArray
    """(G, 3) points row by row, in the camera's frame; NaN where the lens has no ray."""
    by_pose: FloatArray
    """(G, 2, 6) derivatives of the points' pixels by their common pose."""
    by_lens: FloatArray
    """(G, 2, P) derivatives of the pixels by the lens."""
    metres: FloatArray
    """(G, 2, 2) conversion of pixels to metres perpendicular to the ray."""

    def map_of(self, error_px: FloatArray, error_m: FloatArray) -> ErrorMap:
        """Arrange (G,) values as a map."""
        shape = len(self.rows_px), len(self.columns_px)
        return ErrorMap(
            self.range_m, self.columns_px, self.rows_px, error_px.reshape(shape), error_m.reshape(shape)
        )


def sight(optics: Optics, size_px: tuple[int, int], range_m: float) -> Sight:
    """Compute the points of a map's grid.

    Raises:
        InputError: the distance is impossible.
    """
    if not 0.0 < range_m < 1e4:
        raise InputError(f"A range of {range_m:g} m cannot be judged; try the distance of what is measured")
    cell_px = max(size_px) / CELLS
    columns_px, rows_px = (
        (np.arange(round(size / cell_px)) + 0.5) * size / round(size / cell_px) - 0.5 for size in size_px
    )
    grid_px = np.stack(np.meshgrid(columns_px, rows_px), axis=-1).reshape(-1, 2)
    rays = optics.rays(grid_px)
    known = np.isfinite(rays[:, 2])
    points_m = range_m * rays
    by_pose = np.full((len(rays), 2, 6), np.nan)
    by_lens = np.full((len(rays), 2, len(FREE[optics.lens])), np.nan)
    linear = optics.linearised(points_m[known])
    by_pose[known] = linear.by_pose.reshape(-1, 2, 6)
    by_lens[known] = linear.by_lens.reshape(-1, 2, by_lens.shape[2])
    across = _across(rays[known])
    metres = np.full((len(rays), 2, 2), np.nan)
    metres[known] = np.linalg.inv(by_pose[known][:, :, 3:] @ across.transpose(0, 2, 1))
    return Sight(range_m, columns_px, rows_px, points_m, by_pose, by_lens, metres)


def projected_covariance_px2(seen: Sight, covariance: FloatArray, placing: FloatArray) -> FloatArray:
    """Return (G, 2, 2) covariances of the pixels of a grid's points.

    Args:
        seen: the grid.
        covariance: (P, P) covariance of the lens.
        placing: (6, P) derivative of the camera's new pose by the lens.
    """
    return _carried(seen.by_lens + seen.by_pose @ placing, covariance)


def placing(views: Sequence[tuple[FloatArray, FloatArray]], optics: Optics) -> FloatArray:
    """Return the (6, P) derivative, by the lens, of the camera pose that fits unmoved boards best.

    Args:
        views: (N, 3) points of each board and its (4, 4) pose in the camera's frame.
        optics: the lens.
    """
    linear = optics.linearised(_in_camera(views))
    return -np.linalg.lstsq(linear.by_pose, linear.by_lens, rcond=None)[0]


def projected_sd_px(calibration: Calibration, range_m: float) -> ErrorMap:
    """Compute the standard deviation, in the worst direction, of the image of points at a distance.

    It includes only noise in the views, not a wrong lens model, which ``half_difference_px`` detects. The
    poses of the boards are parameters like those of the lens.

    Args:
        calibration: the camera.
        range_m: distance of the points.

    Raises:
        InputError: the distance is impossible.
    """
    optics = calibration.optics
    seen = sight(optics, calibration.size_px, range_m)
    boards = [(view.board_m, view.T_camera_board) for view in calibration.views]
    return sd_map(seen, projected_covariance_px2(seen, calibration.covariance, placing(boards, optics)))


def sd_map(seen: Sight, covariance_px2: FloatArray) -> ErrorMap:
    """Return the map of the standard deviation in the worst direction, from (G, 2, 2) covariances."""
    covariance_m2 = seen.metres @ covariance_px2 @ seen.metres.transpose(0, 2, 1)
    return seen.map_of(_worst_sd(covariance_px2), _worst_sd(covariance_m2))


def half_difference_px(
    views: Sequence[View], size_px: tuple[int, int], range_m: float, lens: Lens = "thesis"
) -> HalfDifference:
    """Calibrate one camera with the even views and one with the odd views, and compare their projections.

    A wrong lens model fits each half best with other parameters, so that the halves differ by more than
    noise.

    Args:
        views: six or more.
        size_px: width and height of the images.
        range_m: distance of the points.
        lens: distortion model of both halves.

    Raises:
        InputError: there are too few views, or the distance is impossible.
        ReconstructionError: a half does not determine the lens.
    """
    if len(views) < 2 * LEAST_VIEWS:
        raise InputError(
            f"{len(views)} views cannot be halved, for each half takes {LEAST_VIEWS}; take more images"
        )
    whole, *halves = (best_fit(some, size_px, lens) for some in (views, views[0::2], views[1::2]))
    seen = sight(whole.optics, size_px, range_m)
    boards = [(view.board_m, view.T_camera_board) for view in whole.views]
    known = np.isfinite(seen.points_m[:, 2])
    change = (seen.by_lens + seen.by_pose @ placing(boards, whole.optics))[known]
    sds_px = [np.median(_worst_sd(_carried(change, one.covariance))) for one in (whole, *halves)]
    if max(sds_px) > MOST_UNSURE * sds_px[0]:
        raise ReconstructionError(
            "Half of the views do not determine this lens, so the halves cannot be compared; take more "
            "images, or a lens with fewer parameters"
        )
    boards_m = _in_camera(boards)
    boards_px = whole.optics.project(boards_m)
    difference_px = np.full((len(known), 2), np.nan)
    one_px, other_px = (
        half.optics.project(seen.points_m[known], settle(boards_m, boards_px, np.eye(4), half.optics))
        for half in halves
    )
    difference_px[known] = other_px - one_px
    across_m = (seen.metres @ difference_px[:, :, None])[:, :, 0]
    difference = seen.map_of(np.linalg.norm(difference_px, axis=1), np.linalg.norm(across_m, axis=1))
    ratio, most = _over_noise(difference_px[known], change, halves[0].covariance + halves[1].covariance)
    return HalfDifference(difference, ratio, most)


def _over_noise(difference_px: FloatArray, change: FloatArray, covariance: FloatArray) -> tuple[float, float]:
    """Return the RMS of (G, 2) differences over their predicted sd, and its 95 % limit under noise alone.

    Args:
        difference_px: (G, 2) difference of two lenses.
        change: (G, 2, P) derivatives of the pixels by the lens.
        covariance: (P, P) of the difference of two lenses.
    """
    values, turns = np.linalg.eigh(covariance)
    root = change @ (turns * np.sqrt(np.maximum(values, 0.0)))
    spread = np.linalg.inv(root @ root.transpose(0, 2, 1))
    ratio = np.sqrt(np.mean(np.einsum("gi,gij,gj->g", difference_px, spread, difference_px)) / 2.0)
    weights = np.linalg.eigvalsh(np.einsum("gip,gij,gjq->pq", root, spread, root) / (2.0 * len(root)))
    draws = np.random.default_rng(0).standard_normal((DRAWS, len(weights)))
    return float(ratio), float(np.sqrt(np.percentile(draws**2 @ np.maximum(weights, 0.0), 95.0)))


def _in_camera(views: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
    return np.concatenate([apply(T, points_m) for points_m, T in views])


def _across(rays: FloatArray) -> FloatArray:
    """Return the (N, 2, 3) pair of directions perpendicular to each of (N, 3) rays."""
    first = np.cross(rays, (0.0, 1.0, 0.0))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(rays, first)], axis=1)


def _carried(change: FloatArray, covariance: FloatArray) -> FloatArray:
    """Propagate the (P, P) covariance of the lens to (G, 2, 2) of pixels, by (G, 2, P) derivatives."""
    return change @ covariance @ change.transpose(0, 2, 1)


def _worst_sd(covariances: FloatArray) -> FloatArray:
    """Return the (G,) standard deviation along the longer axis of (G, 2, 2) covariances."""
    half = 0.5 * (covariances[:, 0, 0] + covariances[:, 1, 1])
    apart = np.hypot(0.5 * (covariances[:, 0, 0] - covariances[:, 1, 1]), covariances[:, 0, 1])
    return np.sqrt(half + apart)
