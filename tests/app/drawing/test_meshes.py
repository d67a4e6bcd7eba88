"""Surfaces as the browser gets them."""

import io

import numpy as np
import pytest
import trimesh

from app.drawing.glb import lines_glb, mesh_glb, textured_glb
from app.drawing.meshes import DARKEST, mesh_view, rim_segments_m, surface_glb, vertex_normals
from app.drawing.ordering import reordered
from pipeline.quality import SurfaceQuality
from pipeline.types import SurfaceResult
from tests.app.gltf import arrays, srgb

SPHERE = trimesh.creation.icosphere()
QUALITY = SurfaceQuality(0.0, 0, 0.0, 0.0, 0, 0, 0.0, 0)


def surface(mesh, colors=None):
    return SurfaceResult(
        np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32), colors, (0.1,), quality=QUALITY
    )


def test_a_closed_surface_has_no_rim():
    assert len(rim_segments_m(surface(trimesh.creation.icosphere()))) == 0


def test_the_rim_of_an_open_box_is_its_opening():
    box = trimesh.creation.box()
    top = np.all(box.vertices[box.faces][:, :, 2] > 0, axis=1)
    box.update_faces(~top)
    rim_m = rim_segments_m(surface(box))
    assert np.isclose(np.linalg.norm(rim_m[:, 0] - rim_m[:, 1], axis=1).sum(), 4.0)
    assert np.all(rim_m[..., 2] == 0.5)


def test_the_mesh_survives_the_way_to_the_browser():
    sphere = trimesh.creation.icosphere()
    colors = np.random.default_rng(0).integers(0, 255, (len(sphere.vertices), 3), dtype=np.uint8)
    glb = mesh_glb(np.asarray(sphere.vertices), np.asarray(sphere.faces), colors)
    mode, read = arrays(glb)
    assert mode == 4
    order, _ = reordered(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    assert np.abs(read["POSITION"] - sphere.vertices[order]).max() < 1e-4
    assert np.array_equal(np.rint(255 * srgb(read["COLOR_0"][:, :3])), colors[order])
    assert_same_triangles(order[read["indices"]], sphere.faces)
    others = trimesh.load(io.BytesIO(glb), file_type="glb", force="mesh", process=False)
    assert_same_triangles(order[others.faces], sphere.faces)
    assert np.abs(others.vertices - sphere.vertices[order]).max() < 1e-4


@pytest.mark.parametrize(("scale", "off_m"), [(0.01, 1e-6), (1.0, 1e-4), (6.5, 1e-4), (7.0, 1e-6)])
def test_a_vertex_is_at_most_a_tenth_of_a_millimetre_off(scale, off_m):
    vertices = scale * np.asarray(SPHERE.vertices) + 40.0
    read = arrays(mesh_glb(vertices, np.asarray(SPHERE.faces), np.zeros((len(vertices), 3), np.uint8)))[1]
    floats_m = 40.0 * 2.0**-22
    order, _ = reordered(vertices, np.asarray(SPHERE.faces))
    assert np.abs(read["POSITION"] - vertices[order]).max() <= 1.001 * off_m + floats_m


def test_equal_vertices_are_one_place():
    three = np.full((3, 3), 0.7)
    read = arrays(mesh_glb(three, np.array([[0, 1, 2]]), np.zeros((3, 3), np.uint8)))[1]
    assert np.allclose(read["POSITION"], 0.7, atol=1e-12)


def assert_same_triangles(one, other):
    turned = [
        sorted(min(row[turn:] + row[:turn] for turn in range(3)) for row in np.asarray(triangles).tolist())
        for triangles in (one, other)
    ]
    assert turned[0] == turned[1]


def test_light_comes_from_above_and_darkens_no_photograph_by_much():
    sphere = trimesh.creation.icosphere()
    white = np.full((len(sphere.vertices), 3), 255, np.uint8)
    for photographed, darkest in DARKEST.items():
        read = arrays(surface_glb(surface(sphere, white), white, photographed))[1]
        shade = srgb(read["COLOR_0"][:, 0])
        assert np.isclose(shade.min(), darkest, atol=0.01)
        assert np.isclose(shade.max(), 1.0, atol=0.01)
        assert read["POSITION"][np.argmax(shade), 2] > 0.95


def test_normals_of_a_surface_without_points_normals_are_those_of_its_triangles():
    sphere = trimesh.creation.icosphere(subdivisions=4)
    normals = vertex_normals(surface(sphere))
    assert np.sum(normals * sphere.vertices, axis=1).min() > 0.999


def test_lines_survive_the_way_to_the_browser():
    segments_m = np.random.default_rng(0).uniform(-1, 1, (7, 2, 3)).astype(np.float32)
    mode, read = arrays(lines_glb(segments_m, (213, 40, 30)))
    assert mode == 1
    assert np.abs(read["POSITION"][read["indices"]] - segments_m).max() <= 1e-4


def test_points_where_lines_meet_are_sent_once():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    _, read = arrays(lines_glb(np.stack([square, np.roll(square, -1, axis=0)], axis=1), (1, 2, 3)))
    assert np.abs(read["POSITION"] - square).max() <= 1e-4
    assert read["indices"].tolist() == [[0, 1], [1, 2], [2, 3], [3, 0]]


def test_rims_follow_each_other_around_each_hole():
    sphere = trimesh.creation.icosphere(subdivisions=3)
    kept = np.all(np.abs(sphere.vertices[sphere.faces][:, :, 2]) < 0.7, axis=1)
    sphere.update_faces(kept)
    rim_m = rim_segments_m(surface(sphere))
    _, faces = np.unique(np.sort(sphere.edges, axis=1), axis=0, return_counts=True)
    assert len(rim_m) == np.sum(faces == 1)
    follows = np.all(rim_m[1:, 0] == rim_m[:-1, 1], axis=1)
    assert np.sum(~follows) == 1  # from the hole above to that below


@pytest.mark.parametrize("side_px", [64, 1280, 20_000, 400_000])
def test_texture_coordinates_are_at_most_a_tenth_of_a_pixel_off(side_px):
    uv = np.random.default_rng(0).uniform(0.0, 1.0, (len(SPHERE.vertices), 2))
    uv[:2] = [[0.0, 1.0], [1.0, 0.0]]
    colors = np.zeros((len(uv), 3), np.uint8)
    places, faces = np.asarray(SPHERE.vertices), np.asarray(SPHERE.faces)
    _, read = arrays(textured_glb(places, faces, colors, uv, b"picture", side_px))
    order, _ = reordered(places, faces)
    off_px = side_px * np.abs(read["TEXCOORD_0"] / 65535.0 - uv[order])
    inside = np.all((uv[order] > 0.0) & (uv[order] < 0.999), axis=1)
    assert off_px[inside].max() <= max(0.1, 0.5 * side_px / 65535) + 1e-6
    assert off_px.max() <= max(0.2, side_px / 65535)


def test_a_surface_without_triangles_is_empty():
    empty = SurfaceResult(np.empty((0, 3)), np.empty((0, 3), np.int32), None, (0.1,), quality=QUALITY)
    view = mesh_view(empty, None)
    assert view.glb == view.rims_glb == b""
