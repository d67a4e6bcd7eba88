import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from lab.training import blend, dataset
from lab.worlds.primitives import box, sphere
from lab.worlds.render import Renderer
from lab.worlds.scene import Light, Material, Part, Scene
from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, inverse, look_at, pixel_rays, project, rigid, rotation_exp
from pipeline.types import CameraIntrinsics

K = CameraIntrinsics.pinhole(260.0, 265.0, 150.0, 120.0, 304, 228)
CAMERA = look_at([1.2, -0.9, 1.3], [0.05, 0.1, 0.0]) @ rigid(
    rotation_exp(np.array([0.0, 0.0, 0.1])), np.zeros(3)
)
BLENDER = os.environ.get("PACKETMESH_BLENDER")
needs_blender = pytest.mark.skipif(
    BLENDER is None, reason="PACKETMESH_BLENDER names no Python that has bpy, so nothing can be path-traced"
)


def _waves(points_m, normals):
    """A smooth solid texture that differs from place to place, and tells above from below."""
    del normals
    return (0.5 + 0.4 * np.sin(4.0 * points_m)).astype(np.float32)


def _board(points_m, normals):
    """Black and white squares of 0.2 m."""
    del normals
    odd = np.floor(points_m[:, :2] / 0.2).sum(axis=1) % 2
    return np.where(odd[:, None] > 0.5, 0.8, 0.02).astype(np.float32) * np.ones(3, np.float32)


def _part(mesh, texture, T=None, **material):
    return Part(*mesh, Material(texture, **material), np.eye(4) if T is None else T, smooth=len(mesh[0]) > 8)


@pytest.fixture
def scene():
    turned = rigid(rotation_exp(np.array([0.2, -0.4, 0.7])), np.array([0.1, 0.2, 0.4]))
    parts = (
        _part(box((2.0, 2.0, 0.1)), _board, rigid(np.eye(3), np.array([0.0, 0.0, -0.05]))),
        _part(box((0.3, 0.2, 0.4)), _waves, turned, gloss=0.5),
        _part(sphere(0.2, 24), _waves, rigid(np.eye(3), np.array([-0.4, 0.2, 0.2])), emission=2.0),
    )
    light = Light(np.array([0.5, 0.2, 1.8]), np.array([2.0, 1.0, 0.5]), 0.1)
    return Scene("table", parts, (light,), np.array([0.1, 0.2, 0.3]), (CAMERA,), K)


@pytest.fixture
def room(scene, tmp_path):
    blend.write_exchange(tmp_path / "room.npz", scene, [(K, CAMERA), (K, np.eye(4))])
    with np.load(tmp_path / "room.npz") as stored:
        return dict(stored)


