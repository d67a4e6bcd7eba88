"""The room that every writer writes out, the meshes of it, and the distance between two meshes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from pipeline.io.demos import load_demo
from pipeline.io.depth_to_color import register_depth
from pipeline.kernels.geometry import apply
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import triangle_scene
from pipeline.reconstruct import Reconstruction, reconstruct
from pipeline.types import CameraIntrinsics, DepthMap, FloatArray, PointCloud, RgbdFrame, Rig, Surface
from tests.pipeline.strangers.images import photograph

SCENE, EVERY_PX = "box-on-table", 5
"""The demo scene, and its pixels that are kept: every fifth one of every fifth row, 128 x 96."""


@cache
def room(nodes: int = 3) -> Rig:
    """Return the room's first nodes, without the truth; depth has whole millimetres."""
    return Rig("room", tuple(_smaller(frame) for frame in load_demo(SCENE).frames[:nodes]))


@cache
def reconstructed(nodes: int = 3, times: int = 1) -> Reconstruction:
    """Return the reconstruction of the room as it ships.

    With ``times``, colour images have so many times the columns and rows of the depth images, which are
    registered to them.
    """
    return reconstruct(Rig("room", tuple(_photographed(frame, times) for frame in room(nodes).frames)))


@cache
def room_cloud() -> PointCloud:
    """Return the room's measured points with colours and normals, averaged over voxels; world frame."""
    cloud = reconstructed().clouds.sensor
    return PointCloud(cloud.points_m, cloud.colors, cloud.normals)


def moved(mesh: Surface, T_room_world: FloatArray) -> Surface:
    """Return a mesh in the room's frame."""
    return Surface(apply(T_room_world, mesh.vertices_m), mesh.triangles)


def distances_mm(one: Surface, other: Surface, percent: float) -> tuple[float, float]:
    """Return the percentile of the distances from one mesh's corners to the other mesh, and back, mm.

    A part that only one of the meshes has is far from the other.
    """
    lengths_mm = []
    for start, end in ((one, other), (other, one)):
        scene = triangle_scene(end.vertices_m, end.triangles)
        corners_m = start.vertices_m[np.unique(start.triangles)].astype(np.float32)
        lengths_mm.append(1000.0 * scene.compute_distance(o3d.core.Tensor(corners_m)).numpy())
    there, back = (float(np.percentile(lengths, percent)) for lengths in lengths_mm)
    return there, back


def _smaller(frame: RgbdFrame) -> RgbdFrame:
    K, step = frame.intrinsics, slice(None, None, EVERY_PX)
    numbers = (number / EVERY_PX for number in (K.fx_px, K.fy_px, K.cx_px, K.cy_px))
    camera = CameraIntrinsics.pinhole(*numbers, K.width_px // EVERY_PX, K.height_px // EVERY_PX)
    z_m = np.ascontiguousarray(frame.depth.z_m[step, step])
    rgb = np.ascontiguousarray(frame.rgb[step, step])
    return replace(frame, rgb=rgb, depth=DepthMap(z_m), intrinsics=camera)


def _photographed(frame: RgbdFrame, times: int) -> RgbdFrame:
    if times == 1:
        return frame
    rgb, camera = photograph(frame, times)
    depth = register_depth(frame.depth, frame.intrinsics, camera, np.eye(4))
    return replace(frame, rgb=rgb, depth=depth, intrinsics=camera)
