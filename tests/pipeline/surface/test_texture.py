"""Photographs on meshes: a wall whose colours are known, seen by cameras that stand anywhere."""

import io

import numpy as np
import pytest
import trimesh

from pipeline.io.meshes import read_mesh, write_mesh
from pipeline.kernels.geometry import apply, inverse, look_at, project
from pipeline.kernels.rays import Camera
from pipeline.surface.pictures import MISSED, MeshPainter, beside, mesh_picture
from pipeline.surface.texture import photographed
from pipeline.types import CameraIntrinsics, Surface

LENS = CameraIntrinsics.pinhole(200.0, 200.0, 159.5, 119.5, 320, 240)
LEFT = Camera(LENS, look_at((-1.0, -3.0, 1.0), (0.0, 0.0, 1.0)))
RIGHT = Camera(LENS, look_at((1.0, -3.0, 1.0), (0.0, 0.0, 1.0)))


def grid(corner_m, u_m, v_m, count=20):
    """A rectangle of 2 x count² triangles."""
    steps = np.linspace(0.0, 1.0, count + 1)
    places = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices_m = np.array(corner_m) + places @ np.array([u_m, v_m], float)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).reshape(-1)
    a, b, c, d = first, first + count + 1, first + count + 2, first + 1
    return Surface(
        vertices_m, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    )


WALL = grid((-0.8, 0.0, 0.4), (1.6, 0.0, 0.0), (0.0, 0.0, 1.2))


def painting(points_m):
    """(..., 3) colours of the wall: they change slowly and nowhere repeat."""
    x, z = points_m[..., 0] + 1.0, points_m[..., 2]
    return np.stack([40.0 + 80.0 * x, 60.0 + 60.0 * z, 220.0 - 50.0 * x * z], axis=-1)


def photograph(camera, exposure=1.0):
    """Of the wall's plane."""
    rows, columns = np.indices((240, 320)).astype(float)
    rays = np.stack([(columns - 159.5) / 200.0, (rows - 119.5) / 200.0, np.ones_like(rows)], axis=-1)
    rays = rays @ camera.T_world_camera[:3, :3].T
    origin = camera.T_world_camera[:3, 3]
    points = origin + rays * (-origin[1] / rays[..., 1])[..., None]
    return np.clip(exposure * painting(points), 0, 255).astype(np.uint8)


def worn(surface, texture):
    """(F, 3) colours in the middle of each triangle, as a renderer takes them."""
    corners = texture.corners(surface.triangles)
    height, width = texture.image.shape[:2]
    column, row = (corners.uv[corners.triangles].mean(axis=1) * (width, height) - 0.5).T
    return texture.image[np.rint(row).astype(int), np.rint(column).astype(int)].astype(float)


def expected(surface):
    return painting(surface.vertices_m[surface.triangles].mean(axis=1))


@pytest.mark.parametrize("cameras", [(LEFT,), (LEFT, RIGHT), (RIGHT, LEFT, RIGHT)])
def test_a_wall_wears_the_colours_that_it_has(cameras):
    texture = photographed(WALL, cameras, [(photograph(camera), None) for camera in cameras])
    assert (texture.camera >= 0).all()
    np.testing.assert_allclose(worn(WALL, texture), expected(WALL), atol=4.0)


def test_a_vertex_lies_where_its_camera_sees_it():
    """One photograph begins in the upper left corner; pixel 0 is half a pixel from the image's edge."""
    texture = photographed(WALL, [LEFT], [(photograph(LEFT), None)])
    pixels = project(LENS, apply(inverse(LEFT.T_world_camera), WALL.vertices_m))
    height, width = texture.image.shape[:2]
    np.testing.assert_allclose(texture.uv[0] * (width, height), pixels + 0.5, atol=1e-3)


def test_the_camera_that_stands_before_it_is_taken_and_patches_are_whole():
    cameras = LEFT, RIGHT
    texture = photographed(WALL, cameras, [(photograph(camera), None) for camera in cameras])
    x = WALL.vertices_m[WALL.triangles].mean(axis=1)[:, 0]
    assert (texture.camera[x < -0.2] == 0).all()
    assert (texture.camera[x > 0.2] == 1).all()


