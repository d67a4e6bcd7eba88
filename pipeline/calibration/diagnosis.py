"""Diagnosis of a camera's views: distribution of points in the image, residuals, and distortion curve
(SPEC 1.3 g, h).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.types import FloatArray, IntArray

CELLS = 10
"""Number of coverage cells along the longer side of the image."""
CURVE_POINTS = 64
BANDS = 8
"""Number of radius bands over which residuals are averaged."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Number of points of all views in each cell of the image."""

    columns_px: FloatArray
    """(C + 1,) edges of the columns."""
    rows_px: FloatArray
    """(R + 1,) edges of the rows."""
    counts: IntArray
    """(R, C) number of points."""

    @property
    def share(self) -> float:
        """Share of the cells with points, 0 to 1."""
        return float((self.counts > 0).mean())


@dataclass(frozen=True, slots=True)
class RadialResiduals:
    """Residuals as a function of the distance from the principal point."""

    radius_px: FloatArray
    """(N,) distance from the principal point."""
    outward_px: FloatArray
    """(N,) component of the residual away from the principal point; with a wrong lens model it is a wave
    over the radius."""
    edges_px: FloatArray
    """(B + 1,) edges of the radius bands."""
    mean_px: FloatArray
    """(B,) mean of ``outward_px`` in each band; NaN in a band of fewer than two points."""
    sd_of_mean_px: FloatArray
    """(B,) standard error of the mean; NaN likewise."""


@dataclass(frozen=True, slots=True)
class RadialCurve:
    """Displacement of points by the lens, relative to a pinhole camera."""

    angle_deg: FloatArray
    """(K,) angle of the ray from the optical axis."""
    radius_px: FloatArray
    """(K,) distance from the principal point with this lens."""
    moved_px: FloatArray
    """(K,) ``radius_px`` minus f tan(angle) of a pinhole, or minus f angle of an undistorted fisheye."""
    sd_px: FloatArray
    """(K,) standard deviation of ``moved_px``."""
    seen_to_px: float
    """Radius of the outermost point in the views; the curve is extrapolated beyond it."""


def coverage(views: Sequence[FittedView], size_px: tuple[int, int]) -> Coverage:
    """Count the points in the cells of the image."""
    cell_px = max(size_px) / CELLS
    columns_px, rows_px = (np.linspace(-0.5, size - 0.5, round(size / cell_px) + 1) for size in size_px)
    points_px = np.concatenate([view.points_px for view in views])
    counts = np.histogram2d(points_px[:, 1], points_px[:, 0], bins=(rows_px, columns_px))[0]
    return Coverage(columns_px, rows_px, counts.astype(np.int64))


def radial_residuals(calibration: Calibration) -> RadialResiduals:
    """Compute the radial component of all views' residuals."""
    points_px = np.concatenate([view.points_px for view in calibration.views])
    residuals_px = np.concatenate([view.residuals_px for view in calibration.views])
    from_middle_px = points_px - calibration.matrix[:2, 2]
    radius_px = np.linalg.norm(from_middle_px, axis=1)
    outward_px = (residuals_px * from_middle_px).sum(axis=1) / np.maximum(radius_px, 1e-9)
    edges_px = np.linspace(0.0, float(radius_px.max()), BANDS + 1)
    band = np.clip(np.digitize(radius_px, edges_px) - 1, 0, BANDS - 1)
    mean_px, sd_px = np.full(BANDS, np.nan), np.full(BANDS, np.nan)
    for row in range(BANDS):
        within = outward_px[band == row]
        if len(within) > 1:
            mean_px[row] = within.mean()
            sd_px[row] = within.std(ddof=1) / np.sqrt(len(within))
    return RadialResiduals(radius_px, outward_px, edges_px, mean_px, sd_px)


def radial_curve(calibration: Calibration) -> RadialCurve:
    """Compute the distortion along an image row, from the principal point to the farthest corner's radius."""
    optics, (width, height) = calibration.optics, calibration.size_px
    middle_px = calibration.matrix[:2, 2]
    corners_px = np.array([(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)]) - 0.5
    reach_px = np.linalg.norm(corners_px - middle_px, axis=1).max()
    pixels = middle_px + np.column_stack([np.linspace(0.0, reach_px, CURVE_POINTS), np.zeros(CURVE_POINTS)])
    rays = optics.rays(pixels)
    rays = rays[np.isfinite(rays[:, 2])]
    angle = np.arctan2(rays[:, 0], rays[:, 2])
    linear = optics.linearised(rays)
    radius_px = linear.points_px[:, 0] - middle_px[0]
    plain = angle if calibration.lens == "fisheye" else np.tan(angle)
    # Principal point and focal length are the reference of the curve, so their errors are not included.
    bends = linear.by_lens[::2, 4:]
    variance_px2 = np.einsum("ki,ij,kj->k", bends, calibration.covariance[4:, 4:], bends)
    seen_px = np.concatenate([view.points_px for view in calibration.views])
    return RadialCurve(
        np.degrees(angle),
        radius_px,
        radius_px - calibration.matrix[0, 0] * plain,
        np.sqrt(variance_px2),
        float(np.linalg.norm(seen_px - middle_px, axis=1).max()),
    )
