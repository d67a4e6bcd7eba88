"""Surfaces as the bytes that a browser draws."""

from __future__ import annotations

import numpy as np

from app.compute.records import MeshView
from app.drawing.colors import LOSS, NEUTRAL
from app.drawing.glb import lines_glb, mesh_glb, textured_glb
from pipeline.io.images import jpeg_of
from pipeline.types import ByteArray, FloatArray, PointSource, Surface, SurfaceResult, Texture

DARKEST = {True: 0.75, False: 0.45}
"""How dark a surface gets that turns from the light: the camera's own colours have shadows already."""

VIOLET = (0.72, 0.5, 1.0)
"""What a photograph is multiplied with where the surface was inferred."""


def mesh_view(
    surface: SurfaceResult, truth: dict[str, float] | None, texture: Texture | None = None
) -> MeshView:
    """A surface with the rims of its holes, ready to be sent; in photographs if there is a texture."""
    glb = surface_glb(surface, surface.colors, photographed=True)
    return MeshView(
        glb=glb if texture is None else photographed_glb(surface, texture),
        quality=surface.quality,
        rims_glb=lines_glb(rim_segments_m(surface), LOSS),
        vertices=len(surface.vertices_m),
        triangles=len(surface.triangles),
        truth=truth,
    )


def surface_glb(surface: Surface, colors: ByteArray | None, photographed: bool) -> bytes:
    """The mesh with (V, 3) vertex colours and light on it, as binary glTF; empty if it has no triangle.

    Args:
        surface: grey without colours.
        colors: sRGB.
        photographed: whether the colours are a camera's, which have light and shadow in them.
    """
    if not len(surface.triangles):
        return b""
    return mesh_glb(surface.vertices_m, surface.triangles, _lit(surface, colors, photographed))


def photographed_glb(surface: Surface, texture: Texture, tinted: bool = False) -> bytes:
    """The mesh in its cameras' photographs and, where none sees it, in the colours of its points.

    Args:
        surface: as it was dressed.
        texture: its photographs.
        tinted: whether what was inferred is violet.
    """
    if not len(surface.triangles):
        return b""
    corners = texture.corners(surface.triangles)
    lit = _lit(surface, surface.colors, photographed=True)[corners.vertices]
    colors = np.where(corners.seen[:, None], 255, lit)
    if tinted and surface.source is not None:
        guessed = surface.source[corners.vertices] == PointSource.INFERRED
        colors[guessed] = colors[guessed] * VIOLET
    places_m = surface.vertices_m[corners.vertices]
    return textured_glb(
        places_m, corners.triangles, colors.astype(np.uint8), corners.uv, jpeg_of(texture.image)
    )


def _lit(surface: Surface, colors: ByteArray | None, photographed: bool) -> ByteArray:
    """(V, 3) colours with light on them."""
    if colors is None:
        colors, photographed = np.tile(np.array(NEUTRAL, np.uint8), (len(surface.vertices_m), 1)), False
    normals = vertex_normals(surface)
    light = normals.mean(axis=0)  # from where the cameras stand
    light[2] += 0.4  # and from above
    light /= max(float(np.linalg.norm(light)), 1e-9)
    darkest = DARKEST[photographed]
    shade = darkest + (1.0 - darkest) * np.clip(0.5 + 0.5 * (normals @ light), 0.0, 1.0)
    return (colors * shade[:, None]).astype(np.uint8)


def vertex_normals(surface: Surface) -> FloatArray:
    """(V, 3) those of the points or, where a surface has none, of the triangles around each vertex."""
    if surface.normals is not None:
        return surface.normals
    a, b, c = surface.vertices_m[surface.triangles].swapaxes(0, 1)
    normals = np.zeros_like(surface.vertices_m)
    for corner in range(3):
        np.add.at(normals, surface.triangles[:, corner], np.cross(b - a, c - a))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def rim_segments_m(surface: Surface) -> FloatArray:
    """(E, 2, 3) float32: the edges that have one triangle only."""
    edges = np.sort(surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64), axis=1)
    keys, triangles = np.unique(edges[:, 0] << 32 | edges[:, 1], return_counts=True)
    rims = keys[triangles == 1]
    ends = np.stack([rims >> 32, rims & 0xFFFFFFFF], axis=1)
    return surface.vertices_m[ends].astype(np.float32)
