"""Fusion of the sensor cloud and the inferred cloud of one node (SPEC 4.9)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.config import FusionMode
from pipeline.registration.neighbourhood import local_spacing_m
from pipeline.registration.weighting import MAD_TO_SIGMA
from pipeline.types import BoolArray, FloatArray, IntArray, PointCloud, PointSource

FAR_SPACINGS = 2.0


def fuse(
    sensor: PointCloud, inferred: PointCloud, mode: FusionMode, measured: BoolArray | None = None
) -> PointCloud:
    """Join all sensor points and the inferred points that ``mode`` admits, each labelled with its source.

    ``union`` admits all. ``fill`` admits the inferred points of pixels that the sensor has not
    measured: holes are closed up to their rim, no second layer covers measured surfaces, and no
    measurement is replaced by an inferred one, even if the outlier filter has removed it. If a cloud has
    no pixels, the distance decides: an inferred point is admitted if it is farther from its nearest
    sensor point than twice the sensor cloud's spacing there.

    Args:
        sensor: a node's sensor cloud in its camera's frame.
        inferred: the same node's inferred cloud on the same pixel grid and in the same frame.
        mode: ``union`` or ``fill``.
        measured: (H, W) pixels that the sensor has measured; None takes those of ``sensor``.

    Returns:
        A cloud with the columns that both clouds have. An inferred cloud without ``sigma_m`` gets it
        from its difference to the sensor at the pixels that both have: the confidence of SPEC 4.9.
    """
    inferred = replace(
        inferred,
        sigma_m=_inferred_sigma_m(sensor, inferred) if inferred.sigma_m is None else inferred.sigma_m,
        source=np.full(len(inferred), PointSource.INFERRED, dtype=np.uint8),
    )
    sensor = replace(sensor, source=np.full(len(sensor), PointSource.SENSOR, dtype=np.uint8))
    admitted = inferred.select(_fills(sensor, inferred, measured)) if mode == "fill" else inferred
    return PointCloud.concatenate([sensor, admitted])


def _fills(sensor: PointCloud, inferred: PointCloud, measured: BoolArray | None) -> BoolArray:
    """Return (N,) True for the inferred points where the sensor measured nothing."""
    if measured is not None and inferred.pixels is not None:
        return ~measured[inferred.pixels[:, 1], inferred.pixels[:, 0]]
    if not len(sensor):
        return np.ones(len(inferred), dtype=bool)
    if sensor.pixels is not None and inferred.pixels is not None:
        return ~np.isin(_pixel_keys(inferred.pixels), _pixel_keys(sensor.pixels))
    distances_m, nearest = cKDTree(sensor.points_m).query(inferred.points_m, workers=-1)
    return distances_m > FAR_SPACINGS * local_spacing_m(sensor.points_m)[nearest]


def _inferred_sigma_m(sensor: PointCloud, inferred: PointCloud) -> FloatArray | None:
    """Return (N,) robust relative depth error at shared pixels, times depth; None without shared pixels."""
    if sensor.pixels is None or inferred.pixels is None or not len(sensor) or not len(inferred):
        return None
    (u, v), (inferred_u, inferred_v) = sensor.pixels.T, inferred.pixels.T
    sensor_m = np.full((max(v.max(), inferred_v.max()) + 1, max(u.max(), inferred_u.max()) + 1), np.nan)
    sensor_m[v, u] = sensor.points_m[:, 2]
    ratio = inferred.points_m[:, 2] / sensor_m[inferred_v, inferred_u]
    ratio = ratio[~np.isnan(ratio)]
    if not len(ratio):
        return None
    return MAD_TO_SIGMA * float(np.median(np.abs(ratio - 1.0))) * inferred.points_m[:, 2]


def _pixel_keys(pixels: IntArray) -> IntArray:
    """Return (N,) one integer per (u, v) pixel."""
    return pixels[:, 0].astype(np.int64) << 32 | pixels[:, 1]
