"""Checks of the normals that come with a cloud: whether they are known, and whether neighbours agree."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.kernels.kdtree import KdTree
from pipeline.kernels.local_planes import patch_normals
from pipeline.types import BoolArray, FloatArray, PointCloud

_log = logging.getLogger(__name__)

_NEIGHBOURS = 6
_SAMPLED = 20_000
"""Points whose neighbours are looked at."""
_TANGENT = 0.3
"""A neighbour is on the same sheet if the cosine between normal and connection is below this."""
_ALONG = 0.5
"""Normals are along one axis if the cosine between them is above this, of either sign."""
WORTHLESS_SHARE = 0.25
"""Share of opposite neighbours from which the normals' signs are not used; random signs give a half."""
DOUBTFUL_SHARE = 0.05
"""Share of opposite neighbours from which a surface may be torn."""
LEAST_ALONG_SHARE = 0.7
"""Least share of neighbours along one axis among usable normals; random normals have a half."""
LEAST_PLANE_COSINE = 0.6
"""Least mean cosine between usable normals and the points' planes; random normals have a half."""
MOST_UNKNOWN_SHARE = 0.05
"""If a larger share of the normals is unknown, all are estimated."""
_PLANE_POINTS, _PLANE_NEIGHBOURS = 5000, 20
"""About the number of points, spread over the cloud, among which planes are fitted, and the number of points
of each plane: so few that a plane is wider than the noise."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """How well the normals of neighbours on the same sheet agree, shares from 0 to 1."""

    along_share: float
    """Share of neighbouring pairs whose normals are along about one axis, of either sign."""
    opposite_share: float
    """Share of those pairs whose normals point against each other."""
    plane_cosine: float
    """Mean cosine between a normal and that of the plane through the points around, of either sign."""

    @property
    def axes_fit(self) -> bool:
        """Whether the normals' axes are those of the surface through the points."""
        return self.along_share >= LEAST_ALONG_SHARE and self.plane_cosine >= LEAST_PLANE_COSINE

    @property
    def signs_fit(self) -> bool:
        """Whether the normals' signs say more than chance."""
        return self.opposite_share < WORTHLESS_SHARE


def known_normals(normals: FloatArray) -> BoolArray:
    """Return (N,) True where one of (N, 3) normals is finite and not zero."""
    lengths = np.linalg.norm(normals, axis=1)
    return np.isfinite(lengths) & (lengths > 0.0)


def agreement(points_m: FloatArray, normals: FloatArray) -> Agreement:
    """Measure how well (N, 3) unit normals agree with neighbours and with the points, on every k-th point."""
    count = min(_NEIGHBOURS + 1, len(points_m))
    rows = np.arange(0, len(points_m), max(1, len(points_m) // _SAMPLED))
    distances_m, near = cKDTree(points_m).query(points_m[rows], k=count, workers=-1)
    distances_m, near = distances_m.reshape(len(rows), -1)[:, 1:], near.reshape(len(rows), -1)[:, 1:]
    arms_m = points_m[near] - points_m[rows, None]
    beside_m = np.abs(np.einsum("nki,ni->nk", arms_m, normals[rows]))
    cosines = np.einsum("nki,ni->nk", normals[near], normals[rows])[beside_m <= _TANGENT * distances_m]
    along = np.abs(cosines) > _ALONG
    plane_cosine = _plane_cosine(points_m, normals)
    if not along.any():
        return Agreement(1.0 if not len(cosines) else 0.0, 0.0, plane_cosine)
    return Agreement(float(along.mean()), float((cosines[along] < 0.0).mean()), plane_cosine)


def _plane_cosine(points_m: FloatArray, normals: FloatArray) -> float:
    """Return the mean cosine between normals and planes through the points around; 1 for under 20 points."""
    rows = np.arange(0, len(points_m), max(1, len(points_m) // _PLANE_POINTS))
    if len(rows) < _PLANE_NEIGHBOURS:
        return 1.0
    some_m = points_m[rows] - np.median(points_m, axis=0)
    axes = patch_normals(KdTree(some_m), _PLANE_NEIGHBOURS)
    return float(np.abs(np.einsum("ni,ni->n", axes, normals[rows])).mean())


def without_bad_normals(cloud: PointCloud, name: str) -> PointCloud:
    """Return a cloud with unit normals; normals that cannot be used are left out with a warning.

    Args:
        cloud: any cloud.
        name: ``source`` or ``target``, for the warning.
    """
    if cloud.normals is None:
        return cloud
    known = known_normals(cloud.normals)
    if not known.all():
        _log.warning(
            "The normals of %d of the %d points of the %s cloud are zero or not finite; all its normals are "
            "estimated from the points",
            (~known).sum(),
            len(cloud),
            name,
        )
        return replace(cloud, normals=None)
    lengths = np.linalg.norm(cloud.normals, axis=1)
    normals = cloud.normals / np.where(np.abs(lengths - 1.0) > 1e-3, lengths, 1.0)[:, None]
    found = agreement(cloud.points_m, normals)
    if not (found.axes_fit and found.signs_fit):
        _log.warning(
            "The normals of the %s cloud cannot be used (%s); they are estimated from the points",
            name,
            opposite_text(found) if found.axes_fit else "they are not perpendicular to the surface",
        )
        return replace(cloud, normals=None)
    return replace(cloud, normals=normals)


def opposite_text(found: Agreement) -> str:
    """Return how many neighbours disagree, as part of a sentence."""
    return f"{100.0 * found.opposite_share:.0f} % of neighbouring normals point against each other"