def test_what_one_camera_cannot_see_takes_the_other():
    """A board hides a part of the wall from the left camera only."""
    board = grid((-0.75, -1.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.0, 2.0), 4)
    scene = Surface(
        np.concatenate([WALL.vertices_m, board.vertices_m]),
        np.concatenate([WALL.triangles, board.triangles + len(WALL.vertices_m)]),
    )
    pictures = [(photograph(camera), None) for camera in (LEFT, RIGHT)]
    for rgb, _ in pictures[:1]:
        rgb[:] = 255  # the board fills its picture
    texture = photographed(scene, [LEFT, RIGHT], pictures)
    middles = scene.vertices_m[scene.triangles].mean(axis=1)
    through = LEFT.T_world_camera[:3, 3]
    share = (-1.0 - through[1]) / (middles[:, 1] - through[1])
    x_at_board = through[0] + share * (middles[:, 0] - through[0])
    hidden = (np.arange(len(middles)) < len(WALL.triangles)) & (np.abs(x_at_board + 0.55) < 0.15)
    assert hidden.sum() > 40
    assert (texture.camera[hidden] != 0).all()


def triangle_at(x_m, z_m):
    """A small one on the wall."""
    corners_m = np.array([[-0.04, 0.0, -0.02], [0.04, 0.0, -0.02], [0.0, 0.0, 0.04]])
    return Surface(corners_m + np.array([x_m, 0.0, z_m]), np.array([[0, 1, 2]], np.int32))


def chosen(surface, *places_m):
    """Of cameras there that look at the wall's middle, which each triangle takes."""
    cameras = [Camera(LENS, look_at(place_m, (0.0, 0.0, 1.0))) for place_m in places_m]
    return photographed(surface, cameras, [(np.zeros((240, 320, 3), np.uint8), None)] * len(cameras)).camera


@pytest.mark.parametrize(("cosine", "taken"), [(0.65, 1), (0.5, 0)])
def test_pixels_for_an_area_go_with_the_cosine_over_the_square_of_the_distance(cosine, taken):
    """1 / 2^2 = 0.25 straight before it, and 0.65 / 1.5^2 = 0.29 or 0.5 / 1.5^2 = 0.22 from beside."""
    beside_m = 1.5 * np.sqrt(1.0 - cosine**2), -1.5 * cosine, 1.0
    assert chosen(triangle_at(0.0, 1.0), (0.0, -2.0, 1.0), beside_m).tolist() == [taken]


@pytest.mark.parametrize(("first_column", "taken"), [(161, 1), (162, 0)])
def test_beside_the_rim_of_what_stands_before_it_another_camera_is_taken(first_column, taken):
    """The triangle's middle is at pixel (160, 120), and a board hides all from a column on its right on."""
    edge_m = (first_column - 0.5 - 159.5) / 200.0
    board = grid((edge_m, -1.0, 0.5), (0.5, 0.0, 0.0), (0.0, 0.0, 1.0), 1)
    wall = triangle_at(0.005, 0.995)
    scene = Surface(
        np.concatenate([wall.vertices_m, board.vertices_m]),
        np.concatenate([wall.triangles, board.triangles + 3]).astype(np.int32),
    )
    before_m, beside_m = (0.0, -2.0, 1.0), (-2.4, -1.8, 1.0)
    assert chosen(scene, before_m, beside_m)[0] == taken
    assert chosen(scene, before_m)[0] == 0


def test_what_nobody_sees_has_no_photograph_and_is_white():
    away = Camera(LENS, look_at((0.0, -3.0, 1.0), (0.0, -6.0, 1.0)))
    texture = photographed(WALL, [away], [(photograph(LEFT), None)])
    assert (texture.camera == -1).all()
    assert (worn(WALL, texture) == 255).all()
    assert not texture.corners(WALL.triangles).seen.any()


