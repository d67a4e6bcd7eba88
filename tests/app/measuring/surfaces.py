"""Surfaces of known lengths, ready to be measured."""

import numpy as np

from app.compute.measures import Click
from pipeline.measuring.surface import MeasuredSurface

SPACING_M = 0.02
EYE = np.array([0.4, -2.0, 2.5])


def grid(size_m, axes, origin_m):
    """Vertices and triangles of a rectangle, wound so that they face along the cross product of its axes."""
    counts = [round(length_m / SPACING_M) + 1 for length_m in size_m]
    u, v = np.meshgrid(*(np.arange(count) * SPACING_M for count in counts), indexing="ij")
    vertices_m = np.asarray(origin_m) + u.reshape(-1, 1) * axes[0] + v.reshape(-1, 1) * axes[1]
    corner = (np.arange(counts[0] - 1)[:, None] * counts[1] + np.arange(counts[1] - 1)).ravel()
    right, up, both = corner + counts[1], corner + 1, corner + counts[1] + 1
    triangles = np.concatenate([np.stack([corner, right, both], 1), np.stack([corner, both, up], 1)])
    return vertices_m, triangles, np.tile(np.cross(*axes), (len(vertices_m), 1))


def steps(sigma_m=0.001, scale_sd=0.0, guessed=False):
    """A floor of 2 m, a table top of 0.8 m at 0.5 m, and a wall at the table's far end."""
    x, y, z = np.eye(3)
    parts = [
        grid((2.0, 2.0), (x, y), (-0.6, -0.6, 0.0)),
        grid((0.8, 0.8), (x, y), (0.0, 0.0, 0.5)),
        grid((0.8, 0.8), (x, z), (0.0, 1.0, 0.5)),
    ]
    starts = np.cumsum([0, *(len(part[0]) for part in parts)])
    vertices_m = np.concatenate([part[0] for part in parts])
    count = len(vertices_m)
    rays = vertices_m - EYE
    normals = np.concatenate([part[2] for part in parts])
    return MeasuredSurface(
        vertices_m,
        np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=False)]),
        normals,
        np.full(count, sigma_m),
        rays / np.linalg.norm(rays, axis=1, keepdims=True),
        np.full(count, guessed),
        np.zeros(count, int),
        np.zeros((1, 6, 6)),
        scale_sd,
        "The scale is the test's",
    )


def towards(*point_m):
    """A click at a point, as the eye sees it."""
    x, y, z = (np.array(point_m) - EYE).tolist()
    return Click(tuple(EYE.tolist()), (x, y, z))
