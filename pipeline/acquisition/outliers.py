"""Outlier filters by neighbour distance: the thesis's, and two for far surfaces (eqs. 3.5-3.6, SPEC 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.config import AcquisitionConfig
from pipeline.kernels.point_sets import neighbour_distances_m
from pipeline.types import BoolArray, FloatArray, PointCloud

_MAD_TO_SIGMA = 1.4826
_ROBUST_SIGMAS = 3.0
_ROUNDING = 1e-9
"""Relative tolerance of the threshold, so that rounding does not split a cloud of equal scores."""


@dataclass(frozen=True, slots=True)
class Outliers:
    """Outliers of a cloud, and the scores by which they were found."""

    keep: BoolArray
    """(N,) False for outliers."""
    score: FloatArray
    """(N,) in mode ``flying`` distance from all surrounding surfaces, in standard deviations; else the mean
    distance to the neighbours, in metres (mode ``thesis``) or pixels (d f / z, the other two modes)."""
    threshold: float
    """Largest score that is kept, in the unit of ``score``."""


@dataclass(frozen=True, slots=True)
class FilterResult:
    """A cloud split into kept points and outliers."""

    kept: PointCloud
    outliers: PointCloud
    keep: BoolArray
    """(N,) True for the kept points of the unfiltered cloud."""
    score: FloatArray
    """(N,) as in ``Outliers``."""
    threshold: float
    """Largest score that is kept, as in ``Outliers``."""


def filter_outliers(cloud: PointCloud, config: AcquisitionConfig, focal_px: float) -> FilterResult:
    """Find outliers with ``find_outliers`` and split the cloud."""
    return split(cloud, find_outliers(cloud, config, focal_px))


def split(cloud: PointCloud, found: Outliers) -> FilterResult:
    """Split a cloud into kept points and outliers."""
    keep = found.keep
    return FilterResult(cloud.select(keep), cloud.select(~keep), keep, found.score, found.threshold)


def find_outliers(cloud: PointCloud, config: AcquisitionConfig, focal_px: float) -> Outliers:
    """Find the points whose mean distance to their N nearest neighbours is unusual.

    Args:
        cloud: points in the camera frame, because the spacing of a back-projected depth map grows as z / f.
        config: mode, N and t.
        focal_px: focal length of the camera.

    Raises:
        InputError: there are at most N points, the mode is ``flying``, or points are behind the camera in a
            mode other than ``thesis``.
    """
    if config.outlier_mode == "flying":
        raise InputError("Outlier mode 'flying' needs a depth image, not a cloud; try mode 'robust'.")
    if len(cloud) <= config.outlier_neighbours:
        raise InputError(
            f"The cloud has {len(cloud)} points, too few to compare each with {config.outlier_neighbours} "
            "neighbours; check the depth image or lower outlier_neighbours."
        )
    score = neighbour_distances_m(cloud.points_m, config.outlier_neighbours).mean(axis=1)  # eq. 3.5
    if config.outlier_mode != "thesis":
        z_m = cloud.points_m[:, 2]
        if z_m.min() <= 0:
            raise InputError(
                f"Outlier mode '{config.outlier_mode}' needs points in front of the camera (z > 0); "
                "give the cloud in the camera frame or use mode 'thesis'."
            )
        score = score * focal_px / z_m
    if config.outlier_mode == "robust":
        median = np.median(score)
        threshold = median + _ROBUST_SIGMAS * _MAD_TO_SIGMA * np.median(np.abs(score - median))
    else:
        threshold = score.mean() + config.outlier_t * score.std()
    return Outliers(score <= threshold * (1.0 + _ROUNDING), score, float(threshold))
