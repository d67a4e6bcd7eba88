"""Clouds as other programs write them, and what is left of them when a file is cut or lies."""

import contextlib
import struct
from dataclasses import dataclass

import laspy
import numpy as np
import pye57
import pytest
import trimesh

from packetmesh.errors import InputError
from pipeline.io.clouds import read_cloud
from pipeline.io.meshes import write_mesh
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import Surface

RNG = np.random.default_rng(3)
COUNT = 501
POINTS = np.round(RNG.uniform(-5.0, 5.0, (COUNT, 3)), 3)
COLORS = RNG.integers(0, 256, (COUNT, 3), dtype=np.uint8)
FLOAT = {"rtol": 0.0, "atol": 1e-6}


def open3d_cloud(repeated=False):
    points = np.round(POINTS, 1 if repeated else 3)  # what repeats can be packed
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.colors = o3d.utility.Vector3dVector(COLORS / 255.0)
    return cloud


def pcd_compressed(path):
    o3d.io.write_point_cloud(str(path), open3d_cloud(), compressed=True)


def pts(path):
    o3d.io.write_point_cloud(str(path), open3d_cloud(), write_ascii=True)


def npy(path):
    np.save(path, np.hstack([POINTS, COLORS]))


def las(path):
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales = [0.001] * 3
    file = laspy.LasData(header)
    file.x, file.y, file.z = POINTS.T
    file.red, file.green, file.blue = COLORS.T.astype(np.uint16) << 8
    file.write(str(path))


def e57(path):
    with pye57.E57(str(path), mode="w") as file:
        data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), POINTS.T.copy(), strict=True))
        data |= dict(zip(("colorRed", "colorGreen", "colorBlue"), COLORS.T.copy(), strict=True))
        file.write_scan_raw(data)


def sweep(path):
    path.write_bytes(np.hstack([POINTS, np.ones((COUNT, 1))]).astype("<f4").tobytes())


def vtk_ascii(path):
    numbers = " ".join(format(value, ".6g") for value in POINTS.ravel())
    head = f"# vtk DataFile Version 3.0\nby hand\nASCII\nDATASET POLYDATA\nPOINTS {COUNT} float\n"
    path.write_text(head + numbers + f"\nVERTICES 1 {COUNT + 1}\n{COUNT} 0\n")


def vtk_binary(path):
    head = f"# vtk DataFile Version 3.0\nby hand\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS {COUNT} double\n"
    path.write_bytes(head.encode() + POINTS.astype(">f8").tobytes() + b"\nCELLS 0 0\n")


def obj(path):
    path.write_text(trimesh.Trimesh(POINTS, TRIANGLES, process=False).export(file_type="obj"))


def glb(path):
    write_mesh(path, Surface(POINTS, TRIANGLES, COLORS))


TRIANGLES = np.arange(COUNT - COUNT % 3).reshape(-1, 3)


@dataclass(frozen=True)
class Kind:
    name: str
    write: callable
    colored: bool


KINDS = [
    Kind("packed.pcd", pcd_compressed, True),
    Kind("a.pts", pts, True),
    Kind("a.npy", npy, True),
    Kind("a.las", las, True),
    Kind("a.laz", las, True),
    Kind("a.e57", e57, True),
    Kind("000001.bin", sweep, False),
    Kind("text.vtk", vtk_ascii, False),
    Kind("binary.vtk", vtk_binary, False),
    Kind("a.obj", obj, False),
    Kind("a.glb", glb, True),
]
kinds = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)


@kinds
def test_points_and_colours_come_back(tmp_path, kind):
    kind.write(tmp_path / kind.name)
    cloud = read_cloud(tmp_path / kind.name)
    here = cloud.points_m if len(cloud) == COUNT else np.empty(0)
    np.testing.assert_allclose(here, POINTS, **FLOAT)
    if kind.colored:
        np.testing.assert_array_equal(cloud.colors, COLORS)
    else:
        assert cloud.colors is None


def test_the_corners_of_an_stl_are_the_points(tmp_path):
    write_mesh(tmp_path / "a.stl", Surface(POINTS, TRIANGLES))
    found = np.unique(read_cloud(tmp_path / "a.stl").points_m, axis=0)
    expected = np.unique(POINTS[: 3 * len(TRIANGLES)].astype(np.float32).astype(float), axis=0)
    np.testing.assert_array_equal(found, expected)


def test_what_is_packed_well_is_unpacked_to_the_bit(tmp_path):
    o3d.io.write_point_cloud(str(tmp_path / "loose.pcd"), open3d_cloud(repeated=True))
    o3d.io.write_point_cloud(str(tmp_path / "packed.pcd"), open3d_cloud(repeated=True), compressed=True)
    assert (tmp_path / "packed.pcd").stat().st_size < 0.9 * (tmp_path / "loose.pcd").stat().st_size
    loose, packed = (read_cloud(tmp_path / f"{name}.pcd") for name in ("loose", "packed"))
    np.testing.assert_array_equal(packed.points_m, loose.points_m)
    np.testing.assert_array_equal(packed.colors, loose.colors)


