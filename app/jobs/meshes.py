"""Surfaces as the bytes that a browser draws."""

from __future__ import annotations

import numpy as np
import trimesh
from trimesh.visual.color import ColorVisuals

from app.jobs.records import MeshView
from pipeline.types import ByteArray, FloatArray, SurfaceResult


def mesh_view(surface: SurfaceResult, truth: dict[str, float] | None) -> MeshView:
    """A surface with the rims of its holes, ready to be sent."""
    return MeshView(
        glb=glb_bytes(surface, surface.colors),
        quality=surface.quality,
        rims_m=rim_segments_m(surface),
        vertices=len(surface.vertices_m),
        triangles=len(surface.triangles),
        truth=truth,
    )


def glb_bytes(surface: SurfaceResult, colors: ByteArray | None) -> bytes:
    """The mesh with (V, 3) vertex colours as binary glTF; empty if it has no triangle.

    Without normals in it the browser would shade every triangle flat.
    """
    if not len(surface.triangles):
        return b""
    mesh = trimesh.Trimesh(
        surface.vertices_m, surface.triangles, vertex_normals=surface.normals, process=False
    )
    if colors is not None:
        mesh.visual = ColorVisuals(mesh, vertex_colors=colors)
    return mesh.export(file_type="glb", include_normals=True)


def rim_segments_m(surface: SurfaceResult) -> FloatArray:
    """(E, 2, 3) float32: the edges that have one triangle only."""
    edges = np.sort(surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64), axis=1)
    keys, triangles = np.unique(edges[:, 0] << 32 | edges[:, 1], return_counts=True)
    rims = keys[triangles == 1]
    ends = np.stack([rims >> 32, rims & 0xFFFFFFFF], axis=1)
    return surface.vertices_m[ends].astype(np.float32)
