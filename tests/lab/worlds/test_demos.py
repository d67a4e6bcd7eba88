"""The demo scenes: shipped files agree with the procedural truth, and the nodes can work together."""

from pathlib import Path

import numpy as np
import pytest

from lab.worlds.board_files import load_board_views
from lab.worlds.box_on_table import BOX_M
from lab.worlds.demos import POSE_ERROR_M, POSE_ERROR_RAD, UNCALIBRATED, build_demo, disturbed, nodes_of
from lab.worlds.raycast import world_mesh
from lab.worlds.render import render
from lab.worlds.sensor import axial_sigma_m
from lab.worlds.staging import VGA
from packetmesh.errors import InputError
from pipeline.io.demos import CALIBRATED_SCENES, DEMO_SCENES, board_views_of, load_demo
from pipeline.io.rigs import load_rig, save_rig
from pipeline.kernels.geometry import apply, inverse, pixel_rays, project, rotation_angle_rad
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import CameraIntrinsics, Rig

SCENES = sorted(DEMO_SCENES)
NODES = 3
SHIPPED = Path(__file__).parents[3] / "assets" / "scenes"


@pytest.fixture(scope="module", params=SCENES)
def rig(request: pytest.FixtureRequest) -> Rig:
    return load_demo(request.param)


def test_unknown_name_lists_the_known() -> None:
    with pytest.raises(InputError, match=r"'kitchen'; try one of .*living-room.*box-on-table"):
        load_demo("kitchen")


