"""Meshes come back with their triangles, whatever the format."""

import io
import json

import numpy as np
import pytest
import trimesh
from trimesh.exchange.gltf import export_glb, load_glb

from pipeline.io.clouds import read_cloud
from pipeline.io.meshes import read_mesh, write_mesh
from pipeline.io.textures import Texture
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import Surface


@pytest.fixture
def sphere() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=2, radius=3.0)


def by_position(mesh):
    """Vertices, and the triangles as a set of corner positions, both free of the order in the file."""
    order = np.lexsort(np.round(mesh.vertices_m, 4).T)
    corners = np.round(mesh.vertices_m[mesh.triangles], 4)
    first = np.array([np.lexsort(triangle.T)[0] for triangle in corners])
    turned = np.stack([np.roll(t, -k, axis=0) for t, k in zip(corners, first, strict=True)]) + 0.0
    return order, {tuple(triangle.ravel()) for triangle in turned}


@pytest.mark.parametrize("suffix", [".ply", ".glb", ".obj", ".PLY"])
@pytest.mark.parametrize("colored", [True, False])
def test_what_is_written_is_read(tmp_path, sphere, suffix, colored):
    path = tmp_path / f"mesh{suffix}"
    colors = np.random.default_rng(1).integers(0, 256, (len(sphere.vertices), 3), dtype=np.uint8)
    write_mesh(path, Surface(sphere.vertices, sphere.faces, colors if colored else None))
    again = read_mesh(path)
    original = Surface(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    (order, triangles), (original_order, original_triangles) = by_position(again), by_position(original)
    np.testing.assert_allclose(again.vertices_m[order], original.vertices_m[original_order], atol=1e-6)
    assert triangles == original_triangles
    if colored:
        np.testing.assert_array_equal(again.colors[order], colors[original_order])
    else:
        assert again.colors is None


def test_a_glb_stands_upright_in_other_viewers(tmp_path):
    """glTF's y axis is up: our z must arrive there."""
    vertices_m = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    write_mesh(tmp_path / "mesh.glb", Surface(vertices_m, np.array([[0, 1, 2]])))
    seen = trimesh.load_scene(tmp_path / "mesh.glb").to_mesh()
    assert seen.bounds[1].tolist() == [1.0, 2.0, 0.0]
    data = (tmp_path / "mesh.glb").read_bytes()
    assert json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])["asset"]["version"] == "2.0"


GREYS = np.array([0, 1, 10, 128, 200, 255], np.uint8)
LINEAR = np.array([0.0, 0.000304, 0.003035, 0.215861, 0.577580, 1.0])
"""Their linear light by IEC 61966-2-1: c / 12.92 up to 0.04045, then ((c + 0.055) / 1.055) ** 2.4."""
GREY = Surface(
    np.random.default_rng(3).normal(size=(6, 3)),
    np.array([[0, 1, 2], [3, 4, 5]], np.int32),
    np.repeat(GREYS[:, None], 3, axis=1),
)


def colors_in(path):
    """The numbers of COLOR_0 in a file of one mesh, as they are stored."""
    (part,) = load_glb(io.BytesIO(path.read_bytes()), skip_materials=True)["geometry"].values()
    return part["vertex_colors"]


def test_colours_of_a_glb_are_linear_light(tmp_path):
    """As glTF 2.0 says in 3.7.2.1, so that viewers show the surface's own colours."""
    write_mesh(tmp_path / "mesh.glb", GREY)
    stored = colors_in(tmp_path / "mesh.glb")
    assert stored.dtype == np.float32
    np.testing.assert_allclose(stored, np.repeat(LINEAR[:, None], 3, axis=1), atol=1e-6)


def test_colours_of_other_formats_are_as_they_were(tmp_path):
    for suffix in (".ply", ".obj"):
        write_mesh(tmp_path / f"mesh{suffix}", GREY)
        found = trimesh.load(tmp_path / f"mesh{suffix}", process=False).visual.vertex_colors
        np.testing.assert_array_equal(found[:, :3], GREY.colors)


