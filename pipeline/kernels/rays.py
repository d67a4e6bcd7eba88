"""What cameras see of a mesh, by ray casting."""

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
    """A camera in the world."""

    intrinsics: CameraIntrinsics
    T_world_camera: FloatArray
    """(4, 4)."""


def hit_depth(
    vertices_m: FloatArray, triangles: IntArray, intrinsics: CameraIntrinsics, T_world_camera: FloatArray
) -> DepthMap:
    """The depth image of a mesh, on the camera's (distorted) pixel grid; NaN where a ray misses."""
    return next(hit_depths(vertices_m, triangles, [Camera(intrinsics, T_world_camera)]))


def hit_depths(vertices_m: FloatArray, triangles: IntArray, cameras: Sequence[Camera]) -> Iterator[DepthMap]:
    """The depth image of a mesh in each camera."""
    scene = triangle_scene(vertices_m, triangles)
    for camera in cameras:
        yield depth_of(camera_hits(scene, camera))


def depth_of(hits: dict[str, o3d.core.Tensor]) -> DepthMap:
    """The depth image in the answers of ``camera_hits``; NaN where a ray misses."""
    z_m = hits["t_hit"].numpy()  # in units of directions that have z = 1
    return DepthMap(np.where(np.isfinite(z_m), z_m, np.float32(np.nan)))


def triangle_scene(vertices_m: FloatArray, triangles: IntArray) -> o3d.t.geometry.RaycastingScene:
    """Open3D's scene of one mesh, for rays and distances."""
    scene = o3d.t.geometry.RaycastingScene()
    if len(triangles):
        scene.add_triangles(tensor(vertices_m, np.float32), tensor(triangles, np.uint32))
    return scene


def first_hits(
    scene: o3d.t.geometry.RaycastingScene, origins_m: FloatArray, directions: FloatArray
) -> FloatArray:
    """(...) lengths of (..., 3) rays up to the first triangle, in units of their directions; inf for none."""
    rays = np.concatenate([origins_m, directions], axis=-1)
    return scene.cast_rays(tensor(rays, np.float32))["t_hit"].numpy()


def camera_hits(scene: o3d.t.geometry.RaycastingScene, camera: Camera) -> dict[str, o3d.core.Tensor]:
    """Open3D's (H, W) answers to the rays of all pixels, whose camera-frame directions have z = 1."""
    rays = _in_world(pixel_rays(camera.intrinsics), camera.T_world_camera)
    return scene.cast_rays(tensor(rays, np.float32))


@compiled
def _in_world(directions: FloatArray, T_world_camera: FloatArray) -> FloatArray:
    """(H, W, 6) float32 rays from (H, W, 3) camera-frame directions: origin and direction in the world."""
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
    """Open3D's view of an array."""
    return o3d.core.Tensor.from_numpy(np.ascontiguousarray(array, dtype=dtype))


def guessed_triangles(triangles: IntArray, source: ByteArray) -> BoolArray:
    """(F,) True where two or three of the corners were inferred, by the (V,) source of the vertices."""
    return np.sum(source[triangles] == PointSource.INFERRED, axis=1) >= 2


def triangle_areas_m2(vertices_m: FloatArray, triangles: IntArray) -> FloatArray:
    """(F,)."""
    a, b, c = (vertices_m[triangles[:, corner]] for corner in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
