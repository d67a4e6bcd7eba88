"""Estimation and orientation of a cloud's normals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from packetmesh.errors import InputError
from pipeline.kernels.kdtree import KdTree
from pipeline.kernels.local_planes import patch_normals
from pipeline.surface.boundary import connected_parts
from pipeline.types import FloatArray, IntArray, PointCloud

NEIGHBOURS = 20
"""Number of points, itself included, that define a point's tangent plane."""
GRAPH_NEIGHBOURS = 10
"""Number of neighbours from which a point can get its orientation."""
_LEAST_WEIGHT = 1e-6
"""Least weight of an edge: a sparse matrix drops weights of zero."""
MOST_NEIGHBOURS = 320
"""Most neighbours, for points whose nearer neighbours are all on a line, as along a LiDAR's ring."""
LINE = 0.05
"""Neighbours are on a line if the second largest variance is below this share of the largest."""
_CHUNK = 400_000
"""About the largest number of neighbours that are in memory together."""
_FLAT = 0.02
"""A component whose volume is a smaller share of its largest possible one counts as flat."""


def estimate_normals(cloud: PointCloud, viewpoint_m: FloatArray, neighbours: int = NEIGHBOURS) -> PointCloud:
    """Estimate unit normals by principal components, oriented towards the viewpoint.

    Args:
        cloud: at least three points.
        viewpoint_m: (3,) position of the observing camera, in the cloud's frame.
        neighbours: number of points, itself included, that define a point's tangent plane.

    Raises:
        InputError: fewer than three points or neighbours.

    >>> import numpy as np, packetmesh as pm
    >>> floor = pm.PointCloud(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    >>> upwards = pm.estimate_normals(floor, viewpoint_m=np.array([0.0, 0.0, 2.0]), neighbours=3)
    >>> bool(np.allclose(upwards.normals, [0.0, 0.0, 1.0]))
    True
    """
    return turned_to_viewpoint(_with_normals(cloud, neighbours), viewpoint_m)


def oriented_normals(cloud: PointCloud, viewpoint_m: FloatArray | None = None) -> PointCloud:
    """Estimate unit normals, oriented towards the viewpoint, or consistently outwards without one.

    Without a viewpoint, orientation is propagated along a minimum spanning tree of the tangent planes
    (Hoppe et al. 1992), and each connected component is oriented so that its volume is positive. A flat
    component has no outside; its normals point up, or along x or y if it is upright.

    Args:
        cloud: at least three points.
        viewpoint_m: (3,) position of the observing camera, in the cloud's frame.

    Raises:
        InputError: fewer than three points.
    """
    middle_m = np.median(cloud.points_m, axis=0) if len(cloud) else np.zeros(3)
    near = PointCloud(cloud.points_m - middle_m)  # the principal components lose digits far away
    near = _with_normals(near, NEIGHBOURS)
    assert near.normals is not None
    near = replace(near, normals=_off_lines(near.points_m, near.normals))
    assert near.normals is not None
    if viewpoint_m is not None:
        return replace(cloud, normals=turned_to_viewpoint(near, viewpoint_m - middle_m).normals)
    return replace(cloud, normals=_turned_outwards(near.points_m, near.normals))


def turned_to_viewpoint(cloud: PointCloud, viewpoint_m: FloatArray) -> PointCloud:
    """Flip those normals of a cloud that point away from the viewpoint.

    Raises:
        InputError: a viewpoint that is not three finite numbers.
    """
    viewpoint_m = np.asarray(viewpoint_m, dtype=np.float64)
    if viewpoint_m.shape != (3,) or not np.isfinite(viewpoint_m).all():
        raise InputError(f"The viewpoint is {viewpoint_m.tolist()} m; try three finite numbers X Y Z")
    assert cloud.normals is not None
    away = np.einsum("ni,ni->n", cloud.normals, viewpoint_m - cloud.points_m) < 0.0
    return replace(cloud, normals=np.where(away[:, None], -cloud.normals, cloud.normals))


def turned_outwards(cloud: PointCloud) -> PointCloud:
    """Turn the normals of a cloud so that neighbours agree and each connected component faces outwards."""
    assert cloud.normals is not None
    points_m = cloud.points_m - np.median(cloud.points_m, axis=0)
    return replace(cloud, normals=_turned_outwards(points_m, cloud.normals))


def _with_normals(cloud: PointCloud, neighbours: int) -> PointCloud:
    """Estimate unit normals without orientation."""
    if min(len(cloud), neighbours) < 3:
        raise InputError(
            f"Normals need at least 3 points and 3 neighbours, not {len(cloud)} and {neighbours}; try more"
        )
    return replace(cloud, normals=patch_normals(KdTree(cloud.points_m), neighbours))