def test_pixels_that_were_lost_are_not_worn():
    known = np.zeros((240, 320), bool)
    known[:, 160:] = True
    texture = photographed(WALL, [LEFT], [(photograph(LEFT), known)])
    pixels = project(LENS, apply(inverse(LEFT.T_world_camera), WALL.vertices_m))
    right = (pixels[WALL.triangles][..., 0] >= 160.5).all(axis=1)
    left = (pixels[WALL.triangles][..., 0] < 159.5).any(axis=1)
    assert (texture.camera[right] == 0).all()
    assert (texture.camera[left] == -1).all()


def test_exposures_are_evened():
    cameras = LEFT, RIGHT
    texture = photographed(WALL, cameras, [(photograph(LEFT, 0.7), None), (photograph(RIGHT), None)])
    ratio = np.log(worn(WALL, texture) / expected(WALL)).mean(axis=1)
    seam = abs(ratio[texture.camera == 0].mean() - ratio[texture.camera == 1].mean())
    assert seam < 0.05 < abs(np.log(0.7))


def test_large_photographs_are_made_smaller_and_stay_right():
    lens = CameraIntrinsics.pinhole(2000.0, 2000.0, 1599.5, 1199.5, 3200, 2400)
    cameras = [Camera(lens, camera.T_world_camera) for camera in (LEFT, RIGHT)]
    pictures = [(photograph(camera).repeat(10, axis=0).repeat(10, axis=1), None) for camera in (LEFT, RIGHT)]
    texture = photographed(WALL, cameras, pictures)
    assert max(texture.image.shape) <= 4096
    np.testing.assert_allclose(worn(WALL, texture), expected(WALL), atol=5.0)


def test_a_mesh_without_triangles_has_nothing_to_wear():
    empty = Surface(np.empty((0, 3)), np.empty((0, 3), np.int32))
    assert photographed(empty, [LEFT], [(photograph(LEFT), None)]).camera.shape == (0,)


def test_a_picture_from_beside_shows_the_wall_in_its_colours():
    texture = photographed(WALL, [LEFT], [(photograph(LEFT), None)])
    view = beside(LEFT, WALL)
    assert np.linalg.norm(view.T_world_camera[:3, 3] - LEFT.T_world_camera[:3, 3]) > 0.5
    seen = mesh_picture(WALL, view, texture=texture)
    hit = (seen != MISSED).any(axis=-1)
    assert 0.05 < hit.mean() < 0.9
    np.testing.assert_allclose(seen[hit], photograph(view)[hit], atol=6.0)


def test_a_glb_file_wears_it(tmp_path):
    """Another library's reader finds the same picture at the same places."""
    texture = photographed(WALL, [LEFT], [(photograph(LEFT), None)])
    write_mesh(tmp_path / "wall.glb", WALL, texture)
    (mesh,) = trimesh.load(io.BytesIO((tmp_path / "wall.glb").read_bytes()), "glb").geometry.values()
    picture = np.asarray(mesh.visual.material.baseColorTexture)
    middles = mesh.visual.uv[mesh.faces].mean(axis=1) * (1, -1) + (0, 1)
    column, row = (middles * picture.shape[1::-1] - 0.5).round().astype(int).T
    np.testing.assert_allclose(picture[row, column, :3], expected(WALL), atol=8.0)
    back = read_mesh(tmp_path / "wall.glb")
    assert len(back.triangles) == len(WALL.triangles)
    np.testing.assert_allclose(np.ptp(back.vertices_m, axis=0), np.ptp(WALL.vertices_m, axis=0), atol=1e-6)


def test_one_painter_makes_the_pictures_of_several_cameras():
    texture = photographed(WALL, [LEFT], [(photograph(LEFT), None)])
    painter = MeshPainter(WALL)
    for camera in (LEFT, RIGHT, LEFT):
        for how in ({"colored": True}, {"colored": False}, {"texture": texture}):
            assert np.array_equal(painter.picture(camera, **how), mesh_picture(WALL, camera, **how))
    assert not np.array_equal(painter.picture(LEFT), painter.picture(RIGHT))
