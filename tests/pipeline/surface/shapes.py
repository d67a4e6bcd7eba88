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


def lidar_room(rings: int, noise_m: float = 0.0, seed: int = 0) -> PointCloud:
    """A room of 9 x 7 x 2.7 m as a spinning LiDAR in it sees it, with the walls' normals into the room.

    From 25° below to 15° above the horizon, a point every 0.2° along each ring.
    """
    up, around = np.meshgrid(
        np.radians(np.linspace(-25.0, 15.0, rings)), np.radians(np.arange(0.05, 360.0, 0.2)), indexing="ij"
    )
    ways = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    ways = ways.reshape(-1, 3)
    walls_m = np.where(ways > 0.0, [5.0, 4.0, 1.5], [-4.0, -3.0, -1.2]) / ways
    wall = walls_m.argmin(axis=1)
    off_m = np.random.default_rng(seed).normal(0.0, noise_m, len(ways)) if noise_m else 0.0
    normals = -np.sign(np.take_along_axis(ways, wall[:, None], axis=1)) * np.eye(3)[wall]
    return PointCloud(ways * (walls_m.min(axis=1) + off_m)[:, None], normals=normals)


def torus_knot(count: int, tube_m: float, noise_m: float = 0.0, seed: int = 0) -> PointCloud:
    """Random points of a tube along the (2, 3) torus knot, with their outward normals."""
    rng = np.random.default_rng(seed)

    def middle_m(t):
        r_m = 2.0 + np.cos(3.0 * t)
        return np.stack([r_m * np.cos(2.0 * t), r_m * np.sin(2.0 * t), -np.sin(3.0 * t)], axis=1)

    t = rng.uniform(0.0, 2.0 * np.pi, 4 * count)
    along = (middle_m(t + 1e-4) - middle_m(t - 1e-4)) / 2e-4
    speed = np.linalg.norm(along, axis=1)
    kept = np.flatnonzero(rng.uniform(0.0, speed.max(), len(t)) < speed)[:count]  # evenly along the knot
    t, along = t[kept], along[kept] / speed[kept, None]
    side = np.cross(along, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    turn = rng.uniform(0.0, 2.0 * np.pi, (len(t), 1))
    normals = np.cos(turn) * side + np.sin(turn) * np.cross(along, side)
    off_m = rng.normal(0.0, noise_m, (len(t), 3)) if noise_m else 0.0
    return PointCloud(middle_m(t) + tube_m * normals + off_m, normals=normals)


def with_outliers(cloud: PointCloud, share: float, seed: int = 0) -> PointCloud:
    """The points, without normals, and after them so many more anywhere in a box three times as large."""
    low_m, high_m = cloud.points_m.min(axis=0), cloud.points_m.max(axis=0)
    size_m = high_m - low_m
    places_m = np.random.default_rng(seed).uniform(
        low_m - size_m, high_m + size_m, (round(share * len(cloud)), 3)
    )
    return PointCloud(np.vstack([cloud.points_m, places_m]))
