"""The room's points in the formats of other programs, with what each format holds of colours and normals."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import pye57
import trimesh

from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import PointCloud


def write_trimesh(path: Path, cloud: PointCloud) -> None:
    """By trimesh: positions as float32, and colours with alpha."""
    trimesh.PointCloud(cloud.points_m, cloud.colors).export(path)


def write_open3d(path: Path, cloud: PointCloud) -> None:
    """By Open3D, binary: PLY with double positions, PCD with float positions, normals and packed colours."""
    o3d.io.write_point_cloud(str(path), _open3d(cloud))


def write_open3d_ascii(path: Path, cloud: PointCloud) -> None:
    """By Open3D, as text: PLY, PCD, XYZ and PTS by the suffix."""
    o3d.io.write_point_cloud(str(path), _open3d(cloud), write_ascii=True)


def write_open3d_compressed(path: Path, cloud: PointCloud) -> None:
    """By Open3D, compressed PCD."""
    o3d.io.write_point_cloud(str(path), _open3d(cloud), compressed=True)


def write_las(path: Path, cloud: PointCloud) -> None:
    """By laspy: whole millimetres from an offset, colours of 16 bits; LAZ by the suffix."""
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales, header.offsets = [0.001] * 3, np.floor(cloud.points_m.min(axis=0))
    las = laspy.LasData(header)
    las.x, las.y, las.z = cloud.points_m.T
    las.red, las.green, las.blue = cloud.colors.T.astype(np.uint16) * 257
    las.write(str(path))


def write_e57(path: Path, cloud: PointCloud) -> None:
    """By pye57: a scan in the scanner's frame, with its pose in the world."""
    scanner_m = np.array([4.0, -1.0, 1.5])
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    seen_m = (cloud.points_m - scanner_m) @ quarter
    data = {f"cartesian{axis}": seen_m[:, k].copy() for k, axis in enumerate("XYZ")}
    data |= {f"color{name}": cloud.colors[:, k].copy() for k, name in enumerate(("Red", "Green", "Blue"))}
    with pye57.E57(str(path), mode="w") as file:
        rotation = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
        file.write_scan_raw(data, rotation=rotation, translation=scanner_m)


def write_npz(path: Path, cloud: PointCloud) -> None:
    """By NumPy: arrays points, colors and normals."""
    np.savez_compressed(path, points=cloud.points_m, colors=cloud.colors, normals=cloud.normals)


def write_npy(path: Path, cloud: PointCloud) -> None:
    """By NumPy: nine columns of float32."""
    np.save(path, np.hstack([cloud.points_m, cloud.colors, cloud.normals]).astype(np.float32))


def write_kitti(path: Path, cloud: PointCloud) -> None:
    """By NumPy: x, y, z and reflectance as float32."""
    reflectance = cloud.colors[:, :1] / 255.0
    np.hstack([cloud.points_m, reflectance]).astype("<f4").tofile(path)


def write_model(path: Path, cloud: PointCloud) -> None:
    """By trimesh: OBJ, STL and GLB by the suffix. The points are the corners of any triangles.

    glTF says that y is up (section 3.3), so that a room with z up is turned for a GLB.
    """
    x, y, z = cloud.points_m.T
    points_m = np.stack([x, z, -y], axis=1) if path.suffix == ".glb" else cloud.points_m
    corners = np.resize(np.arange(len(cloud)), (len(cloud) // 3 + 1, 3))
    trimesh.Trimesh(points_m, corners, process=False).export(path)


def write_vtk(path: Path, cloud: PointCloud) -> None:
    """Legacy VTK, binary: big-endian float64."""
    head = f"# vtk DataFile Version 3.0\nroom\nBINARY\nDATASET POLYDATA\nPOINTS {len(cloud)} double\n"
    path.write_bytes(head.encode() + cloud.points_m.astype(">f8").tobytes() + b"\n")


def _open3d(cloud: PointCloud) -> o3d.geometry.PointCloud:
    own = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    own.colors = o3d.utility.Vector3dVector(cloud.colors / 255.0)
    own.normals = o3d.utility.Vector3dVector(cloud.normals)
    return own
