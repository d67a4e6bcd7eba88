"""Surfaces whose lengths, angles and noise are known."""

import numpy as np

from pipeline.measuring.surface import MeasuredSurface
from tests.pipeline.surface.shapes import grid_mesh

BOX_M = (0.30, 0.20, 0.15)
"""Width, depth and height of the box on the table."""


def sheet(columns, rows, spacing_m, origin_m=(0.0, 0.0, 0.0), x=(1.0, 0.0, 0.0), y=(0.0, 1.0, 0.0)):
    """Vertices, triangles and normals of a flat grid along two directions; the normal is x cross y."""
    flat, triangles = grid_mesh(columns, rows)
    axes = np.array([x, y], float)
    vertices_m = np.asarray(origin_m) + spacing_m * flat[:, :2] @ axes
    return vertices_m, triangles, np.tile(np.cross(*axes), (len(vertices_m), 1))


def joined(*sheets):
    """One mesh of several."""
    firsts = np.cumsum([0, *(len(vertices_m) for vertices_m, _, _ in sheets)])
    triangles = [triangles + first for (_, triangles, _), first in zip(sheets, firsts, strict=False)]
    return (
        np.concatenate([vertices_m for vertices_m, _, _ in sheets]),
        np.concatenate(triangles),
        np.concatenate([normals for _, _, normals in sheets]),
    )


def measured(mesh, sigma_m=0.001, scale_sd=0.0, **other):
    """A mesh as a measured surface whose noise is along its normals; one node unless others are given."""
    vertices_m, triangles, normals = mesh
    count = len(vertices_m)
    values = {
        "guessed": np.zeros(count, bool),
        "nodes": np.zeros(count, int),
        "pose_covariances": np.zeros((1, 6, 6)),
        "rays": -normals,
    } | other
    return MeasuredSurface(
        vertices_m=vertices_m,
        triangles=triangles,
        normals=normals,
        sigma_m=np.full(count, sigma_m),
        scale_sd=scale_sd,
        scale_source="known",
        **values,
    )


def box_on_table(spacing_m=0.01):
    """The five visible faces of a box that stands in the middle of a table, whose top is z = 0."""
    w, d, h = BOX_M
    nw, nd, nh = (round(side_m / spacing_m) for side_m in BOX_M)
    x, y, z, nx, ny = (1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0)
    return joined(
        sheet(90, 80, spacing_m, (-0.3, -0.3, 0.0), x, y),
        sheet(nw, nd, spacing_m, (0, 0, h), x, y),
        sheet(nw, nh, spacing_m, (0, 0, 0), x, z),
        sheet(nw, nh, spacing_m, (w, d, 0), nx, z),
        sheet(nd, nh, spacing_m, (0, d, 0), ny, z),
        sheet(nd, nh, spacing_m, (w, 0, 0), y, z),
    )


TABLE_M = (1.5, 0.9, 0.74)
"""Width, depth and height of the table."""


def table_in_room(*others, floor=True, spacing_m=0.025):
    """A table top without legs in the middle of a room's floor, and level sheets (low corner, sizes in m)."""
    w, d, h = TABLE_M
    levels = [((0.0, 0.0, h), (w, d)), *others, *([((-1.0, -1.0, 0.0), (3.5, 2.9))] if floor else [])]
    return joined(
        *(
            sheet(round(wide_m / spacing_m), round(deep_m / spacing_m), spacing_m, corner_m)
            for corner_m, (wide_m, deep_m) in levels
        )
    )
