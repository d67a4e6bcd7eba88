"""Images of meshes by ray casting, without a display."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.io.textures import Texture
from pipeline.kernels.geometry import pixel_rays, rigid
from pipeline.kernels.rays import Camera, camera_hits, triangle_scene
from pipeline.types import ByteArray, Surface

MISSED = (255, 0, 255)
"""Magenta: a ray that hits nothing."""


def beside(camera: Camera, surface: Surface, angle_deg: float = 20.0) -> Camera:
    """Return the camera rotated about the vertical (the world's z) through the middle of the surface."""
    if not len(surface.vertices_m):
        return camera
    middle_m = np.median(surface.vertices_m, axis=0)
    turn = Rotation.from_rotvec([0.0, 0.0, np.deg2rad(angle_deg)]).as_matrix()
    T_around = rigid(turn, middle_m - turn @ middle_m)
    return Camera(camera.intrinsics, T_around @ camera.T_world_camera)


def mesh_picture(
    surface: Surface, camera: Camera, colored: bool = True, texture: Texture | None = None
) -> ByteArray:
    """Render a mesh once, as ``MeshPainter.picture`` does."""
    return MeshPainter(surface).picture(camera, colored, texture)


class MeshPainter:
    """Renders one mesh several times: its search tree is built once, and a camera's rays are cast once."""

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._scene = triangle_scene(surface.vertices_m, surface.triangles)
        self._camera: Camera | None = None
        self._hits: dict[str, np.ndarray] = {}

    def picture(self, camera: Camera, colored: bool = True, texture: Texture | None = None) -> ByteArray:
        """Return an (H, W, 3) image from a camera; rays that hit nothing show ``MISSED``.

        Args:
            camera: camera of the image.
            colored: True uses the vertex colours if there are any, False a shaded grey surface.
            texture: photographs to show on the surface instead of its colours, unshaded.
        """
        if camera is not self._camera:
            self._hits = {name: hits.numpy() for name, hits in camera_hits(self._scene, camera).items()}
            self._camera = camera
        surface, hits = self._surface, self._hits
        hit = np.isfinite(hits["t_hit"])
        triangle = surface.triangles[hits["primitive_ids"][hit].astype(np.int64)]
        u, v = np.moveaxis(hits["primitive_uvs"][hit], -1, 0)[..., None]
        normals = hits["primitive_normals"][hit]
        view = pixel_rays(camera.intrinsics)[hit] @ camera.T_world_camera[:3, :3].T
        view /= np.linalg.norm(view, axis=1, keepdims=True)
        light = 0.35 + 0.65 * np.abs(np.sum(normals * view, axis=1, keepdims=True))
        if colored and surface.colors is not None:
            corner = surface.colors[triangle].astype(np.float64)
            albedo = (1 - u - v) * corner[:, 0] + u * corner[:, 1] + v * corner[:, 2]
            light = 0.6 + 0.4 * light
        else:
            albedo = np.full((len(triangle), 3), 225.0)
        shaded = np.clip(albedo * light, 0, 255).astype(np.uint8)
        if texture is not None:
            whose = texture.camera[hits["primitive_ids"][hit].astype(np.int64)]
            worn = whose >= 0
            corner = texture.uv[whose[worn, None], triangle[worn]]
            place = (1 - u - v)[worn] * corner[:, 0] + u[worn] * corner[:, 1] + v[worn] * corner[:, 2]
            height_px, width_px = texture.image.shape[:2]
            column, row = np.clip(place * (width_px, height_px) - 0.5, 0, (width_px - 1, height_px - 1)).T
            shaded[worn] = texture.image[np.rint(row).astype(int), np.rint(column).astype(int)]
        rgb = np.empty((*hit.shape, 3), np.uint8)
        rgb[:] = MISSED
        rgb[hit] = shaded
        return rgb