def test_the_exchange_file_says_what_the_scene_says(scene, room):
    first = 0
    finish = {0: (0.0, 0.0), 1: (0.5, 0.0), 2: (0.0, 2.0)}
    for k, part in enumerate(scene.parts):
        faces = slice(first, first + len(part.triangles))
        first = faces.stop
        corners = apply(part.T_world_part, part.vertices_m[part.triangles].reshape(-1, 3))
        stored = room["corners_m"][faces].reshape(-1, 3)
        np.testing.assert_allclose(stored, corners, atol=3.1e-4)
        for material in room["material"][faces]:
            assert (room["gloss"][material], room["emission"][material]) == finish[k]
    assert first == len(room["corners_m"])
    np.testing.assert_array_equal(room["light_position_m"], [[0.5, 0.2, 1.8]])
    np.testing.assert_array_equal(room["light_color"], [[2.0, 1.0, 0.5]])
    np.testing.assert_array_equal(room["light_size_m"], [0.1])
    np.testing.assert_array_equal(room["ambient"], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(room["matrix"], [K.matrix, K.matrix])
    np.testing.assert_array_equal(room["T_world_camera"], [CAMERA, np.eye(4)])
    np.testing.assert_array_equal(room["size_px"], [304, 228])


def test_corner_normals_point_out_of_their_solid(scene, room):
    ball = slice(-len(scene.parts[2].triangles), None)
    corners = room["corners_m"][ball]
    outwards = (corners - [-0.4, 0.2, 0.2]) / 0.2
    np.testing.assert_allclose(room["corner_normals"][ball], outwards, atol=0.05)
    up = room["corner_normals"][:12] @ [0.0, 0.0, 1.0] > 0.99
    assert up.all(axis=1).sum() == 2


def test_every_place_finds_its_own_colour_in_the_image(scene, room):
    rng = np.random.default_rng(0)
    atlas = cv2.imdecode(room["atlas_png"], cv2.IMREAD_COLOR)[..., ::-1]
    encoded = atlas.astype(np.float32) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    first = len(scene.parts[0].triangles)
    for part in scene.parts[1:]:
        weights = rng.dirichlet(np.ones(3), (len(part.triangles), 20))
        uv = np.einsum("fnc,fck->fnk", weights, room["uv"][first : first + len(part.triangles)])
        places = np.einsum("fnc,fck->fnk", weights, part.vertices_m[part.triangles]).reshape(-1, 3)
        x = uv[..., 0].astype(np.float32) * atlas.shape[1] - 0.5
        y = (1.0 - uv[..., 1]).astype(np.float32) * atlas.shape[0] - 0.5
        found = cv2.remap(linear.astype(np.float32), x, y, cv2.INTER_LINEAR).reshape(-1, 3)
        np.testing.assert_allclose(found, _waves(places, places), atol=0.012)
        first += len(part.triangles)


def test_what_cameras_see_from_near_has_finer_texels(scene):
    counts = [len(part.triangles) for part in scene.parts]
    covered_m = np.full(sum(counts), np.inf)
    coarse = blend.unwrap(scene, covered_m)[1]
    covered_m[:12] = 0.0056
    fine = blend.unwrap(scene, covered_m)[1]
    texels = 2.0 * 2.0 * (1.0 / 0.004**2 - 1.0 / 0.03**2)
    assert (fine > 0).all(axis=2).sum() - (coarse > 0).all(axis=2).sum() > 1.9 * texels


def test_cameras_that_blender_cannot_have_are_refused(scene, tmp_path):
    distorted = CameraIntrinsics(K.matrix, np.array([0.1, 0.0, 0.0, 0.0, 0.0]), 304, 228)
    other = CameraIntrinsics(K.matrix, np.zeros(5), 320, 240)
    for cameras, reason in (([], "No camera"), ([distorted], "distortion"), ([K, other], "sizes")):
        with pytest.raises(InputError, match=reason):
            blend.write_exchange(tmp_path / "no.npz", scene, [(camera, CAMERA) for camera in cameras])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("blender", "reason"), [("/nowhere/python", "does not start"), ("false", "no message")]
)
def test_a_python_without_blender_is_one_sentence(scene, blender, reason):
    with pytest.raises(InputError, match=reason):
        blend.trace(scene, [(K, CAMERA)], Path(blender))


@pytest.fixture
def small_shards(monkeypatch):
    monkeypatch.setattr(dataset, "ROOMS_PER_SHARD", 2)
    seeds = []

    def views(seed, **_):
        seeds.append(seed)
        yield np.full((240, 320, 3), seed % 251, np.uint8), np.full((240, 320), 2.0, np.float16)

    monkeypatch.setattr(blend, "traced_views", views)
    return seeds


def test_shards_are_found_beside_ray_cast_ones_and_not_rendered_twice(small_shards, tmp_path):
    first = list(blend.render_traced(tmp_path, "train", 0, 1, Path("python")))
    assert [file.name for file in first] == ["train_traced_0000_rgb.npy"]
    again = list(blend.render_traced(tmp_path, "train", 0, 2, Path("python")))
    assert [file.name for file in again] == ["train_traced_0000_rgb.npy", "train_traced_0001_rgb.npy"]
    assert small_shards == [500_000, 500_001, 500_002, 500_003]
    shards = dataset.Shards(tmp_path, "train")
    assert len(shards) == 4
    rgb, depth_m = shards[3]
    assert rgb.max() == rgb.min() == 500_003 % 251
    assert np.all(depth_m == 2.0)
    assert len(list(tmp_path.iterdir())) == 4


