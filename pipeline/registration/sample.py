"""The points of a cloud that take part in a registration, checked and thinned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import FloatArray, IntArray, PointCloud


@dataclass(frozen=True, slots=True)
class Sample:
    """A random subset of a cloud, in the cloud's own order."""

    cloud: PointCloud
    """The chosen points with all their columns; float64."""
    rows: IntArray
    """(n,) their rows in the whole cloud."""

    @property
    def points_m(self) -> FloatArray:
        """(n, 3) the chosen points."""
        return self.cloud.points_m


def draw(cloud: PointCloud, max_points: int, seed: int, name: str) -> Sample:
    """At most ``max_points`` of the cloud; all of it when it is smaller.

    Source and target are drawn with the same seed, so that a cloud registered to itself stays put.

    Raises:
        InputError: fewer than three points, or coordinates that are not finite.
    """
    if len(cloud) < 3:
        raise InputError(
            f"The {name} cloud has {len(cloud)} points; registration needs at least three, "
            "so check its depth image or file."
        )
    bad = np.count_nonzero(~np.isfinite(cloud.points_m).all(axis=1))
    if bad:
        raise InputError(
            f"The {name} cloud has {bad} points with NaN or infinite coordinates; remove them first."
        )
    rows = np.arange(len(cloud))
    if len(cloud) > max_points:
        rows = np.sort(np.random.default_rng(seed).choice(len(cloud), max_points, replace=False))
    chosen = cloud.select(rows)
    return Sample(replace(chosen, points_m=chosen.points_m.astype(np.float64)), rows)
