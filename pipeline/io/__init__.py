"""Files: images, intrinsics, clouds, meshes and rigs, checked when read and replaced whole when written."""

from pipeline.io.clouds import read_cloud, write_cloud
from pipeline.io.images import read_color, read_depth, write_color, write_depth_mm
from pipeline.io.intrinsics import read_intrinsics, write_intrinsics
from pipeline.io.meshes import read_mesh, write_mesh
from pipeline.io.rigs import MAX_NODES, load_frame, load_rig, save_rig

__all__ = [
    "MAX_NODES",
    "load_frame",
    "load_rig",
    "read_cloud",
    "read_color",
    "read_depth",
    "read_intrinsics",
    "read_mesh",
    "save_rig",
    "write_cloud",
    "write_color",
    "write_depth_mm",
    "write_intrinsics",
    "write_mesh",
]
