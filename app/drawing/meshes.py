"""Surfaces as binary glTF for the browser."""

from __future__ import annotations

import io
from functools import lru_cache

import numpy as np
from PIL import Image

from app.compute.records import MeshView
from app.drawing.colors import LOSS, NEUTRAL
from app.drawing.glb import lines_glb, mesh_glb, textured_glb
from pipeline.io.textures import Texture
from pipeline.surface.boundary import boundary_loops, loop_edges
from pipeline.types import ByteArray, FloatArray, PointSource, Surface, SurfaceResult

DARKEST = {True: 0.75, False: 0.45}
"""Least brightness, by whether the colours are a camera's: photographs already contain shadows."""

WEBP_QUALITY, WEBP_EFFORT = 85, 2
"""Quality of photographs, 0 to 100; effort 2 of 6 takes half the time of the usual 4 for 3 % more bytes."""

VIOLET = (0.72, 0.5, 1.0)
"""Factor on a photograph's RGB where the surface was inferred."""


def mesh_view(
    surface: SurfaceResult, truth: dict[str, float] | None, texture: Texture | None = None
) -> MeshView:
    """Return a surface with the rims of its holes for the browser, with photographs if it has a texture.

    ``truth`` is its comparison with the true surface; None without one.
    """
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
    """Return the mesh with lit (V, 3) vertex colours as binary glTF; empty if it has no triangle.

    Args:
        surface: the surface; grey without colours.
        colors: sRGB colours.
        photographed: whether the colours are a camera's, which already contain light and shadow.
    """
    if not len(surface.triangles):
        return b""
    return mesh_glb(surface.vertices_m, surface.triangles, _lit(surface, colors, photographed))


def photographed_glb(surface: Surface, texture: Texture, tinted: bool = False) -> bytes:
    """Return the mesh with its cameras' photographs, and the points' colours where no camera sees it.

    Args:
        surface: the surface whose texture it is.
        texture: the photographs.
        tinted: whether inferred parts are violet.
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
        places_m,
        corners.triangles,
        colors.astype(np.uint8),
        corners.uv,
        _picture_of(texture.image),
        max(texture.image.shape[:2]),
    )


def _picture_of(rgb: ByteArray) -> bytes:
    """Return (H, W, 3) photographs as a WebP file, which takes three fifths of a JPEG's bytes."""
    return _encoded(rgb.tobytes(), rgb.shape)


@lru_cache(maxsize=2)
def _encoded(data: bytes, shape: tuple[int, ...]) -> bytes:
    """Encode an image; the surfaces of a scene have the same one."""
    stream = io.BytesIO()
    Image.fromarray(np.frombuffer(data, np.uint8).reshape(shape)).save(
        stream, "WEBP", quality=WEBP_QUALITY, method=WEBP_EFFORT
    )
    return stream.getvalue()


def _lit(surface: Surface, colors: ByteArray | None, photographed: bool) -> ByteArray:
    """Return (V, 3) vertex colours with diffuse shading; grey without colours."""
    if colors is None:
        colors, photographed = np.tile(np.array(NEUTRAL, np.uint8), (len(surface.vertices_m), 1)), False
    normals = vertex_normals(surface)
    light = normals.mean(axis=0)  # the mean normal points towards the cameras
    light[2] += 0.4  # some light from above
    light /= max(float(np.linalg.norm(light)), 1e-9)
    darkest = DARKEST[photographed]
    shade = darkest + (1.0 - darkest) * np.clip(0.5 + 0.5 * (normals @ light), 0.0, 1.0)
    return (colors * shade[:, None]).astype(np.uint8)


def vertex_normals(surface: Surface) -> FloatArray:
    """Return (V, 3) the points' normals or, if there are none, means of the triangles' normals by area."""
    if surface.normals is not None:
        return surface.normals
    a, b, c = surface.vertices_m[surface.triangles].swapaxes(0, 1)
    normals = np.zeros_like(surface.vertices_m)
    for corner in range(3):
        np.add.at(normals, surface.triangles[:, corner], np.cross(b - a, c - a))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def rim_segments_m(surface: Surface) -> FloatArray:
    """Return (E, 2, 3) float32: the edges that belong to one triangle only, loop by loop."""
    loops = boundary_loops(surface.triangles)
    if not loops:
        return np.empty((0, 2, 3), np.float32)
    return surface.vertices_m[loop_edges(loops)[0]].astype(np.float32)
