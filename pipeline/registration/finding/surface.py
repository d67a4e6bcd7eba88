"""A cloud prepared to judge the points of another: its normals, noise, spacing, colours and free space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.kernels.geometry import apply
from pipeline.kernels.kdtree import KdTree, tree_of
from pipeline.registration.finding.viewpoint import RangeImage, range_image
from pipeline.registration.neighbourhood import facing_origin, pca_normals
from pipeline.registration.sample import draw
from pipeline.types import BoolArray, FloatArray, IntArray, PointCloud

REFERENCE_POINTS, JUDGED_POINTS = 20_000, 4000
"""Largest numbers of a cloud's points that represent its surface, and that the other cloud judges."""
NOISE_NEIGHBOURS, SPACING_NEIGHBOURS = 8, 4
ON_SPACINGS = 3.0
"""A point on a surface has its nearest point there at most this many spacings away."""
ON_SIGMAS = 3.0
"""Its distance to the tangent plane is at most this many standard deviations of both clouds' noise."""
ON_COSINE = 0.7
"""Its normal has at least this cosine with the surface's: they differ by at most 45 degrees."""
LEAST_TOLERANCE = 0.1
"""Tolerance that is added for the distance of a curved surface from its tangent plane, in spacings."""
LEAST_SIGMA = 0.02
"""Least standard deviation of the noise, in spacings: quantised depth can have planes without noise."""
NEAR_SPACINGS, OVER_SPACINGS = 6.0, 1.5
"""A cloud without a viewpoint judges points at most this many spacings from its nearest point, and at most
this many along the surface: a point beyond the rim of the measured surface is not judged."""


class Judgement(NamedTuple):
    """Judgement of one surface on n points of another; each array is (n,)."""

    judged: BoolArray
    """Points that it can judge: on it, or clearly not."""
    on: BoolArray
    """Judged points on the surface, within the noise."""
    through: BoolArray
    """Judged points in its free space."""
    heights: FloatArray
    """Distances to the tangent planes at the nearest points, over the noise."""
    nearest: IntArray
    """Rows of the nearest points of the judging surface."""


class Surface:
    """A sampled cloud with all that is needed to judge another's points."""

    def __init__(
        self, cloud: PointCloud, seed: int = 0, from_camera: bool = False, name: str = "compared"
    ) -> None:
        """Sample the cloud; normals it lacks, and its noise, are estimated from its points.

        Args:
            cloud: any cloud.
            seed: seed of the sample.
            from_camera: whether a camera at the origin is known to have measured it; see ``range_image``.
            name: name of the cloud in error messages.

        Raises:
            InputError: as for ``draw``.
        """
        sample = draw(cloud, REFERENCE_POINTS, seed, name).cloud
        self.points_m = sample.points_m
        self.tree: KdTree = tree_of(self.points_m)
        self.view: RangeImage | None = range_image(cloud.points_m, from_camera)
        """Free space if the cloud was seen from its origin, else None."""
        self.normals = pca_normals(self.points_m, sample.normals, self.tree)
        """(N, 3) unit normals; towards the origin if the cloud was seen from there."""
        if self.view is not None:
            self.normals = facing_origin(self.normals, self.points_m)
        distances_m, rows = self.tree.nearest(self.points_m, min(len(sample), 1 + NOISE_NEIGHBOURS))
        self.spacing_m: FloatArray = distances_m[:, 1 : 1 + SPACING_NEIGHBOURS].mean(axis=1)
        arms_m = self.points_m[rows] - self.points_m[:, None]
        heights_m = np.einsum("nki,ni->nk", arms_m, self.normals)
        self.sigma_m: FloatArray = np.maximum(heights_m.std(axis=1), LEAST_SIGMA * self.spacing_m)
        colors = sample.colors
        self.colors: FloatArray | None = None if colors is None else colors[rows].mean(axis=1)
        """(N, 3) mean colours of the neighbourhoods, 0 to 255."""
        count = min(len(sample), JUDGED_POINTS)
        self.asked: IntArray = np.sort(np.random.default_rng(seed).choice(len(sample), count, replace=False))
        """(n,) rows of the points that the other cloud judges."""
        self.middle_m: FloatArray = np.median(self.points_m, axis=0)

    def judge(self, other: Surface, T: FloatArray) -> Judgement:
        """Judge the asked points of another cloud, moved into this frame by a motion or similarity ``T``."""
        scale = float(np.cbrt(np.linalg.det(T[:3, :3])))
        moved_m = apply(T, other.points_m[other.asked])
        turned = other.normals[other.asked] @ (T[:3, :3].T / scale)
        far_m, rows = self.tree.nearest(moved_m, 1)
        distances_m, nearest = far_m[:, 0], rows[:, 0]
        spacing_m = np.maximum(self.spacing_m[nearest], scale * other.spacing_m[other.asked])
        arms_m, normals = moved_m - self.points_m[nearest], self.normals[nearest]
        heights_m = np.abs(np.einsum("ni,ni->n", arms_m, normals))
        cosines = np.einsum("ni,ni->n", turned, normals)
        if self.view is None or other.view is None:
            cosines = np.abs(cosines)  # without a viewpoint, a normal's sign is arbitrary
        sigma_m = np.hypot(self.sigma_m[nearest], scale * other.sigma_m[other.asked])
        tolerance_m = ON_SIGMAS * sigma_m + LEAST_TOLERANCE * spacing_m
        near = distances_m <= ON_SPACINGS * spacing_m
        on = near & (cosines >= ON_COSINE) & (heights_m <= tolerance_m)
        if self.view is None:
            beside_m = np.sqrt(np.maximum(distances_m**2 - heights_m**2, 0.0))
            seen = (distances_m <= NEAR_SPACINGS * spacing_m) & (beside_m <= OVER_SPACINGS * spacing_m)
            through = np.zeros(len(moved_m), np.bool_)
        else:
            seen, through = self.view.compare(moved_m, tolerance_m)
        return Judgement(on | seen, on, through & ~on, heights_m / sigma_m, nearest)
