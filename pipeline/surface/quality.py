"""How good a mesh is: holes first (SPEC 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from pipeline.rays import Camera, hit_depths, triangle_areas_m2
from pipeline.surface.boundary import connected_parts, edges_and_faces
from pipeline.surface.holes import open_area_m2
from pipeline.types import DepthMap, FloatArray, IntArray, Surface, SurfaceQuality, SurfaceResult

KEPT_WITHIN = 0.02
"""Relative distance from its measurement within which a surface has kept it."""


def measure_quality(
    vertices_m: FloatArray,
    triangles: IntArray,
    cameras: Sequence[Camera],
    n_input_points: int,
    sensed: Sequence[DepthMap] = (),
) -> SurfaceQuality:
    """All measures of a mesh that has no unused vertex.

    Args:
        vertices_m: (V, 3).
        triangles: (F, 3).
        cameras: whose pixel rays look for the surface; without any, shares of rays are NaN.
        n_input_points: points the mesh was made from.
        sensed: what each camera's sensor has measured; without it, the share that is kept is NaN.
    """
    seen = list(hit_depths(vertices_m, triangles, cameras))
    edges, faces = edges_and_faces(triangles)
    rim = edges[faces == 1]
    rim_vertices, rim_corners = np.unique(rim, return_inverse=True)
    rim_parts = connected_parts(rim_corners.reshape(-1, 2), len(rim_vertices))
    return SurfaceQuality(
        no_hit_ray_share=missed_share(seen),
        boundary_loops=len(np.unique(rim_parts)),
        boundary_length_m=float(np.linalg.norm(vertices_m[rim[:, 0]] - vertices_m[rim[:, 1]], axis=1).sum()),
        hole_area_m2=open_area_m2(vertices_m, triangles),
        non_manifold_edges=int((faces > 2).sum()),
        components=len(np.unique(connected_parts(edges, len(vertices_m)))),
        area_m2=float(triangle_areas_m2(vertices_m, triangles).sum()),
        unused_points=n_input_points - len(vertices_m),
        kept_measurement_share=kept_share(seen, sensed) if sensed else float("nan"),
    )


def measured(
    surface: Surface, cameras: Sequence[Camera], n_input_points: int, sensed: Sequence[DepthMap] = ()
) -> SurfaceResult:
    """A surface with all its measures; the arguments are those of ``measure_quality``."""
    quality = measure_quality(surface.vertices_m, surface.triangles, cameras, n_input_points, sensed)
    parts = {part.name: getattr(surface, part.name) for part in fields(Surface)}
    return SurfaceResult(**parts, quality=quality)


def no_hit_ray_share(vertices_m: FloatArray, triangles: IntArray, cameras: Sequence[Camera]) -> float:
    """Share of all cameras' pixel rays that miss the mesh, 0 to 1; NaN without cameras."""
    return missed_share(list(hit_depths(vertices_m, triangles, cameras)))


def missed_share(seen: Sequence[DepthMap]) -> float:
    """Share of the pixels of all cameras without a hit, 0 to 1; NaN without cameras."""
    if not seen:
        return float("nan")
    return 1.0 - sum(int(depth.valid.sum()) for depth in seen) / sum(depth.z_m.size for depth in seen)


def kept_share(seen: Sequence[DepthMap], sensed: Sequence[DepthMap]) -> float:
    """Share of the measured pixels whose ray meets the mesh within ``KEPT_WITHIN`` of the measurement.

    Args:
        seen: depth of the mesh in each camera.
        sensed: what that camera's sensor has measured, on the same pixel grid.

    Returns:
        A share from 0 to 1; NaN where nothing was measured.
    """
    kept = total = 0
    for mesh, sensor in zip(seen, sensed, strict=True):
        measured_m = sensor.z_m[sensor.valid]
        total += len(measured_m)
        kept += int(np.sum(np.abs(mesh.z_m[sensor.valid] - measured_m) <= KEPT_WITHIN * measured_m))
    return kept / total if total else float("nan")
