"""What the views show of a camera: where in the image they have points, what is left there, how it bends
(SPEC 1.3 g, h).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.types import FloatArray, IntArray

CELLS = 10
"""Along the longer side of the image, of the coverage."""
CURVE_POINTS = 64
BANDS = 8
"""Of radii, in which residuals are averaged."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Points of all views in each cell of the image."""

    columns_px: FloatArray
    """(C + 1,) edges."""
    rows_px: FloatArray
    """(R + 1,)"""
    counts: IntArray
    """(R, C)"""

    @property
    def share(self) -> float:
        """Of the cells in which a point was seen, 0 to 1."""
        return float((self.counts > 0).mean())


@dataclass(frozen=True, slots=True)
class RadialResiduals:
    """Residuals by how far from the principal point they are."""

    radius_px: FloatArray
    """(N,)"""
    outward_px: FloatArray
    """(N,) part of the residual that points away from the principal point: a lens of the wrong kind shows in
    it as a wave."""
    edges_px: FloatArray
    """(B + 1,) of bands of radii."""
    mean_px: FloatArray
    """(B,) of ``outward_px`` in each band; NaN in an empty one."""
    sd_of_mean_px: FloatArray
    """(B,)"""


@dataclass(frozen=True, slots=True)
class RadialCurve:
    """How far the lens moves a point away from where a pinhole camera has it."""

    angle_deg: FloatArray
    """(K,) of the ray from the optical axis."""
    radius_px: FloatArray
    """(K,) from the principal point, as the lens has it."""
    moved_px: FloatArray
    """(K,) less f tan(angle) of a pinhole camera, or f angle of a fisheye without distortion."""
    sd_px: FloatArray
    """(K,) of it."""
    seen_to_px: float
    """Radius of the outermost point in the views; beyond it the curve is a guess."""


def coverage(views: Sequence[FittedView], size_px: tuple[int, int]) -> Coverage:
    """In which cells of the image points were seen."""
    cell_px = max(size_px) / CELLS
    columns_px, rows_px = (np.linspace(-0.5, size - 0.5, round(size / cell_px) + 1) for size in size_px)
    points_px = np.concatenate([view.points_px for view in views])
    counts = np.histogram2d(points_px[:, 1], points_px[:, 0], bins=(rows_px, columns_px))[0]
    return Coverage(columns_px, rows_px, counts.astype(np.int64))


def radial_residuals(calibration: Calibration) -> RadialResiduals:
    """Residuals of all views along the radius."""
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
    """The distortion from the principal point to the farthest corner, along the image's rows."""
    optics, (width, height) = calibration.optics, calibration.size_px
    middle_px = calibration.matrix[:2, 2]
    corners_px = np.array([(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)]) - 0.5
    reach_px = np.linalg.norm(corners_px - middle_px, axis=1).max()
    pixels = middle_px + np.column_stack([np.linspace(0.0, reach_px, CURVE_POINTS), np.zeros(CURVE_POINTS)])
    rays = optics.rays(pixels)
    rays = rays[np.isfinite(rays[:, 2])]
    angle = np.arctan2(rays[:, 0], rays[:, 2])
    told = optics.linearised(rays)
    radius_px = told.points_px[:, 0] - middle_px[0]
    plain = angle if calibration.lens == "fisheye" else np.tan(angle)
    # The middle and the focal length are what the curve is drawn against, and no part of its uncertainty.
    bends = told.by_lens[::2, 4:]
    variance_px2 = np.einsum("ki,ij,kj->k", bends, calibration.covariance[4:, 4:], bends)
    seen_px = np.concatenate([view.points_px for view in calibration.views])
    return RadialCurve(
        np.degrees(angle),
        radius_px,
        radius_px - calibration.matrix[0, 0] * plain,
        np.sqrt(variance_px2),
        float(np.linalg.norm(seen_px - middle_px, axis=1).max()),
    )
