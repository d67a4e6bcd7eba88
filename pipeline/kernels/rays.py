"""Depth images and ray hits of a mesh, by ray casting."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import pixel_rays
from pipeline.kernels.kdtree import compiled
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import (
    BoolArray,
    ByteArray,
    CameraIntrinsics,
    DepthMap,
    FloatArray,
    IntArray,
    PointSource,
)


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera with its pose in the world."""

    intrinsics: CameraIntrinsics
    T_world_camera: FloatArray
    """(4, 4) transform from camera to world."""


def hit_depth(
    vertices_m: FloatArray, triangles: IntArray, intrinsics: CameraIntrinsics, T_world_camera: FloatArray
) -> DepthMap:
    """Render a mesh's depth image on the camera's (distorted) pixel grid; NaN where a ray misses."""
    return next(hit_depths(vertices_m, triangles, [Camera(intrinsics, T_world_camera)]))


def hit_depths(vertices_m: FloatArray, triangles: IntArray, cameras: Sequence[Camera]) -> Iterator[DepthMap]:
    """Yield a mesh's depth image in each camera, rendered one after the other."""
    scene = triangle_scene(vertices_m, triangles)
    for camera in cameras:
        yield depth_of(camera_hits(scene, camera))


def depth_of(hits: dict[str, o3d.core.Tensor]) -> DepthMap:
    """Return the depth image in the results of ``camera_hits``; NaN where a ray misses."""
    z_m = hits["t_hit"].numpy()  # in units of directions that have z = 1
    return DepthMap(np.where(np.isfinite(z_m), z_m, np.float32(np.nan)))


def triangle_scene(vertices_m: FloatArray, triangles: IntArray) -> o3d.t.geometry.RaycastingScene:
    """Create Open3D's ray-casting scene of one mesh."""
    scene = o3d.t.geometry.RaycastingScene()
    if len(triangles):
        scene.add_triangles(tensor(vertices_m, np.float32), tensor(triangles, np.uint32))
    return scene


def first_hits(
    scene: o3d.t.geometry.RaycastingScene, origins_m: FloatArray, directions: FloatArray
) -> FloatArray:
    """Return (...) lengths of (..., 3) rays to the first triangle, in units of the direction; inf if none."""
    rays = np.concatenate([origins_m, directions], axis=-1)
    return scene.cast_rays(tensor(rays, np.float32))["t_hit"].numpy()


def camera_hits(scene: o3d.t.geometry.RaycastingScene, camera: Camera) -> dict[str, o3d.core.Tensor]:
    """Cast the rays of all pixels, with camera-frame directions of z = 1; returns Open3D's (H, W) results."""
    rays = _in_world(pixel_rays(camera.intrinsics), camera.T_world_camera)
    return scene.cast_rays(tensor(rays, np.float32))


@compiled
def _in_world(directions: FloatArray, T_world_camera: FloatArray) -> FloatArray:
    """Return (H, W, 6) float32 world rays, origin and direction, for camera-frame directions (H, W, 3)."""
    rays = np.empty((*directions.shape[:2], 6), np.float32)
    for v in range(directions.shape[0]):
        for u in range(directions.shape[1]):
            for axis in range(3):
                along = 0.0
                for k in range(3):
                    along += T_world_camera[axis, k] * directions[v, u, k]
                rays[v, u, axis], rays[v, u, 3 + axis] = T_world_camera[axis, 3], along
    return rays


def tensor(array: np.ndarray, dtype: type[np.generic]) -> o3d.core.Tensor:
    """Convert an array to an Open3D tensor, without copying if its type and layout fit."""
    return o3d.core.Tensor.from_numpy(np.ascontiguousarray(array, dtype=dtype))


def guessed_triangles(triangles: IntArray, source: ByteArray) -> BoolArray:
    """Return (F,) True for triangles with two or three inferred corners; ``source`` (V,) is per vertex."""
    return np.sum(source[triangles] == PointSource.INFERRED, axis=1) >= 2


def triangle_areas_m2(vertices_m: FloatArray, triangles: IntArray) -> FloatArray:
    """Return (F,) areas of triangles."""
    a, b, c = (vertices_m[triangles[:, corner]] for corner in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
