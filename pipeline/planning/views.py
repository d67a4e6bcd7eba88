"""Views of the present cameras: measured surface, guesses, nothing, and what is dark to the sensor."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import cv2
import numpy as np

from pipeline.kernels.geometry import apply, has_ray, inverse, pixel_rays, project
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import Camera, camera_hits
from pipeline.nodes import NodeClouds
from pipeline.planning.sensors import SENSORS
from pipeline.types import BoolArray, FloatArray, IntArray

KINECT_BASELINE_M = SENSORS["kinect-v1"].baseline_m
BORDER_PX = 16
"""Width of the border that a Kinect's registered depth does not reach."""
EDGE_PX = 3
"""Pixels this close to a depth edge lose their depth without being dark."""
STEEP = float(np.cos(np.radians(65.0)))
"""Cosine below which the angle explains a lost return."""
FAR_M = 3.9
"""Depth from which distance explains a lost return."""
ASIDE_PX = 2
"""Distance to the pixels on both sides from which a normal is computed."""


class Meets(IntEnum):
    """Kind of surface that a pixel's ray meets."""

    MEASURED = 0
    GUESSED = 1
    NOTHING = 2
    NO_RAY = 3


@dataclass(frozen=True, slots=True)
class PresentView:
    """All pixels of one present camera."""

    camera: Camera
    meets: IntArray
    """(H, W) ``Meets`` of each pixel."""
    z_m: FloatArray
    """(H, W) depth of the surface, else of the best guess; NaN where neither is known."""
    normals: FloatArray
    """(H, W, 3) unit normals of that depth in the camera's frame, towards the camera."""
    dark_return: FloatArray
    """(H, W) cosine over squared depth where the sensor got no return although nothing in the geometry
    explains that: the surface is probably dark or shiny; 0 elsewhere."""
    apart_rad: FloatArray
    """(H, W) angle to the nearest pixel with the sensor's depth."""


def view_of(
    scene: o3d.t.geometry.RaycastingScene, guessed: BoolArray, node: NodeClouds, camera: Camera
) -> PresentView:
    """Look at a surface through one of the cameras that made it.

    Args:
        scene: the surface.
        guessed: (F,) True for its guessed triangles.
        node: images and inferred depth of the camera.
        camera: its registered pose.
    """
    hits = camera_hits(scene, camera)
    triangle, z_m = hits["primitive_ids"].numpy(), hits["t_hit"].numpy()
    met = triangle < len(guessed)
    meets = np.where(met, Meets.MEASURED, Meets.NOTHING)
    meets[met] = np.where(guessed[triangle[met]], Meets.GUESSED, Meets.MEASURED)
    meets[~has_ray(camera.intrinsics)] = Meets.NO_RAY
    best_m = np.where(node.judged.depth.valid, node.judged.depth.z_m, node.alignment.depth.z_m)
    z_m = np.where(met, z_m, best_m)
    at_m = pixel_rays(camera.intrinsics) * z_m[..., None]
    normals = _normals(at_m)
    length_m = np.linalg.norm(at_m, axis=-1)
    cosine = -np.sum(normals * at_m, axis=-1) / np.maximum(length_m, 1e-12)
    lost = ~node.frame.depth.valid & (z_m > 0.0) & ~_explained(z_m, cosine, camera.intrinsics.fx_px)
    dark_return = np.divide(cosine, z_m**2, out=np.zeros(z_m.shape), where=lost)
    without = (~node.frame.depth.valid).astype(np.uint8)
    apart_px = cv2.distanceTransform(without, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return PresentView(camera, meets, z_m, normals, dark_return, apart_px / camera.intrinsics.fx_px)


def _normals(at_m: FloatArray) -> FloatArray:
    """Return (H, W, 3) normals of the points of an image, towards the camera; along the ray if unknown."""
    wide = np.pad(at_m, ((ASIDE_PX, ASIDE_PX), (ASIDE_PX, ASIDE_PX), (0, 0)), mode="edge")
    inner = slice(ASIDE_PX, -ASIDE_PX)
    down_m = wide[2 * ASIDE_PX :, inner] - wide[: -2 * ASIDE_PX, inner]
    right_m = wide[inner, 2 * ASIDE_PX :] - wide[inner, : -2 * ASIDE_PX]
    normals = np.cross(down_m, right_m)
    normals = np.where(np.isfinite(normals), normals, -at_m)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    away = np.sum(normals * at_m, axis=-1, keepdims=True) > 0.0
    return np.where(away, -normals, normals)


def _explained(z_m: FloatArray, cosine: FloatArray, fx_px: float) -> BoolArray:
    """Return (H, W) True where edge, shadow, border, angle or distance explains that there is no depth.

    The shadow is that of a Kinect's projector.
    """
    disparity_px = np.divide(fx_px * KINECT_BASELINE_M, z_m, out=np.zeros(z_m.shape), where=z_m > 0.0)
    in_projector_px = np.arange(z_m.shape[1]) - disparity_px
    nearest_px = np.minimum.accumulate(in_projector_px[:, ::-1], axis=1)[:, ::-1]
    explained = nearest_px < in_projector_px - 1.0
    edge = np.zeros(z_m.shape, np.uint8)
    edge[:, 1:] |= np.abs(np.diff(disparity_px, axis=1)) > 1.0
    edge[1:] |= np.abs(np.diff(disparity_px, axis=0)) > 1.0
    explained |= cv2.dilate(edge, np.ones(2 * (2 * EDGE_PX + 1,), np.uint8)) > 0
    inside = slice(BORDER_PX, -BORDER_PX)
    border = np.ones(z_m.shape, bool)
    border[inside, inside] = False
    return explained | border | (cosine < STEEP) | (z_m > FAR_M)


def pixels_of(points_m: FloatArray, camera: Camera) -> tuple[FloatArray, IntArray, IntArray, IntArray]:
    """Return (N,) depths of (N, 3) world points in a camera; rows, u and v of those inside its image."""
    in_camera_m = apply(inverse(camera.T_world_camera), points_m)
    ahead = np.flatnonzero(in_camera_m[:, 2] > 0.05)
    pixels = np.rint(project(camera.intrinsics, in_camera_m[ahead]))
    size_px = camera.intrinsics.width_px, camera.intrinsics.height_px
    inside = np.all((pixels >= 0) & (pixels < size_px), axis=1)  # False for NaN
    u, v = pixels[inside].astype(np.int64).T
    return in_camera_m[:, 2], ahead[inside], u, v


def depth_at(points_m: FloatArray, camera: Camera, z_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (N,) depths of (N, 3) world points in a camera, and the image's depth at their pixels.

    The latter is NaN for points behind the camera or outside its image.
    """
    depth_m, rows, u, v = pixels_of(points_m, camera)
    there_m = np.full(len(points_m), np.nan)
    there_m[rows] = z_m[v, u]
    return depth_m, there_m