@pytest.mark.parametrize("name", SCENES)
def test_scene_is_the_same_every_time(name: str) -> None:
    first, again = build_demo(name), build_demo(name)
    for a, b in zip(world_mesh(first), world_mesh(again), strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(first.cameras, again.cameras)


def test_rig_has_three_nodes_in_a_closed_room(rig: Rig) -> None:
    assert len(rig.frames) == NODES
    assert rig.truth is not None
    for frame, depth in zip(rig.frames, rig.truth.depth, strict=True):
        assert frame.rgb.shape == (480, 640, 3)
        np.testing.assert_array_equal(frame.intrinsics.matrix, VGA.matrix)
        assert depth.coverage == 1.0  # every ray ends at a wall at the latest


def test_cameras_are_inside_the_room_and_clear_of_furniture(rig: Rig) -> None:
    scene = o3d.t.geometry.RaycastingScene()
    mesh = rig.truth.vertices_m.astype(np.float32), rig.truth.triangles.astype(np.uint32)
    scene.add_triangles(*(o3d.core.Tensor(array) for array in mesh))
    way = np.random.default_rng(0).standard_normal((500, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for T in rig.truth.T_world_camera:
        rays = np.concatenate([np.tile(T[:3, 3], (500, 1)), way], axis=1).astype(np.float32)
        distance_m = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
        assert distance_m.min() > 0.3
        assert distance_m.max() < 7.0


def test_nodes_stand_apart_and_look_at_the_same_place(rig: Rig) -> None:
    poses = rig.truth.T_world_camera
    for node in range(1, NODES):
        between = inverse(poses[node - 1]) @ poses[node]
        assert np.degrees(rotation_angle_rad(between[:3, :3])) == pytest.approx(25.0, abs=4.0)
        assert 0.5 < np.linalg.norm(between[:3, 3]) < 1.1
        assert 0.4 < _shared(rig, node - 1, node) < 0.9


def _shared(rig: Rig, before: int, after: int) -> float:
    """Share of one node's true points that another sees."""
    rays = pixel_rays(rig.truth.intrinsics[after])
    points = (rays * rig.truth.depth[after].z_m[..., None])[::4, ::4].reshape(-1, 3)
    T_before_after = inverse(rig.truth.T_world_camera[before]) @ rig.truth.T_world_camera[after]
    points = apply(T_before_after, points)
    points = points[points[:, 2] > 0.1]
    u, v = np.rint(project(rig.truth.intrinsics[before], points)).astype(int).T
    inside = (u >= 0) & (u < 640) & (v >= 0) & (v < 480)
    seen_m = rig.truth.depth[before].z_m[v[inside], u[inside]]
    return float((np.abs(seen_m - points[inside, 2]) < 0.02 * seen_m).sum() / (rays[::4, ::4].size / 3))


def test_believed_poses_are_as_wrong_as_the_specification_says(rig: Rig) -> None:
    for node, (frame, T_true) in enumerate(zip(rig.frames, rig.truth.T_world_camera, strict=True)):
        turned = rotation_angle_rad(T_true[:3, :3].T @ frame.T_world_camera[:3, :3])
        shifted = np.linalg.norm(frame.T_world_camera[:3, 3] - T_true[:3, 3])
        assert turned == pytest.approx(POSE_ERROR_RAD if node else 0.0, abs=1e-6)
        assert shifted == pytest.approx(POSE_ERROR_M if node else 0.0, abs=1e-6)


def test_shipped_depth_has_holes_and_otherwise_the_sensor_noise(rig: Rig) -> None:
    for frame, truth, node in zip(rig.frames, rig.truth.depth, nodes_of(rig.name), strict=True):
        assert 0.65 < frame.depth.coverage < 0.95
        valid = frame.depth.valid
        true_m = truth.z_m[valid].astype(float)
        biased_m = node.bias.measured(truth).z_m[valid].astype(float)
        # Quantisation adds about 3 mm at 3 m (z^2 / (f b) x 1/8 px / sqrt(12)).
        quantum_m = true_m**2 / (525.0 * 0.075) * 0.125
        sigma_m = np.hypot(axial_sigma_m(true_m), quantum_m / np.sqrt(12.0))
        pull = (frame.depth.z_m[valid] - biased_m) / sigma_m
        assert abs(np.median(pull)) < 0.1
        assert np.median(np.abs(pull)) == pytest.approx(0.6745, rel=0.15)
        assert np.mean(np.abs(pull) > 6.0) < 0.03  # jitter and flying pixels at edges


def test_shipped_colours_show_the_scene(rig: Rig) -> None:
    for frame in rig.frames:
        gray = frame.rgb.mean(axis=2)
        assert 60.0 < gray.mean() < 190.0
        assert gray.std() > 30.0


@pytest.mark.parametrize("name", SCENES)
def test_shipped_files_are_small(name: str) -> None:
    pictures = sorted((SHIPPED / name).glob("node_*/color.png"))
    assert len(pictures) == NODES
    assert all(picture.stat().st_size < 700_000 for picture in pictures)


def test_only_one_demo_needs_calibration_and_its_boards_are_beside_it() -> None:
    assert set(DEMO_SCENES) - set(CALIBRATED_SCENES) == {UNCALIBRATED}
    assert all(board_views_of(name) is None for name in CALIBRATED_SCENES)
    assert board_views_of("kitchen") is None
    folder = board_views_of(UNCALIBRATED)
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 6_000_000
    views = load_board_views(folder)
    assert len(views.images) >= 10
    for node, truth in zip(views.cameras, nodes_of(UNCALIBRATED), strict=True):
        np.testing.assert_array_equal(node.intrinsics.matrix, truth.intrinsics.matrix)
        np.testing.assert_array_equal(node.T_world_camera, truth.T_world_camera)


def test_what_the_uncalibrated_nodes_say_of_themselves_is_wrong() -> None:
    rig = load_demo(UNCALIBRATED)
    for frame, lens, truth in zip(rig.frames, rig.truth.intrinsics, rig.truth.depth, strict=True):
        assert 0.02 < abs(lens.fx_px / frame.intrinsics.fx_px - 1.0) < 0.05
        assert np.any(lens.distortion)
        assert not np.any(frame.intrinsics.distortion)
        off_m = np.nanmedian(np.abs(frame.depth.z_m - truth.z_m))
        assert 0.005 < off_m < 0.05


def test_the_truth_of_the_other_demos_is_what_they_say(tmp_path) -> None:
    rig = load_demo("box-on-table")
    for frame, lens in zip(rig.frames, rig.truth.intrinsics, strict=True):
        np.testing.assert_array_equal(frame.intrinsics.matrix, lens.matrix)
    save_rig(tmp_path, rig)
    assert not list(tmp_path.rglob("true_intrinsics.json"))
    save_rig(tmp_path / "wrong", load_demo(UNCALIBRATED))
    again = load_rig(tmp_path / "wrong")
    np.testing.assert_array_equal(
        again.truth.intrinsics[2].matrix, nodes_of(UNCALIBRATED)[2].intrinsics.matrix
    )


def test_photographs_depend_on_the_seed_alone() -> None:
    scene = build_demo("box-on-table")
    small = CameraIntrinsics.pinhole(66.0, 66.0, 39.5, 29.5, 80, 60)
    for quality in ("fast", "photo"):
        first, again, other = (
            render(scene, small, scene.cameras[1], quality, np.random.default_rng(seed)) for seed in (7, 7, 8)
        )
        np.testing.assert_array_equal(first.rgb, again.rgb)
        assert np.any(first.rgb != other.rgb)
        np.testing.assert_array_equal(first.z_m, other.z_m)


def test_the_box_measures_30_by_20_by_15_cm() -> None:
    scene = build_demo("box-on-table")
    box = scene.parts[0]
    np.testing.assert_allclose(np.ptp(box.vertices_m, axis=0), [0.30, 0.20, 0.15], atol=1e-12)
    world = apply(box.T_world_part, box.vertices_m)
    edges = [np.linalg.norm(world[a] - world[b]) for a, b in ((0, 1), (0, 2), (0, 4))]
    np.testing.assert_allclose(edges, BOX_M, atol=1e-12)
    assert world[:, 2].min() == pytest.approx(0.74)


def test_disturbed_keeps_a_rotation() -> None:
    T = disturbed(np.eye(4), np.random.default_rng(3))
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
