"""A coarse copy of a mesh, a sixth of its bytes; a page on a slow line shows it until the mesh is there."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image

from app.drawing.glb import LINEAR, Parts, Places, in_this_order
from app.drawing.ordering import curve_order, lowest_first
from pipeline.types import ByteArray

CELLS = 40
"""Cells along the longest side of the box; all vertices in one become one."""
STEPS = 8
"""Steps of a position in a cell."""


def coarse_glb(glb: Any) -> bytes:
    """Return a mesh that ``glb.py`` wrote with few vertices; they take the colours of its picture.

    Each cell's vertex is its first one, moved by at most half of a ``STEPS``-th of the cell in each
    coordinate; triangles within fewer than three cells vanish (Rossignac and Borrel 1993). A mesh of which
    no triangle would be left is returned as it is.
    """
    parts = Parts.of(glb)
    attributes = parts.primitive["attributes"]
    places = parts.array(attributes["POSITION"]).astype(np.float64)
    low = places.min(axis=0)
    cell_side = max(float(np.ptp(places, axis=0).max()), 1e-12) / CELLS
    cells = np.floor((places - low) / cell_side).astype(np.int64)
    _, first, cell = np.unique(cells @ (CELLS + 1) ** np.arange(3), return_index=True, return_inverse=True)
    corners = cell.reshape(-1)[parts.triangles]
    whole = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    if not len(whole):  # a far vertex leaves too few cells for the others
        return bytes(glb)
    order = curve_order(places[first])
    faces = np.unique(lowest_first(np.argsort(order)[whole]), axis=0)
    node = parts.head["nodes"][0]
    scale_m, origin_m = node.get("scale", [1.0])[0], np.array(node.get("translation", [0.0] * 3))
    steps = np.zeros((len(order), 4), "<u2")
    steps[:, :3] = np.rint((places[first[order]] - low) * (STEPS / cell_side))
    coarse = Places(steps, (origin_m + scale_m * low).tolist(), scale_m * cell_side / STEPS)
    return in_this_order(coarse, faces, _colors(parts)[first[order]])


def is_mesh(data: object) -> bool:
    """Whether something is a mesh that ``glb.py`` wrote."""
    if not isinstance(data, bytes) or not data.startswith(b"glTF"):
        return False
    parts = Parts.of(data)
    return parts.is_own and parts.triangles is not None


def _colors(parts: Parts) -> ByteArray:
    """Return (V, 3) sRGB: the vertex colours, times the picture's if there is one."""
    attributes = parts.primitive["attributes"]
    linear = parts.array(attributes["COLOR_0"])[:, :3] / 65535.0
    if "images" in parts.head:
        file = io.BytesIO(parts.data(parts.head["images"][0]["bufferView"]))
        picture = np.asarray(Image.open(file).convert("RGB"))
        size_px = np.array([picture.shape[1], picture.shape[0]])
        uv = parts.array(attributes["TEXCOORD_0"]) / 65535.0
        column, row = np.minimum(uv * size_px, size_px - 1).astype(int).T
        linear = linear * (LINEAR[picture[row, column]] / 65535.0)
    return np.searchsorted(LINEAR, 65535.0 * linear - 0.5).clip(0, 255).astype(np.uint8)
