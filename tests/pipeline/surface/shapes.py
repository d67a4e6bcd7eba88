"""Clouds and meshes whose surface is known."""

import numpy as np

from pipeline.types import PointCloud


def sphere(count: int, radius_m: float = 1.0) -> PointCloud:
    """Fibonacci points with their outward normals: evenly spread, no two alike."""
    index = np.arange(count) + 0.5
    polar = np.arccos(1 - 2 * index / count)
    azimuth = np.pi * (1 + np.sqrt(5)) * index
    normals = np.stack(
        [np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)], axis=1
    )
    return PointCloud(radius_m * normals, normals=normals)


def perforated_plane(side_m: float, spacing_m: float, hole_radius_m: float) -> PointCloud:
    """A square grid in z = 0 without the points of a central disc.

    Points are moved at random by up to a twentieth of the spacing: on an exact grid four points lie on
    one ball, and which triangles it leaves out is chance.
    """
    axis = np.arange(0.0, side_m + spacing_m / 2, spacing_m) - side_m / 2
    xy = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    xy += np.random.default_rng(0).uniform(-0.05, 0.05, xy.shape) * spacing_m
    xy = xy[np.linalg.norm(xy, axis=1) > hole_radius_m]
    flat = np.zeros(len(xy))
    return PointCloud(
        np.column_stack([xy, flat]),
        colors=np.column_stack([np.arange(len(xy)) % 256, np.arange(len(xy)) // 256, flat]).astype(np.uint8),
        normals=np.column_stack([flat, flat, flat + 1.0]),
    )


def rectangle(x_m: tuple[float, float], y_m: tuple[float, float], z_m: float = 0.0):
    """Vertices and the two triangles, counter-clockwise from above, of a rectangle parallel to z = 0."""
    corners = [(x_m[0], y_m[0]), (x_m[1], y_m[0]), (x_m[1], y_m[1]), (x_m[0], y_m[1])]
    return np.array([(x, y, z_m) for x, y in corners]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def grid_mesh(columns: int, rows: int, missing: frozenset[tuple[int, int]] = frozenset()):
    """Unit squares in z = 0 as triangle pairs, counter-clockwise from above, without the missing squares."""
    vertices_m = np.array([(x, y, 0.0) for y in range(rows + 1) for x in range(columns + 1)])
    triangles = []
    for y in range(rows):
        for x in range(columns):
            if (x, y) not in missing:
                a, b = y * (columns + 1) + x, (y + 1) * (columns + 1) + x
                triangles += [[a, a + 1, b + 1], [a, b + 1, b]]
    return vertices_m, np.array(triangles, np.int32)