def test_scans_of_an_e57_lie_where_their_poses_say(tmp_path):
    data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), POINTS.T.copy(), strict=True))
    with pye57.E57(str(tmp_path / "two.e57"), mode="w") as file:
        for offset in ([0.0, 0.0, 0.0], [100.0, 0.0, 0.0]):
            file.write_scan_raw(data, rotation=np.array([1.0, 0.0, 0.0, 0.0]), translation=np.array(offset))
    points = read_cloud(tmp_path / "two.e57").points_m
    np.testing.assert_allclose(points[COUNT:] - points[:COUNT], [[100.0, 0.0, 0.0]] * COUNT, atol=1e-6)


@kinds
@pytest.mark.parametrize("tenth", range(1, 10))
def test_a_file_that_ends_too_soon_is_one_sentence_or_an_honest_part(tmp_path, kind, tenth):
    kind.write(tmp_path / kind.name)
    whole = (tmp_path / kind.name).read_bytes()
    (tmp_path / kind.name).write_bytes(whole[: len(whole) * tenth // 10])
    if kind.name in ("000001.bin", "a.obj"):  # without a count nobody can know
        with contextlib.suppress(InputError):
            part = read_cloud(tmp_path / kind.name).points_m
            np.testing.assert_allclose(part[:-1], POINTS[: len(part) - 1], **FLOAT)
        return
    with pytest.raises(InputError) as caught:
        read_cloud(tmp_path / kind.name)
    assert kind.name in str(caught.value)
    assert "\n" not in str(caught.value)


def vtk(count="3", word="float", kind="BINARY", body=bytes(36)):
    head = f"# vtk DataFile Version 3.0\nx\n{kind}\nDATASET POLYDATA\nPOINTS {count} {word}\n"
    return head.encode() + body


def packed_pcd(unpacked=36, packed=b"\x02abc", count=3):
    head = f"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {count}\nHEIGHT 1\nPOINTS {count}\n"
    return f"{head}DATA binary_compressed\n".encode() + struct.pack("<II", len(packed), unpacked) + packed


LIES = {
    "sizes.pcd": (packed_pcd(unpacked=40), "take 36 bytes, and it says 40"),
    "run.pcd": (packed_pcd(packed=b"\x1fabc"), "damaged"),
    "back.pcd": (packed_pcd(packed=b"\x00a\x3f\xff"), "damaged"),
    "short.pcd": (packed_pcd(packed=b"\x02abc"), "damaged"),
    "huge.pcd": (packed_pcd(count=10**12), "more than the 20 million"),
    "word.vtk": (vtk(word="int"), "of type int"),
    "many.vtk": (vtk(count=str(10**15)), "more than the 20 million"),
    "none.vtk": (b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\n", "no.* a legacy VTK file"),
    "xml.vtk": (b"<?xml version='1.0'?><VTKFile/>", "not a legacy VTK file"),
    "words.vtk": (vtk(kind="ASCII", body=b"1 2 3 4 5 six 7 8 9"), "not 3 numbers"),
    "odd.bin": (bytes(17), "17 bytes"),
    "empty.bin": (b"", "is empty"),
    "picture.bin": (b"\x7f\x7f\x7f\x7f" * 8, "no positions"),
    "flat.npy": (None, "shape"),
    "pickle.npy": (None, "more than numbers"),
    "five.pts": (b"2\n1 2 3 4 5\n1 2 3 4 5\n", "5 columns"),
    "few.pts": (b"3\n1 2 3\n1 2 3\n", "after 2 of its 3 points"),
    "not.las": (b"LASF" + bytes(300), "truncated or damaged"),
    "not.e57": (b"ASTM-E57" + bytes(300), "truncated or damaged"),
    "not.obj": (b"f 1 2 3\n", "no vertices"),
    "not.glb": (b"glTF" + bytes(30), "no vertices"),
}


@pytest.mark.parametrize("name", LIES)
def test_a_file_that_lies_is_one_sentence(tmp_path, name):
    data, says = LIES[name]
    if name == "flat.npy":
        np.save(tmp_path / name, np.arange(12.0))
    elif name == "pickle.npy":
        np.save(tmp_path / name, np.array([{"x": 1}], object), allow_pickle=True)
    else:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=says) as caught:
        read_cloud(tmp_path / name)
    assert str(tmp_path / name) in str(caught.value)


@pytest.mark.parametrize("name", ["a.las", "a.e57"])
def test_a_reader_that_is_not_installed_is_named(tmp_path, monkeypatch, name):
    (tmp_path / name).write_bytes(b"x")
    monkeypatch.setitem(__import__("sys").modules, "laspy", None)
    monkeypatch.setitem(__import__("sys").modules, "pye57", None)
    with pytest.raises(InputError, match=r"pip install 'packetmesh\[clouds\]'"):
        read_cloud(tmp_path / name)
