"""Ball radii by rule: the thesis's r_F to r_F + sigma_D, and wider ones (SPEC 5)."""

from __future__ import annotations

import math

import numpy as np

from packetmesh.errors import InputError
from pipeline.config import SurfaceConfig
from pipeline.kernels.point_sets import neighbour_distances_m
from pipeline.types import FloatArray

SIGMAS = {"thesis": (0.0, 0.25, 0.5, 1.0), "thesis+": (0.0, 1.0, 2.0, 4.0)}
"""Multiples of sigma_D that each rule adds to r_F."""


def nearest_distances_m(points_m: FloatArray) -> FloatArray:
    """Return (N,) distance of each of (N, 3) points to its nearest neighbour.

    Raises:
        InputError: fewer than two points.
    """
    if len(points_m) < 2:
        raise InputError(f"A cloud of {len(points_m)} points has no spacing; try one of at least 2")
    return neighbour_distances_m(points_m, 1)[:, 0]


def spacing(points_m: FloatArray) -> tuple[float, float]:
    """Return r_F and sigma_D of (N, 3) points, metres: mean and deviation of nearest-neighbour distances.

    Raises:
        InputError: fewer than two points.

    >>> import numpy as np, packetmesh as pm
    >>> pm.spacing(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]))
    (1.0, 0.0)
    """
    distances_m = nearest_distances_m(points_m)
    return float(distances_m.mean()), float(distances_m.std())


def radii(config: SurfaceConfig, r_F_m: float, sigma_D_m: float) -> tuple[float, ...]:
    """Return the distinct ball radii of a config, metres, ascending.

    Raises:
        InputError: a radius is not positive, for example because all points coincide.
    """
    if config.radius_rule == "manual":
        chosen = config.radii_m
    else:
        chosen = tuple(r_F_m + factor * sigma_D_m for factor in SIGMAS[config.radius_rule])
    if not all(math.isfinite(radius_m) and radius_m > 0.0 for radius_m in chosen):
        raise InputError(f"A ball radius is {min(chosen)} m; try about one to four times the point spacing")
    return tuple(np.unique(chosen).tolist())