def test_parts_without_a_photograph_have_their_colours_in_linear_light(tmp_path):
    """The others are white, by which the photograph is multiplied."""
    image, uv = np.zeros((8, 8, 3), np.uint8), np.full((1, 6, 2), 0.5, "f4")
    texture = Texture(image, np.array([0, -1], np.int32), uv)
    write_mesh(tmp_path / "mesh.glb", GREY, texture)
    stored = np.unique(colors_in(tmp_path / "mesh.glb")[:, 0])
    np.testing.assert_array_equal(stored, np.unique([*np.rint(255.0 * LINEAR[3:]), 255]))


def by_trimesh(path):
    mesh = trimesh.Trimesh(GREY.vertices_m, GREY.triangles, vertex_colors=GREY.colors, process=False)
    mesh.export(path)


def by_open3d(path):
    corners = o3d.utility.Vector3dVector(GREY.vertices_m), o3d.utility.Vector3iVector(GREY.triangles)
    mesh = o3d.geometry.TriangleMesh(*corners)
    mesh.vertex_colors = o3d.utility.Vector3dVector(GREY.colors / 255.0)
    o3d.io.write_triangle_mesh(str(path), mesh)


def by_the_standard(path):
    """16 bits of linear light."""
    linear = np.rint(65535 * np.repeat(LINEAR[:, None], 3, axis=1)).astype(np.uint16)
    mesh = trimesh.Trimesh(GREY.vertices_m, GREY.triangles, process=False)
    mesh.vertex_attributes["_C"] = np.column_stack([linear, np.full(6, 65535, np.uint16)])

    def name(document):
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        attributes["COLOR_0"] = attributes.pop("_C")
        document["asset"]["generator"] = "a modeller"

    path.write_bytes(export_glb(trimesh.Scene(mesh), tree_postprocessor=name))


@pytest.mark.parametrize("write", [by_trimesh, by_open3d, by_the_standard])
def test_colours_of_others_are_read_as_they_were_meant(tmp_path, write):
    """trimesh and Open3D store sRGB, and name themselves in the file."""
    write(tmp_path / "mesh.glb")
    np.testing.assert_array_equal(read_mesh(tmp_path / "mesh.glb").colors, GREY.colors)
    np.testing.assert_array_equal(read_cloud(tmp_path / "mesh.glb").colors, GREY.colors)


@pytest.mark.parametrize("colored", [True, False])
def test_lines_and_points_are_beside_the_triangles_of_a_modeller(tmp_path, colored):
    """Points may have colours or none; lines, which are no part of a surface, are left out."""

    def by_a_modeller(document):
        document["asset"]["generator"] = "a modeller"

    mesh = trimesh.Trimesh(GREY.vertices_m, GREY.triangles, process=False)
    light = np.repeat(np.rint(255.0 * LINEAR).astype(np.uint8)[:, None], 3, axis=1)
    points = trimesh.PointCloud(GREY.vertices_m, light if colored else None)
    for name, parts in (
        ("model", [mesh, trimesh.load_path(GREY.vertices_m[:3]), points]),
        ("points", points),
    ):
        glb = export_glb(trimesh.Scene(parts), tree_postprocessor=by_a_modeller)
        (tmp_path / f"{name}.glb").write_bytes(glb)
    np.testing.assert_array_equal(read_mesh(tmp_path / "model.glb").triangles, GREY.triangles)
    assert len(read_cloud(tmp_path / "model.glb")) == 6 + 6
    colors = read_cloud(tmp_path / "points.glb").colors
    if colored:
        np.testing.assert_allclose(colors[3:].astype(float), GREY.colors[3:], atol=1)
    else:
        assert colors is None


def test_an_stl_keeps_its_triangles_and_joins_its_vertices_but_has_no_colours(tmp_path, sphere):
    colors = np.full((len(sphere.vertices), 3), 77, np.uint8)
    write_mesh(tmp_path / "mesh.stl", Surface(sphere.vertices, sphere.faces, colors))
    again = read_mesh(tmp_path / "mesh.stl")
    assert again.colors is None
    assert again.vertices_m.shape == sphere.vertices.shape
    original = Surface(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    assert by_position(again)[1] == by_position(original)[1]
    assert (tmp_path / "mesh.stl").stat().st_size == 84 + 50 * len(sphere.faces)
