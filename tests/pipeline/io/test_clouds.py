"""PLY clouds: our own come back bit by bit, other people's are read."""

import numpy as np
import pytest
import trimesh

from pipeline.io.clouds import read_cloud, write_cloud
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import PointCloud


@pytest.fixture
def cloud() -> PointCloud:
    """Float32 numbers, as files hold them."""
    rng = np.random.default_rng(3)
    return PointCloud(
        points_m=rng.normal(size=(50, 3)).astype(np.float32).astype(np.float64),
        colors=rng.integers(0, 256, (50, 3), dtype=np.uint8),
        normals=rng.normal(size=(50, 3)).astype(np.float32).astype(np.float64),
        source=rng.integers(0, 2, 50, dtype=np.uint8),
    )


def assert_same(first, second):
    for column in ("points_m", "colors", "normals", "source"):
        a, b = getattr(first, column), getattr(second, column)
        assert (a is None) == (b is None), column
        if a is not None:
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    "without", [(), ("colors",), ("normals",), ("source",), ("colors", "normals", "source")]
)
def test_what_is_written_is_read_to_the_last_bit(tmp_path, cloud, without):
    columns = {name: getattr(cloud, name) for name in ("points_m", "colors", "normals", "source")}
    cloud = PointCloud(**{name: None if name in without else column for name, column in columns.items()})
    write_cloud(tmp_path / "cloud.ply", cloud)
    assert_same(read_cloud(tmp_path / "cloud.ply"), cloud)


def test_open3d_reads_what_we_write(tmp_path, cloud):
    write_cloud(tmp_path / "cloud.ply", cloud)
    other = o3d.io.read_point_cloud(str(tmp_path / "cloud.ply"))
    np.testing.assert_array_equal(np.asarray(other.points), cloud.points_m)
    np.testing.assert_array_equal(np.asarray(other.normals), cloud.normals)
    np.testing.assert_array_equal(np.rint(np.asarray(other.colors) * 255), cloud.colors)


@pytest.mark.parametrize("ascii_text", [True, False])
def test_we_read_what_open3d_writes(tmp_path, cloud, ascii_text):
    other = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    other.normals = o3d.utility.Vector3dVector(cloud.normals)
    other.colors = o3d.utility.Vector3dVector(cloud.colors / 255.0)
    o3d.io.write_point_cloud(str(tmp_path / "cloud.ply"), other, write_ascii=ascii_text)
    again = read_cloud(tmp_path / "cloud.ply")
    digits_m = 1e-5 if ascii_text else 0.0
    np.testing.assert_allclose(again.points_m, cloud.points_m, rtol=0, atol=digits_m)
    np.testing.assert_allclose(again.normals, cloud.normals, rtol=0, atol=digits_m)
    np.testing.assert_array_equal(again.colors, cloud.colors)
    assert again.source is None


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_the_vertices_of_a_mesh_are_a_cloud(tmp_path, encoding):
    box = trimesh.creation.box()
    box.export(str(tmp_path / "box.ply"), encoding=encoding)
    again = read_cloud(tmp_path / "box.ply")
    np.testing.assert_allclose(again.points_m, box.vertices, atol=1e-6)


def test_big_endian_doubles_and_float_colours_are_read(tmp_path):
    header = "ply\nformat binary_big_endian 1.0\ncomment by hand\nelement vertex 2\n"
    names = ("x", "y", "z", "red", "green", "blue")
    header += "".join(f"property double {name}\n" for name in names) + "end_header\n"
    rows = np.array([[1, 2, 3, 0, 0.5, 1], [4, 5, 6, 1, 0.2, 0]], dtype=">f8")
    (tmp_path / "cloud.ply").write_bytes(header.encode() + rows.tobytes())
    again = read_cloud(tmp_path / "cloud.ply")
    np.testing.assert_array_equal(again.points_m, rows[:, :3])
    np.testing.assert_array_equal(again.colors, [[0, 128, 255], [255, 51, 0]])


def test_points_that_are_not_finite_are_left_out(tmp_path, cloud):
    points_m = cloud.points_m.copy()
    points_m[7, 1] = np.nan
    points_m[9, 2] = np.inf
    write_cloud(tmp_path / "cloud.ply", PointCloud(points_m, cloud.colors))
    again = read_cloud(tmp_path / "cloud.ply")
    rows = np.delete(np.arange(50), [7, 9])
    assert_same(again, PointCloud(points_m[rows], cloud.colors[rows]))
