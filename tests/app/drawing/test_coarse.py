"""Coarse copies of meshes."""

import io

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial import cKDTree

from app.drawing.coarse import CELLS, STEPS, coarse_glb, is_mesh
from app.drawing.glb import lines_glb, mesh_glb, textured_glb
from tests.app.gltf import arrays, srgb

SPHERE = trimesh.creation.icosphere(subdivisions=6)
VERTICES, FACES = np.asarray(SPHERE.vertices), np.asarray(SPHERE.faces)
SIDES = np.where(VERTICES[:, :1] > 0, [[250, 10, 90]], [[0, 200, 30]]).astype(np.uint8)


def test_a_coarse_sphere_has_few_triangles_near_the_surface_and_looks_outwards():
    _, read = arrays(coarse_glb(mesh_glb(VERTICES, FACES, SIDES)))
    places = read["POSITION"]
    assert len(read["indices"]) < 0.3 * len(FACES)
    moved = 0.5 * np.sqrt(3) * 2 / (CELLS * STEPS)
    assert np.abs(np.linalg.norm(places, axis=1) - 1.0).max() < moved + 1e-3
    a, b, c = places[read["indices"]].swapaxes(0, 1)
    outwards = np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > 0
    assert outwards.mean() > 0.96  # a triangle of three far cells may turn over
    assert np.linalg.norm(np.concatenate([a - b, b - c, c - a]), axis=1).max() < 4 * 2 * np.sqrt(3) / CELLS
    assert trimesh.Trimesh(places, read["indices"]).area == pytest.approx(4 * np.pi, rel=0.05)


def test_vertices_are_vertices_of_the_mesh_but_for_their_steps():
    far = np.array([7.0, -3.0, 0.5])
    _, read = arrays(coarse_glb(mesh_glb(VERTICES + far, FACES, SIDES)))
    distance, _ = cKDTree(VERTICES + far).query(read["POSITION"], p=np.inf)
    assert distance.max() <= 0.5 * 2 / (CELLS * STEPS) + 2e-4
    assert distance.max() > 0.4 * 2 / (CELLS * STEPS)


def test_vertices_keep_their_colours():
    _, read = arrays(coarse_glb(mesh_glb(VERTICES, FACES, SIDES)))
    colors = np.rint(255 * srgb(read["COLOR_0"][:, :3]))
    right = read["POSITION"][:, 0] > 1e-2
    assert np.all(colors[right] == [250, 10, 90])
    assert np.all(colors[read["POSITION"][:, 0] < -1e-2] == [0, 200, 30])


def test_the_picture_becomes_colours_and_darker_vertices_stay_dark():
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:32], picture[32:] = (240, 240, 240), (60, 60, 60)
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "WEBP", lossless=True)
    uv = np.column_stack([np.full(len(VERTICES), 0.5), np.where(VERTICES[:, 2] > 0, 0.2, 0.8)])
    shade = np.where(VERTICES[:, :1] > 0, 255, 128).repeat(3, axis=1).astype(np.uint8)
    _, read = arrays(coarse_glb(textured_glb(VERTICES, FACES, shade, uv, file.getvalue(), 64)))
    assert "TEXCOORD_0" not in read
    x, _, z = read["POSITION"].T
    grey = np.rint(255 * srgb(read["COLOR_0"][:, 0]))
    for up, base in ((z > 0.01, 240), (z < -0.01, 60)):
        assert np.all(np.abs(grey[up & (x > 0.01)] - base) <= 1)
        linear = srgb_to_linear(base / 255) * srgb_to_linear(128 / 255)
        assert np.all(np.abs(grey[up & (x < -0.01)] - 255 * srgb(65535 * linear)) <= 1.5)


def srgb_to_linear(value):
    return ((value + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize("scale", [1e-4, 1.0, 400.0])
def test_any_size_is_thinned(scale):
    _, read = arrays(coarse_glb(mesh_glb(scale * VERTICES, FACES, SIDES)))
    assert 100 < len(read["indices"]) < 0.3 * len(FACES)


def test_where_nothing_is_left_the_mesh_itself_is_its_coarse_copy():
    far = np.vstack([VERTICES, [[1e4, 0, 0]]])
    glb = mesh_glb(far, FACES, np.vstack([SIDES, SIDES[:1]]))
    assert coarse_glb(glb) == glb


def test_only_meshes_have_one():
    assert is_mesh(mesh_glb(VERTICES, FACES, SIDES))
    assert not is_mesh(lines_glb(np.zeros((3, 2, 3)), (0, 0, 0)))
    assert not is_mesh(b"\xff\xd8")
    assert not is_mesh(VERTICES)
    assert not is_mesh(trimesh.Scene([SPHERE, SPHERE.copy()]).export(file_type="glb"))
