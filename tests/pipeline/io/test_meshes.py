"""Meshes come back with their triangles, whatever the format."""

import json

import numpy as np
import pytest
import trimesh

from pipeline.io.meshes import read_mesh, write_mesh
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


def test_an_stl_keeps_its_triangles_and_joins_its_vertices_but_has_no_colours(tmp_path, sphere):
    colors = np.full((len(sphere.vertices), 3), 77, np.uint8)
    write_mesh(tmp_path / "mesh.stl", Surface(sphere.vertices, sphere.faces, colors))
    again = read_mesh(tmp_path / "mesh.stl")
    assert again.colors is None
    assert again.vertices_m.shape == sphere.vertices.shape
    original = Surface(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    assert by_position(again)[1] == by_position(original)[1]
    assert (tmp_path / "mesh.stl").stat().st_size == 84 + 50 * len(sphere.faces)