def test_an_interrupted_shard_is_done_again(small_shards, tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(blend, "traced_views", interrupted)
        shards = blend.render_traced(tmp_path, "train", 0, 1, Path("python"))
        with pytest.raises(KeyboardInterrupt):
            next(shards)
    assert len(dataset.Shards(tmp_path, "train")) == 0
    assert len(list(blend.render_traced(tmp_path, "train", 0, 1, Path("python")))) == 1
    assert small_shards == [500_000, 500_001]


@needs_blender
def test_a_checkerboards_corners_appear_where_the_camera_projects_them(scene, monkeypatch):
    monkeypatch.setattr(blend, "_COARSEST_M", 0.002)
    monkeypatch.setattr(blend, "_CHART_TEXELS", 2_000_000)
    alone = Scene("board", scene.parts[:1], scene.lights, scene.ambient, (), K)
    light = blend.trace(alone, [(K, CAMERA)], Path(BLENDER), 64)[0]
    grey = np.clip(255.0 * light.mean(axis=2) / np.percentile(light, 98), 0, 255).astype(np.uint8)
    grid = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3)), axis=-1).reshape(-1, 2) * 0.2
    expected = project(K, apply(inverse(CAMERA), np.column_stack([grid, np.zeros(len(grid))])))
    start = (expected + np.array([1.5, -1.5]))[:, None].astype(np.float32)
    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-3)
    found = cv2.cornerSubPix(grey, start, (4, 4), (-1, -1), criteria)[:, 0]
    assert np.linalg.norm(found - expected, axis=1).max() < 0.25


@needs_blender
def test_light_is_as_bright_as_in_our_own_renderer_and_outlines_lie_on_depth_steps(scene):
    light = blend.trace(scene, [(K, CAMERA)], Path(BLENDER), 32)[0]
    z_m, part = Renderer(scene, 1).parts_seen(K, CAMERA)
    assert np.isnan(z_m).any()
    sky = light[part < 0]
    assert np.median(np.abs(sky - scene.ambient), axis=0).max() < 0.01
    glow = light[part == 2].mean(axis=0)
    assert np.all(glow > 0.5)
    inner = cv2.erode((part == 2).astype(np.uint8), np.ones((5, 5))) > 0
    outer = (cv2.dilate((part == 2).astype(np.uint8), np.ones((5, 5))) == 0) & (part < 0)
    assert light[inner].mean(axis=1).min() > 1.2 * light[outer].mean(axis=1).max()


@needs_blender
def test_two_slabs_in_one_place_are_as_bright_under_a_lamp_as_one_must_be():
    white = _part(box((2.0, 2.0, 0.1)), lambda points_m, _: np.full((len(points_m), 3), 0.5, np.float32))
    lamp = Light(np.array([0.0, 0.0, 3.0]), np.full(3, 4.0), 0.05)
    alone = Scene("slab", (white, white), (lamp,), np.zeros(3), (), K)
    above = look_at([0.01, 0.0, 2.0], [0.0, 0.0, 0.0])
    light = blend.trace(alone, [(K, above)], Path(BLENDER))[0]
    points_m = pixel_rays(K).reshape(-1, 3) @ above[:3, :3].T
    points_m = above[:3, 3] + points_m * ((0.05 - above[2, 3]) / points_m[:, 2:])
    away_m = np.linalg.norm(points_m - lamp.position_m, axis=1)
    expected = (0.5 * 4.0 * (3.0 - 0.05) / away_m**3).reshape(228, 304)
    inside = (np.abs(points_m[:, :2]).max(axis=1) < 0.95).reshape(228, 304)
    assert inside.mean() > 0.5
    np.testing.assert_allclose(light[inside].mean(axis=1), expected[inside], rtol=0.04)
