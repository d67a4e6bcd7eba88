"""Pictures of meshes by ray casting, made without a display."""

from __future__ import annotations

import numpy as np

from pipeline.geometry import pixel_rays
from pipeline.rays import Camera, camera_hits, triangle_scene
from pipeline.types import ByteArray, Surface

MISSED = (255, 0, 255)
"""Magenta: a ray that hits nothing."""


def mesh_picture(surface: Surface, camera: Camera, colored: bool = True) -> ByteArray:
    """(H, W, 3) picture of a mesh from a camera; rays that hit nothing show ``MISSED``.

    Args:
        surface: what is seen.
        camera: from where.
        colored: use the vertex colours; without, a grey surface whose shading shows its shape.
    """
    hits = camera_hits(triangle_scene(surface.vertices_m, surface.triangles), camera)
    hit = np.isfinite(hits["t_hit"].numpy())
    triangle = surface.triangles[hits["primitive_ids"].numpy()[hit].astype(np.int64)]
    u, v = np.moveaxis(hits["primitive_uvs"].numpy()[hit], -1, 0)[..., None]
    normals = hits["primitive_normals"].numpy()[hit]
    view = pixel_rays(camera.intrinsics)[hit] @ camera.T_world_camera[:3, :3].T
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    light = 0.35 + 0.65 * np.abs(np.sum(normals * view, axis=1, keepdims=True))
    if colored and surface.colors is not None:
        corner = surface.colors[triangle].astype(np.float64)
        albedo = (1 - u - v) * corner[:, 0] + u * corner[:, 1] + v * corner[:, 2]
        light = 0.6 + 0.4 * light
    else:
        albedo = np.full((len(triangle), 3), 225.0)
    rgb = np.empty((*hit.shape, 3), np.uint8)
    rgb[:] = MISSED
    rgb[hit] = np.clip(albedo * light, 0, 255).astype(np.uint8)
    return rgb
