"""How good a mesh is: holes first (SPEC 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from pipeline.rays import Camera, hit_depths, triangle_areas_m2
from pipeline.surface.boundary import connected_parts, edges_and_faces
from pipeline.surface.holes import open_area_m2
from pipeline.types import FloatArray, IntArray, Surface, SurfaceQuality, SurfaceResult


def measure_quality(
    vertices_m: FloatArray, triangles: IntArray, cameras: Sequence[Camera], n_input_points: int
) -> SurfaceQuality:
    """All measures of a mesh that has no unused vertex.

    Args:
        vertices_m: (V, 3).
        triangles: (F, 3).
        cameras: whose pixel rays look for the surface; without any, their share is NaN.
        n_input_points: points the mesh was made from.
    """
    edges, faces = edges_and_faces(triangles)
    rim = edges[faces == 1]
    rim_vertices, rim_corners = np.unique(rim, return_inverse=True)
    rim_parts = connected_parts(rim_corners.reshape(-1, 2), len(rim_vertices))
    return SurfaceQuality(
        no_hit_ray_share=no_hit_ray_share(vertices_m, triangles, cameras),
        boundary_loops=len(np.unique(rim_parts)),
        boundary_length_m=float(np.linalg.norm(vertices_m[rim[:, 0]] - vertices_m[rim[:, 1]], axis=1).sum()),
        hole_area_m2=open_area_m2(vertices_m, triangles),
        non_manifold_edges=int((faces > 2).sum()),
        components=len(np.unique(connected_parts(edges, len(vertices_m)))),
        area_m2=float(triangle_areas_m2(vertices_m, triangles).sum()),
        unused_points=n_input_points - len(vertices_m),
    )


def measured(surface: Surface, cameras: Sequence[Camera], n_input_points: int) -> SurfaceResult:
    """A surface with all its measures; the arguments are those of ``measure_quality``."""
    quality = measure_quality(surface.vertices_m, surface.triangles, cameras, n_input_points)
    parts = {part.name: getattr(surface, part.name) for part in fields(Surface)}
    return SurfaceResult(**parts, quality=quality)


def no_hit_ray_share(vertices_m: FloatArray, triangles: IntArray, cameras: Sequence[Camera]) -> float:
    """Share of all cameras' pixel rays that miss the mesh, 0 to 1; NaN without cameras."""
    if not cameras:
        return float("nan")
    hits = [depth.valid for depth in hit_depths(vertices_m, triangles, cameras)]
    return 1.0 - sum(int(hit.sum()) for hit in hits) / sum(hit.size for hit in hits)
