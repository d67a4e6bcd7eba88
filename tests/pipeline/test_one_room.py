"""One room, written in every kind of file by other people's programs, gives one mesh.

A new format is a line in ``RECORDINGS`` or ``CLOUDS``, and its writer a function in ``strangers``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.bag_reader import SUFFIXES, is_bag
from pipeline.importing.kinds import KINDS, kind_of
from pipeline.io.clouds import _PARSERS
from pipeline.io.meshes import read_mesh
from pipeline.io.rigs import load_rig
from pipeline.reconstruct import reconstruct
from pipeline.surface.mesh_cloud import MeshOptions, iterate_mesh_file
from pipeline.types import PointCloud, Rig, Surface
from tests.pipeline.strangers import bags, clouds, colmap, containers, data_sets, foxglove, phones, texts
from tests.pipeline.strangers.room import distances_mm, moved, reconstructed, room, room_cloud

pytestmark = pytest.mark.xdist_group("one room")  # one worker reconstructs the room once
MOST_MM = 3.0
"""Largest median and 95th percentile of the distances of two meshes of the room, in both directions."""


@dataclass(frozen=True)
class Recording:
    """A layout of images and poses."""

    name: str
    write: Callable[[Path, Rig], Path]
    """Writes a rig into a new folder; returns the path to import."""
    rounding: str
    """What the format changes; it is named where the test fails."""
    times: int = 1
    """Colour images have so many times the columns and rows of the depth images."""
    nodes: int = 3
    own_world: bool = False
    """Whether the recording's world is that of its first camera."""


RECORDINGS = [
    Recording("TUM RGB-D", data_sets.write_tum, "depth in 1/5000 m, poses to 1e-7"),
    Recording("ICL-NUIM", data_sets.write_icl_nuim, "depth in 1/5000 m, poses to 1e-7"),
    Recording("7-Scenes", data_sets.write_seven_scenes, "rotations orthonormal only to 5e-4"),
    Recording("ScanNet", data_sets.write_scannet, "JPEG colours, poses to 1e-6"),
    Recording("ScanNet, 2 x", partial(data_sets.write_scannet, times=2), "JPEG colours", times=2, nodes=2),
    Recording("Redwood", data_sets.write_redwood, "voxels along other axes", own_world=True),
    Recording("Open3D", data_sets.write_open3d, "JPEG colours, poses to 1e-8"),
    Recording("SUN RGB-D", data_sets.write_sun_rgbd, "JPEG colours", nodes=1, own_world=True),
    Recording("nerfstudio", data_sets.write_nerfstudio, "nothing"),
    Recording("COLMAP, depth maps", colmap.write_colmap_dense, "depth in float32"),
    Recording("COLMAP, sensor", colmap.write_colmap_sensor, "the scale, from points to 1e-6"),
    Recording("COLMAP, binary", colmap.write_colmap_binary, "the scale, from points to 1e-6"),
    Recording("Stray Scanner", phones.write_stray, "nothing", times=2, nodes=2),
    Recording("Stray Scanner, video", containers.write_stray_video, "colours of a video", times=2, nodes=2),
    Recording("Polycam", phones.write_polycam, "JPEG colours", times=3, nodes=2),
    Recording("Record3D", phones.write_record3d, "JPEG colours, depth in float32", times=4, nodes=2),
    Recording("Record3D .r3d", containers.write_r3d, "JPEG colours", times=3, nodes=2),
    Recording("3D Scanner App", phones.write_scanner_app, "JPEG colours", times=3, nodes=2),
    Recording("ScanNet .sens", containers.write_sens, "JPEG colours, poses in float32", times=2, nodes=2),
    Recording("Azure Kinect", containers.write_kinect, "JPEG colours", nodes=1, own_world=True),
    Recording("ROS 1", bags.write_ros1, "nothing"),
    Recording("ROS 1, compressed metres", bags.write_ros1_metres, "JPEG colours, depth in z^2 / 10100"),
    Recording("ROS 2 db3", bags.write_db3, "depth in float32"),
    Recording("ROS 2 db3, RVL", bags.write_db3_rvl, "nothing"),
    Recording("ROS 2 mcap, compressed", bags.write_mcap, "JPEG colours"),
    Recording("ROS 2 mcap, 2 x", bags.write_mcap_large, "nothing", times=2, nodes=2),
    Recording("ROS 2 mcap, image_rect", bags.write_image_rect, "nothing"),
    Recording("Foxglove, protocol buffers", foxglove.write_protobuf, "nothing"),
    Recording("Foxglove, JSON and PNG", foxglove.write_json, "nothing"),
]


