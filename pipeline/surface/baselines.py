"""Baselines for ball pivoting: screened Poisson surfaces and alpha shapes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import InputError, ReconstructionError
from pipeline.kernels.open3d_runtime import o3d
from pipeline.surface.quality import measured
from pipeline.types import FloatArray, IntArray, PointCloud, Surface, SurfaceResult

CUBE_SCALE = 1.1
"""Ratio of the edge of Poisson's cube to the widest side of the cloud."""
SHALLOWEST, DEEPEST = 2, 10
TRIM_SPACINGS = 3.0
"""Poisson closes all holes; surface farther than this many spacings from all points is removed."""


def poisson_depth(points_m: FloatArray, spacing_m: float) -> int:
    """Return the octree depth (2 to 10) whose finest cells are as wide as the spacing, or a little less."""
    cells = CUBE_SCALE * float(np.ptp(points_m, axis=0).max()) / spacing_m
    return int(np.clip(np.ceil(np.log2(max(cells, 1.0))), SHALLOWEST, DEEPEST))


def poisson_surface(cloud: PointCloud, spacing_m: float) -> SurfaceResult:
    """Reconstruct by screened Poisson (Kazhdan and Hoppe 2013, Open3D), trimmed away from the points.

    The vertices are not input points: each has the colour, normal and source of the nearest one, and no
    input point counts as unused. Poisson runs on one thread, because its result varies with more.

    Args:
        cloud: points with normals towards the outside.
        spacing_m: approximate distance of neighbouring points.

    Raises:
        InputError: fewer than three points, all coincident, no normals, or a spacing that is not positive.
        ReconstructionError: no triangle is near the points.
    """
    _check(cloud, spacing_m, "point spacing")
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        _open3d_cloud(cloud), depth=poisson_depth(cloud.points_m, spacing_m), scale=CUBE_SCALE, n_threads=1
    )
    vertices_m, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    near = np.empty(0, dtype=bool)
    if len(triangles):
        distances_m, nearest = cKDTree(cloud.points_m).query(vertices_m, workers=-1)
        near = (distances_m <= TRIM_SPACINGS * spacing_m)[triangles].all(axis=1)
    if not near.any():
        raise ReconstructionError(
            f"Poisson makes no triangle within {TRIM_SPACINGS * spacing_m:.3g} m of the points; "
            "try normals that face outwards, or more points"
        )
    used, corners = np.unique(triangles[near], return_inverse=True)
    return _surface(cloud.select(nearest[used]), vertices_m[used], corners, len(used))


def alpha_surface(cloud: PointCloud, alpha_m: float) -> SurfaceResult:
    """Compute the boundary of the alpha shape (Edelsbrunner and Muecke 1994, Open3D).

    The vertices are input points. The shape is the union of the tetrahedra whose circumscribed ball is
    smaller than ``alpha_m``. Unlike the full alpha shape, Open3D's has no triangles without such a
    tetrahedron: a rough wall becomes a slab with two sides, a smooth one has gaps, and an exact sphere
    needs an ``alpha_m`` larger than its radius. Every triangle is oriented like the normals of its
    corners.

    Args:
        cloud: points with normals.
        alpha_m: radius of the largest ball.

    Raises:
        InputError: fewer than three points, all coincident, no normals, or an alpha that is not positive.
        ReconstructionError: no tetrahedron is small enough.
    """
    _check(cloud, alpha_m, "alpha")
    assert cloud.normals is not None
    try:
        mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_alpha_shape(_open3d_cloud(cloud), alpha_m)
    except RuntimeError:  # from qhull, which has no tetrahedron for points in a plane
        mesh = o3d.geometry.TriangleMesh()
    triangles = np.asarray(mesh.triangles)
    if not len(triangles):
        raise ReconstructionError(
            f"No tetrahedron of the points fits into a ball of {alpha_m:.4g} m; try a larger alpha, and "
            "points that do not lie in one plane"
        )
    # Open3D moves the points a little before it builds the tetrahedra.
    rows = cKDTree(cloud.points_m).query(np.asarray(mesh.vertices))[1][triangles]
    rows = rows[(rows != np.roll(rows, 1, axis=1)).all(axis=1)]
    a_m, b_m, c_m = cloud.points_m[rows].swapaxes(0, 1)
    upright = np.einsum("fi,fi->f", np.cross(b_m - a_m, c_m - a_m), cloud.normals[rows].sum(axis=1))
    rows[upright < 0.0] = rows[upright < 0.0, ::-1]
    used, corners = np.unique(rows, return_inverse=True)
    kept = cloud.select(used)
    return _surface(kept, kept.points_m, corners, len(cloud))


def _check(cloud: PointCloud, length_m: float, name: str) -> None:
    if len(cloud) < 3:
        raise InputError(f"A surface needs at least 3 points, not {len(cloud)}; check the depth image")
    if not np.ptp(cloud.points_m, axis=0).any():
        raise InputError(f"All {len(cloud)} points lie in one place; check the depth image")
    if cloud.normals is None:
        raise InputError("This surface needs normals and the cloud has none; try to estimate them first")
    if not (np.isfinite(length_m) and length_m > 0.0):
        raise InputError(f"The {name} is {length_m} m; try about the distance of neighbouring points")


def _open3d_cloud(cloud: PointCloud) -> o3d.geometry.PointCloud:
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    if cloud.normals is not None:
        points.normals = o3d.utility.Vector3dVector(cloud.normals)
    return points


def _surface(columns: PointCloud, vertices_m: FloatArray, corners: IntArray, points: int) -> SurfaceResult:
    """Build the result; its vertices get the columns of a cloud with as many rows."""
    triangles = corners.reshape(-1, 3).astype(np.int32)
    surface = Surface(vertices_m, triangles, columns.colors, (), columns.normals, columns.source)
    return measured(surface, (), points)
