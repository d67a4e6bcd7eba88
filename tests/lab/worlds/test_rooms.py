"""Random rooms are closed, furnished and varied; the box room has the geometry of SPEC 4.8."""

import numpy as np
import pytest

from lab.worlds.boxes import box_room
from lab.worlds.pieces.stock import stocked
from lab.worlds.raycast import world_mesh
from lab.worlds.render import Renderer
from lab.worlds.rooms import random_room
from lab.worlds.viewpoints import random_views
from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, inverse, pixel_rays, project, rotation_angle_rad, scaled


@pytest.mark.parametrize("seed", range(6))
def test_cameras_stand_inside_a_closed_furnished_room(seed: int) -> None:
    scene = random_room(seed)
    renderer = Renderer(scene)
    low, high = (corner(world_mesh(scene)[0], axis=0) for corner in (np.min, np.max))
    views = random_views(scene, np.random.default_rng(seed), 6, renderer)
    assert len(views) == 6
    for camera in (*scene.cameras, *views):
        assert np.all(camera[:3, 3] > low + 0.1)
        assert np.all(camera[:3, 3] < high - 0.1)
        np.testing.assert_allclose(camera[:3, :3] @ camera[:3, :3].T, np.eye(3), atol=1e-12)
        z_m = renderer.depth(scaled(scene.intrinsics, 0.125), camera)
        assert np.all(np.isfinite(z_m))
        assert np.percentile(z_m, 2.0) > 0.25
        assert 0.4 < np.median(z_m) < 7.5
    assert len(scene.parts) > 20
    assert 1 <= len(scene.lights) <= 4


def test_rooms_repeat_by_seed_and_differ_between_seeds() -> None:
    first, again, other = random_room(11), random_room(11), random_room(12)
    for a, b in zip(world_mesh(first), world_mesh(again), strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(first.cameras[0], again.cameras[0])
    views = [
        Renderer(scene).view(
            scaled(scene.intrinsics, 0.25), scene.cameras[0], "fast", np.random.default_rng(0)
        )
        for scene in (first, again, other)
    ]
    np.testing.assert_array_equal(views[0].rgb, views[1].rgb)
    assert np.mean(np.abs(views[0].z_m - views[2].z_m)) > 0.1


def test_rooms_do_not_depend_on_what_was_built_before() -> None:
    random_room(21)
    after = random_room(22)
    stocked.cache_clear()
    fresh = random_room(22)
    for a, b in zip(world_mesh(after), world_mesh(fresh), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_scene_without_room_for_cameras_says_so() -> None:
    scene = random_room(0)
    with pytest.raises(InputError, match=r"too little free space for the requested cameras \(1\)"):
        random_views(scene, np.random.default_rng(0), 1, _BlindRenderer(scene))


class _BlindRenderer(Renderer):
    """A renderer before whose lens something always sits."""

    def parts_seen(self, intrinsics, T_world_camera):  # type: ignore[no-untyped-def]
        z_m, part = super().parts_seen(intrinsics, T_world_camera)
        return np.full_like(z_m, 0.1), part


@pytest.mark.parametrize("seed", range(4))
def test_box_room_cameras_are_25_degrees_and_a_metre_apart_and_share_most_of_the_view(seed: int) -> None:
    scene = box_room(seed)
    first, second = scene.cameras
    T = inverse(second) @ first
    assert np.degrees(rotation_angle_rad(T[:3, :3])) == pytest.approx(25.0, abs=0.5)
    assert np.linalg.norm(first[:3, 3] - second[:3, 3]) == pytest.approx(1.0, abs=1e-9)
    renderer = Renderer(scene)
    z_a, z_b = (renderer.depth(scene.intrinsics, camera) for camera in scene.cameras)
    assert np.all(np.isfinite([z_a, z_b]))
    points = apply(T, (pixel_rays(scene.intrinsics) * z_a[..., None]).reshape(-1, 3))
    u, v = np.rint(project(scene.intrinsics, points)).astype(int).T
    inside = (u >= 0) & (u < 320) & (v >= 0) & (v < 240)
    seen = np.abs(z_b[v[inside], u[inside]] - points[inside, 2]) < 0.03
    assert 0.5 < seen.sum() / len(points) < 0.8


@pytest.mark.parametrize(
    ("nodes", "angle_deg", "baseline_m"), [(1, 25.0, 1.0), (3, 15.0, 0.6), (6, 40.0, 1.5)]
)
def test_box_room_takes_other_rigs(nodes: int, angle_deg: float, baseline_m: float) -> None:
    scene = box_room(5, nodes, angle_deg, baseline_m)
    renderer = Renderer(scene)
    assert len(scene.cameras) == nodes
    for camera in scene.cameras:
        z_m = renderer.depth(scene.intrinsics, camera)
        assert np.all(np.isfinite(z_m))
        assert np.median(z_m) > 0.5
    for a, b in zip(scene.cameras, scene.cameras[1:], strict=False):
        assert np.linalg.norm(a[:3, 3] - b[:3, 3]) == pytest.approx(baseline_m, abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [({"nodes": 0}, "nodes"), ({"angle_deg": 2.0}, "angle_deg"), ({"baseline_m": 9.0}, "baseline_m")],
)
def test_box_room_names_the_argument_out_of_range(arguments: dict, name: str) -> None:
    with pytest.raises(InputError, match=name):
        box_room(0, **arguments)
