"""Quality measures of a mesh: holes, gaps, and agreement with the sensors (SPEC 5)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from pipeline.kernels.geometry import has_ray
from pipeline.kernels.rays import (
    Camera,
    camera_hits,
    depth_of,
    guessed_triangles,
    hit_depths,
    triangle_areas_m2,
    triangle_scene,
)
from pipeline.quality import SurfaceQuality
from pipeline.surface.boundary import connected_parts, edges_and_faces
from pipeline.surface.gaps import gaps_of
from pipeline.surface.holes import open_area_m2
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray, IntArray, Surface, SurfaceResult


@dataclass(frozen=True, slots=True)
class Seen:
    """A mesh as seen by one camera."""

    depth: DepthMap
    """(H, W) depth of the mesh; NaN where a ray misses."""
    guessed: BoolArray | None
    """(R,) True for the camera's pixel rays that hit a triangle most of whose corners were inferred; None if
    sources are unknown."""


def measure_quality(
    vertices_m: FloatArray,
    triangles: IntArray,
    cameras: Sequence[Camera],
    n_input_points: int,
    sensed: Sequence[DepthMap] = (),
    source: ByteArray | None = None,
) -> SurfaceQuality:
    """Compute all measures of a mesh without unused vertices.

    Args:
        vertices_m: (V, 3) vertices.
        triangles: (F, 3) vertex indices.
        cameras: cameras whose pixel rays are traced; without cameras, shares of rays are NaN.
        n_input_points: number of points from which the mesh was made.
        sensed: depth measured by each camera's sensor; without it, shares of measured pixels are NaN.
        source: (V,) source of each vertex; without it, the share of rays on inferred surface is NaN.
    """
    views = list(seen_by(vertices_m, triangles, cameras, source))
    seen = [view.depth for view in views]
    edges, faces = edges_and_faces(triangles)
    parts = connected_parts(edges, len(vertices_m))
    gaps = gaps_of(seen, cameras) if cameras else None
    rim = edges[faces == 1]
    rim_vertices, rim_corners = np.unique(rim, return_inverse=True)
    rim_parts = connected_parts(rim_corners.reshape(-1, 2), len(rim_vertices))
    return SurfaceQuality(
        no_hit_ray_share=missed_share(seen, cameras),
        boundary_loops=len(np.unique(rim_parts)),
        boundary_length_m=float(np.linalg.norm(vertices_m[rim[:, 0]] - vertices_m[rim[:, 1]], axis=1).sum()),
        hole_area_m2=open_area_m2(vertices_m, triangles, parts),
        non_manifold_edges=int((faces > 2).sum()),
        components=len(np.unique(parts)),
        area_m2=float(triangle_areas_m2(vertices_m, triangles).sum()),
        unused_points=n_input_points - len(vertices_m),
        within_2pct_share=kept_share(seen, sensed, 0.02) if sensed else float("nan"),
        within_5pct_share=kept_share(seen, sensed, 0.05) if sensed else float("nan"),
        guessed_ray_share=guessed_share(views),
        gaps=gaps,
    )


def measured(
    surface: Surface, cameras: Sequence[Camera], n_input_points: int, sensed: Sequence[DepthMap] = ()
) -> SurfaceResult:
    """Add all measures to a surface; the arguments are those of ``measure_quality``."""
    quality = measure_quality(
        surface.vertices_m, surface.triangles, cameras, n_input_points, sensed, surface.source
    )
    parts = {part.name: getattr(surface, part.name) for part in fields(Surface)}
    return SurfaceResult(**parts, quality=quality)


def seen_by(
    vertices_m: FloatArray, triangles: IntArray, cameras: Sequence[Camera], source: ByteArray | None
) -> Iterator[Seen]:
    """Yield the view of a mesh in each camera; ``source`` is (V,) of the vertices, or None."""
    scene = triangle_scene(vertices_m, triangles)
    guessed = None if source is None else np.append(guessed_triangles(triangles, source), False)
    for camera in cameras:
        hits = camera_hits(scene, camera)
        triangle = np.minimum(hits["primitive_ids"].numpy(), len(triangles))  # a miss has a larger id
        rays = has_ray(camera.intrinsics)
        yield Seen(depth_of(hits), None if guessed is None else guessed[triangle[rays]])


def no_hit_ray_share(vertices_m: FloatArray, triangles: IntArray, cameras: Sequence[Camera]) -> float:
    """Return the share of all cameras' pixel rays without a surface, 0 to 1; NaN without cameras."""
    return missed_share(list(hit_depths(vertices_m, triangles, cameras)), cameras)


def missed_share(seen: Sequence[DepthMap], cameras: Sequence[Camera]) -> float:
    """Return the share of all cameras' pixel rays without a hit, 0 to 1; NaN without cameras."""
    if not seen:
        return float("nan")
    rays = sum(int(has_ray(camera.intrinsics).sum()) for camera in cameras)
    return 1.0 - sum(int(depth.valid.sum()) for depth in seen) / rays


def guessed_share(views: Sequence[Seen]) -> float:
    """Return the share of all cameras' rays on inferred surface, 0 to 1; NaN if sources are unknown."""
    guessed = [view.guessed for view in views if view.guessed is not None]
    return float(np.mean(np.concatenate(guessed))) if guessed else float("nan")


def kept_share(seen: Sequence[DepthMap], sensed: Sequence[DepthMap], within: float) -> float:
    """Return the share of the measured pixels whose ray hits the mesh near the measurement.

    Args:
        seen: depth of the mesh in each camera.
        sensed: depth measured by each camera's sensor, on the same pixel grid.
        within: largest difference from the measurement, as a share of it.

    Returns:
        A share from 0 to 1; NaN if nothing was measured.
    """
    kept = total = 0
    for mesh, sensor in zip(seen, sensed, strict=True):
        total += int(np.count_nonzero(sensor.valid))
        near = np.abs(mesh.z_m - sensor.z_m) <= within * sensor.z_m  # False if either is NaN
        kept += int(np.count_nonzero(near))
    return kept / total if total else float("nan")