def _off_lines(points_m: FloatArray, normals: FloatArray) -> FloatArray:
    """Return (N, 3) normals; a point with collinear neighbours gets its own from 2, 4, ... times as many."""
    tree, normals = cKDTree(points_m), normals.copy()
    count, left = NEIGHBOURS, np.arange(len(points_m))
    while len(left) and count <= min(MOST_NEIGHBOURS, len(points_m)):
        on_line = []
        for rows in np.array_split(left, 1 + len(left) * count // _CHUNK):
            _, near = tree.query(points_m[rows], k=count, workers=-1)
            arms_m = points_m[near] - points_m[near].mean(axis=1, keepdims=True)
            variances, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", arms_m, arms_m))
            line = variances[:, 1] < LINE * variances[:, 2]
            if count > NEIGHBOURS:
                normals[rows[~line]] = axes[~line, :, 0]
            on_line.append(rows[line])
        left, count = np.concatenate(on_line), 2 * count
    return normals


def _turned_outwards(points_m: FloatArray, normals: FloatArray) -> FloatArray:
    """Return (N, 3) normals, consistent among neighbours, every connected component outwards."""
    count = min(GRAPH_NEIGHBOURS + 1, len(points_m))
    distances_m, rows = cKDTree(points_m).query(points_m, k=count, workers=-1)
    normals = normals * _agreeing_signs(normals, rows[:, 1:])[:, None]
    edges = np.stack([np.repeat(np.arange(len(rows)), count - 1), rows[:, 1:].reshape(-1)], axis=1)
    part = connected_parts(edges, len(rows))
    facing = _facing(points_m, normals, distances_m[:, -1] ** 2, part)
    return normals * np.where(facing < 0.0, -1.0, 1.0)[:, None]


def _facing(points_m: FloatArray, normals: FloatArray, areas_m2: FloatArray, part: IntArray) -> FloatArray:
    """Return (N,) positive values where the normals of a point's component face outwards (volume > 0), or for
    a flat component towards the positive direction of the axis that they are closest to.

    Args:
        points_m: (N, 3) points.
        normals: (N, 3) normals, consistent within each component.
        areas_m2: (N,) area of the surface around each point, up to a factor.
        part: (N,) component labels from 0.
    """

    def totals(rows: FloatArray) -> FloatArray:
        return np.bincount(part, rows).astype(np.float64)

    size = totals(np.ones(len(part)))
    centers_m = np.stack([totals(column) / size for column in points_m.T], axis=1)
    arms_m = points_m - centers_m[part]
    volumes_m3 = totals(areas_m2 * np.einsum("ni,ni->n", normals, arms_m))
    largest_m3 = totals(areas_m2 * np.linalg.norm(arms_m, axis=1))
    sums = np.stack([totals(column) for column in normals.T], axis=1)
    along_axis = np.take_along_axis(sums, np.abs(sums).argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.where(np.abs(volumes_m3) > _FLAT * largest_m3, volumes_m3, along_axis)[part]


def _agreeing_signs(normals: FloatArray, neighbours: IntArray) -> FloatArray:
    """Return (N,) sign 1 or -1 of every normal, so that normals joined by the spanning tree agree.

    Args:
        normals: (N, 3) normals of either sign.
        neighbours: (N, k) rows of the neighbours.
    """
    n, k = neighbours.shape
    ends = np.repeat(np.arange(n), k), neighbours.reshape(-1)
    turns = 1.0 - np.abs(np.einsum("nki,ni->nk", normals[neighbours], normals)).reshape(-1)
    tree = minimum_spanning_tree(coo_matrix((np.maximum(turns, 0.0) + _LEAST_WEIGHT, ends), (n, n)).tocsr())
    parent = _parents(tree.tocoo(), n)
    signs = np.where(np.einsum("ni,ni->n", normals, normals[parent]) < 0.0, -1.0, 1.0)
    while not np.array_equal(grand := parent[parent], parent):
        signs *= signs[parent]  # product along a path whose length doubles at each step
        parent = grand
    return signs


def _parents(forest: coo_matrix, n: int) -> IntArray:
    """Return (n,) the parent of each vertex in its tree; a root is its own parent."""
    _, first = np.unique(connected_components(forest, directed=False)[1], return_index=True)
    joint = coo_matrix(  # vertex n is a root above all roots, so that one search finds all trees
        (
            np.ones(forest.nnz + len(first)),
            (np.append(forest.row, np.full(len(first), n)), np.append(forest.col, first)),
        ),
        (n + 1, n + 1),
    )
    parent = breadth_first_order(joint.tocsr(), n, directed=False)[1][:n]
    return np.where(parent == n, np.arange(n), parent)