@dataclass(frozen=True)
class Cloud:
    """A format of points."""

    name: str
    suffix: str
    write: Callable[[Path, PointCloud], None]
    rounding: str
    """What the format changes; it is named where the test fails."""


CLOUDS = [
    Cloud("trimesh's PLY", ".ply", clouds.write_trimesh, "float32, no normals"),
    Cloud("Open3D's PLY", ".ply", clouds.write_open3d, "nothing"),
    Cloud("PLY as text", ".ply", clouds.write_open3d_ascii, "six digits"),
    Cloud("PCD", ".pcd", clouds.write_open3d, "float32"),
    Cloud("PCD as text", ".pcd", clouds.write_open3d_ascii, "ten digits of float32"),
    Cloud("compressed PCD", ".pcd", clouds.write_open3d_compressed, "float32"),
    Cloud("LAS", ".las", clouds.write_las, "1 mm, no normals"),
    Cloud("LAZ", ".laz", clouds.write_las, "1 mm, no normals"),
    Cloud("E57", ".e57", clouds.write_e57, "no normals"),
    Cloud("NPZ", ".npz", clouds.write_npz, "nothing"),
    Cloud("NPY", ".npy", clouds.write_npy, "float32"),
    Cloud("KITTI", ".bin", clouds.write_kitti, "float32, no normals"),
    Cloud("XYZ", ".xyz", clouds.write_open3d_ascii, "1e-10 m, no normals"),
    Cloud("OBJ", ".obj", clouds.write_model, "1e-8 m, no normals"),
    Cloud("GLB", ".glb", clouds.write_model, "float32, no normals"),
    Cloud("STL", ".stl", clouds.write_model, "float32, no normals"),
    Cloud("VTK", ".vtk", clouds.write_vtk, "no normals"),
    Cloud("PTS", ".pts", texts.write_pts, "1e-6 m, no normals"),
    Cloud("commas, titles", ".csv", texts.write_comma, "0.1 mm, no normals"),
    Cloud("semicolons, decimal commas", ".csv", texts.write_semicolon, "0.1 mm, no normals"),
    Cloud("tabs, millimetres", ".txt", texts.write_tab_mm, "0.1 mm, no normals"),
    Cloud("time first", ".asc", texts.write_time_first, "0.1 mm, no normals"),
]


@pytest.mark.parametrize("kind", RECORDINGS, ids=lambda kind: kind.name)
def test_a_recording_of_the_room_gives_its_mesh(tmp_path, kind):
    path = kind.write(tmp_path / "stranger", room(kind.nodes))
    drain(iterate_import(path, tmp_path / "rig"))
    found, expected = reconstruct(load_rig(tmp_path / "rig")), reconstructed(kind.nodes, kind.times)
    T_room_world = np.eye(4)
    if kind.own_world:
        first = expected.placement.T_world_camera[0], found.placement.T_world_camera[0]
        T_room_world = first[0] @ np.linalg.inv(first[1])
    assert_same(moved(found.after, T_room_world), expected.after, kind)


def test_every_kind_of_file_is_in_the_tables(tmp_path):
    paths = [kind.write(tmp_path / str(index), room(1)) for index, kind in enumerate(RECORDINGS)]
    assert {kind_of(path) for path in paths if not is_bag(path)} == set(KINDS)
    assert {path.suffix for folder in paths for path in (folder, *folder.glob("*"))} >= set(SUFFIXES)
    assert {kind.suffix for kind in CLOUDS} == set(_PARSERS)


@pytest.mark.parametrize("times", [2, 3, 4])
def test_larger_photographs_leave_the_surface_in_its_place(times):
    """Only the median can agree: a finer grid resolves edges that triangles of the coarse one cut."""
    assert max(distances_mm(reconstructed(2, times).before, reconstructed(2).before, 50.0)) <= MOST_MM


@pytest.mark.parametrize("kind", CLOUDS, ids=lambda kind: kind.name)
def test_a_cloud_of_the_room_gives_its_mesh(tmp_path, kind):
    path = tmp_path / f"room{kind.suffix}"
    kind.write(path, room_cloud())
    drain(iterate_mesh_file(path, tmp_path / "mesh.ply", MeshOptions()))
    assert_same(read_mesh(tmp_path / "mesh.ply"), reconstructed().before, kind)


def assert_same(found: Surface, expected: Surface, kind: Recording | Cloud) -> None:
    for percent in (50.0, 95.0):
        there_mm, back_mm = distances_mm(found, expected, percent)
        assert max(there_mm, back_mm) <= MOST_MM, (
            f"{kind.name} (changed by the format: {kind.rounding}): {percent:g} % of the corners are within "
            f"{there_mm:.2f} mm of the room's mesh, and of the room's within {back_mm:.2f} mm of this one"
        )
