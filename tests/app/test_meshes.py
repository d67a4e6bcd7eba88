"""Surfaces as the browser gets them."""

import io

import numpy as np
import trimesh

from app.jobs.meshes import glb_bytes, mesh_view, rim_segments_m
from pipeline.types import SurfaceQuality, SurfaceResult

QUALITY = SurfaceQuality(0.0, 0, 0.0, 0.0, 0, 0, 0.0, 0)


def surface(mesh, colors=None):
    return SurfaceResult(np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32), colors, (0.1,), QUALITY)


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
    read = trimesh.load(io.BytesIO(glb_bytes(surface(sphere, colors), colors)), file_type="glb", force="mesh")
    assert np.allclose(read.vertices, sphere.vertices, atol=1e-6)
    assert np.array_equal(read.faces, sphere.faces)
    assert np.array_equal(read.visual.vertex_colors[:, :3], colors)


def test_a_surface_without_triangles_is_empty():
    empty = SurfaceResult(np.empty((0, 3)), np.empty((0, 3), np.int32), None, (0.1,), QUALITY)
    view = mesh_view(empty, None)
    assert view.glb == b""
    assert len(view.rims_m) == 0
