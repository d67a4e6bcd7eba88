"""Small pictures of results."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.kernels.geometry import apply, inverse, project, scaled
from pipeline.kernels.rays import Camera
from pipeline.notebook.views import in_its_camera, view_of
from pipeline.surface.pictures import MISSED, mesh_picture
from pipeline.types import ByteArray, PointCloud, RgbdFrame, Surface

WIDTH_PX, HEIGHT_PX = 280, 210
EMPTY = 255
"""Grey level of the background."""
INK = (70, 90, 120)
"""RGB of points without colours."""
DRAWN_POINTS = 60_000


def cloud_picture(cloud: PointCloud) -> ByteArray:
    """Return (H, W, 3) RGB of a cloud of at least one point, each a small square, the nearest on top."""
    every = max(1, len(cloud) // DRAWN_POINTS)
    points_m = cloud.points_m[::every]
    normals = None if cloud.normals is None else cloud.normals[::every]
    camera = view_of(points_m, normals, in_its_camera(cloud)).camera(WIDTH_PX, HEIGHT_PX)
    own_m = apply(inverse(camera.T_world_camera), points_m)
    rgb = np.full((HEIGHT_PX, WIDTH_PX, 3), EMPTY, np.uint8)
    seen = np.flatnonzero(own_m[:, 2] > 0.0)
    far_first = seen[np.argsort(-own_m[seen, 2], kind="stable")]
    colors = np.tile(np.array(INK, np.uint8), (len(points_m), 1))
    if cloud.colors is not None:
        colors = cloud.colors[::every]
    u, v = np.rint(project(camera.intrinsics, own_m[far_first])).astype(int).T
    for down, right in ((1, 1), (1, 0), (0, 1), (0, 0)):
        inside = (u + right >= 0) & (u + right < WIDTH_PX) & (v + down >= 0) & (v + down < HEIGHT_PX)
        rgb[v[inside] + down, u[inside] + right] = colors[far_first[inside]]
    return rgb


def surface_picture(surface: Surface) -> ByteArray:
    """Return (H, W, 3) RGB of a surface of at least one triangle."""
    corners = np.unique(surface.triangles)
    normals = None if surface.normals is None else surface.normals[corners]
    camera = view_of(surface.vertices_m[corners], normals).camera(WIDTH_PX, HEIGHT_PX)
    rgb = mesh_picture(surface, camera)
    rgb[(rgb == MISSED).all(axis=-1)] = EMPTY
    return rgb


def seen_picture(surface: Surface, frame: RgbdFrame, T_world_camera: np.ndarray) -> ByteArray:
    """Return (H, W, 3) RGB of a surface from a node's pose; rays without a surface are magenta."""
    intrinsics = scaled(frame.intrinsics, WIDTH_PX / frame.intrinsics.width_px)
    return mesh_picture(surface, Camera(intrinsics, T_world_camera))


def small_photograph(frame: RgbdFrame) -> ByteArray:
    """Return (H, W, 3) RGB of a node's colour image, ``WIDTH_PX`` wide."""
    rows, columns = frame.rgb.shape[:2]
    size = (WIDTH_PX, max(1, round(rows * WIDTH_PX / columns)))
    return np.asarray(cv2.resize(frame.rgb, size, interpolation=cv2.INTER_AREA), np.uint8)


def png_of(rgb: ByteArray) -> bytes:
    """Encode (H, W, 3) RGB as a PNG file."""
    return cv2.imencode(".png", rgb[..., ::-1])[1].tobytes()
