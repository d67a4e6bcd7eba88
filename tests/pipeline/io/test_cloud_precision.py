"""Clouds and meshes in UTM coordinates: every format keeps them to a tenth of a millimetre, or says no."""

import logging

import laspy
import numpy as np
import pytest
import trimesh

from packetmesh.errors import InputError
from pipeline.io.cloud_precision import middle_m, too_coarse
from pipeline.io.clouds import read_cloud, write_cloud
from pipeline.io.meshes import T_GLTF_WORLD, read_mesh, write_mesh
from pipeline.io.textures import Texture
from pipeline.kernels.geometry import apply
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import PointCloud, Surface

UTM_M = np.array([5e5, 4.65e6, 312.0])
BALL = trimesh.creation.icosphere(subdivisions=2)
FAR_M = np.asarray(BALL.vertices) + UTM_M
COLORS = np.random.default_rng(2).integers(0, 256, (len(FAR_M), 3), dtype=np.uint8)
FAR = Surface(FAR_M, np.asarray(BALL.faces, np.int32), COLORS)
TENTH_MM = 1e-4


def test_rounding_counts_from_a_tenth_of_a_millimetre():
    assert not too_coarse(np.array([[1000.00001, 0.0, 0.0]]))  # floats are 0.06 mm apart there
    assert too_coarse(np.array([[3000.00012, 0.0, 0.0]]))  # 0.24 mm apart
    assert not too_coarse(np.array([[500000.0, 4650000.0, 0.5], [np.nan, 1.1e7, np.inf]]))  # are floats
    np.testing.assert_array_equal(middle_m(FAR_M), UTM_M)


def test_a_far_cloud_keeps_its_place(tmp_path):
    normals = np.asarray(BALL.vertex_normals)
    write_cloud(tmp_path / "a.ply", PointCloud(FAR_M, COLORS, normals))
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.ply").points_m, FAR_M)
    other = o3d.io.read_point_cloud(str(tmp_path / "a.ply"))
    np.testing.assert_array_equal(np.asarray(other.points), FAR_M)
    np.testing.assert_allclose(np.asarray(other.normals), normals, atol=1e-7)
    np.testing.assert_array_equal(np.rint(np.asarray(other.colors) * 255), COLORS)


def test_a_near_cloud_stays_of_floats(tmp_path):
    write_cloud(tmp_path / "a.ply", PointCloud(np.asarray(BALL.vertices)))
    assert b"property float x\n" in (tmp_path / "a.ply").read_bytes()


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
@pytest.mark.parametrize("colored", [True, False])
def test_a_far_mesh_keeps_its_place(tmp_path, caplog, suffix, colored):
    caplog.set_level(logging.WARNING)
    path = tmp_path / f"a{suffix}"
    write_mesh(path, FAR if colored else Surface(FAR_M, FAR.triangles))
    again = read_mesh(path)
    assert np.abs(again.vertices_m - FAR_M).max() < TENTH_MM
    np.testing.assert_array_equal(again.triangles, FAR.triangles)
    if colored:
        np.testing.assert_array_equal(again.colors, COLORS)
    other = trimesh.load_scene(path, process=False).to_mesh()
    there_m = apply(T_GLTF_WORLD, FAR_M) if suffix == ".glb" else FAR_M
    assert np.abs(other.vertices - there_m).max() < TENTH_MM
    assert np.abs(read_cloud(path).points_m - FAR_M).max() < TENTH_MM
    said = "relative to (500000, 4650000, 312) m, which the translation of the root node adds"
    assert (said in caplog.text) == (suffix == ".glb")


def test_a_far_mesh_with_photographs_keeps_its_place(tmp_path):
    image = np.zeros((32, 16, 3), np.uint8)
    texture = Texture(image, np.zeros(len(FAR.triangles), np.int32), np.full((1, len(FAR_M), 2), 0.5, "f4"))
    write_mesh(tmp_path / "a.glb", FAR, texture)
    again_m = np.unique(np.round(read_mesh(tmp_path / "a.glb").vertices_m, 4), axis=0)
    assert np.abs(again_m - np.unique(np.round(FAR_M, 4), axis=0)).max() < 2 * TENTH_MM


@pytest.mark.parametrize(("suffix", "scale"), [(".stl", 1.0), (".glb", 1e5)])
def test_a_format_that_would_move_points_is_refused(tmp_path, suffix, scale):
    surface = Surface(scale * np.asarray(BALL.vertices) + UTM_M, FAR.triangles)
    with pytest.raises(InputError, match=r"the 32-bit numbers of \.\w+ files are too coarse; try \.ply or"):
        write_mesh(tmp_path / f"a{suffix}", surface)
    assert not list(tmp_path.iterdir())
    write_mesh(tmp_path / "a.ply", surface)
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.ply").vertices_m, surface.vertices_m)


def test_far_clouds_of_others_keep_their_place(tmp_path):
    np.savetxt(tmp_path / "a.xyz", FAR_M, "%.17g")
    np.savez(tmp_path / "a.npz", points=FAR_M)
    np.save(tmp_path / "a.npy", FAR_M)
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(FAR_M))
    o3d.io.write_point_cloud(str(tmp_path / "a.ply"), points)
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.scales, header.offsets = [1e-4] * 3, UTM_M
    file = laspy.LasData(header)
    file.x, file.y, file.z = FAR_M.T
    file.write(str(tmp_path / "a.las"))
    for path in sorted(tmp_path.iterdir()):
        assert np.abs(read_cloud(path).points_m - FAR_M).max() < TENTH_MM, path
