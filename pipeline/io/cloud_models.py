"""Reader of the vertices of OBJ, STL and GLB models as points."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np
import trimesh

from packetmesh.errors import InputError
from pipeline.io.cloud_table import COLOR, POSITION, check_count
from pipeline.io.meshes import scene_in
from pipeline.types import AnyPath


def parse_model(path: AnyPath, data: bytes) -> np.ndarray:
    """Read each vertex of every part once, Z up, with its colour if all parts have colours.

    Raises:
        InputError: the file is damaged, or has no vertices.
    """
    suffix = PurePath(path).suffix.lower()
    try:
        parts = scene_in(data, suffix).dump()
        points = np.concatenate([np.asarray(part.vertices, np.float64).reshape(-1, 3) for part in parts])
        colors = [_colors(part) for part in parts]
    except Exception:  # a parser fails on damaged data in more ways than can be listed
        raise InputError(
            f"The point cloud {path} is truncated or damaged, or has no vertices; try to export it again"
        ) from None
    check_count(path, len(points))
    known = [rows for rows in colors if rows is not None]
    colored = len(known) == len(parts)
    table = np.empty(len(points), [(n, "f8") for n in POSITION] + [(n, "u1") for n in COLOR if colored])
    for name, column in zip(POSITION, points.T, strict=True):
        table[name] = column
    if colored:
        for name, column in zip(COLOR, np.concatenate(known).T, strict=True):
            table[name] = column
    return table


def _colors(part: trimesh.Trimesh | trimesh.PointCloud) -> np.ndarray | None:
    """Return (V, 3) uint8 colours of a part; None if its vertices have none."""
    if isinstance(part, trimesh.PointCloud):
        rgba = np.asarray(part.colors)
        return rgba[:, :3].astype(np.uint8) if rgba.shape == (len(part.vertices), 4) else None
    return np.asarray(part.visual.vertex_colors)[:, :3] if part.visual.kind == "vertex" else None
