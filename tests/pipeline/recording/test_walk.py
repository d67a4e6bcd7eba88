"""From a recording's frames to a rig with a map."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.acquisition import acquire
from pipeline.config import PRESETS
from pipeline.depth import DepthNetwork
from pipeline.kernels.geometry import apply, inverse, project
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.merging import merge_map
from pipeline.nodes import infer_depth, nothing_inferred, prepare_node
from pipeline.placement.walked import place_walked
from pipeline.recording.errors import ate_m
from pipeline.recording.loops import Trajectory
from pipeline.recording.photographs import Blend
from pipeline.recording.tracking import Track
from pipeline.recording.walk import MOST_VIEWS, iterate_views, iterate_walk
from pipeline.registration.organised import organised
from pipeline.sources import Recorded
from pipeline.spec import Spec
from pipeline.types import PointCloud, PointSource
from tests.pipeline.recording.rendered import CAMERA, around, color_at, in_the_living_room, moved


@pytest.fixture(scope="module")
def recording():
    return in_the_living_room(around(30), noise_m=0.001)


@pytest.fixture(scope="module")
def rig(recording):
    return drain(iterate_walk(recording))


def colors_of(points, frames):
    blend = Blend(points)
    for frame in frames:
        blend.add(frame)
    return blend.colors


def in_the_true_world(rig, recording, points_m):
    """Return points of the walk's world in that of the mesh, by the first camera's two poses."""
    return apply(recording.T_true[0] @ inverse(rig.walk.T_world_camera[0]), points_m)


def test_the_camera_is_followed_and_the_world_has_z_up(rig, recording):
    assert ate_m(rig.walk.T_world_camera, recording.T_true) < 0.003
    ups = -np.array([T[:3, 1] for T in rig.walk.T_world_camera])
    assert ups[:, 2].min() > 0.7


def test_the_map_lies_on_the_surfaces_and_looks_at_the_cameras(rig, recording):
    points = rig.walk.map
    scene = triangle_scene(recording.vertices_m, recording.triangles)
    own_m = in_the_true_world(rig, recording, points.points_m)
    off_m = scene.compute_distance(tensor(own_m, np.float32)).numpy()
    assert np.median(off_m) < 0.003
    assert np.quantile(off_m, 0.95) < 0.015
    to_camera = np.mean([T[:3, 3] for T in rig.walk.T_world_camera], axis=0) - points.points_m
    assert np.mean(np.einsum("ni,ni->n", to_camera, points.normals) > 0.0) > 0.98
    np.testing.assert_allclose(np.linalg.norm(points.normals, axis=1), 1.0, atol=1e-6)


def test_the_map_grows_with_the_frames_that_measured_it(rig, recording):
    first = rig.walk.first_frames
    assert first.shape == (len(rig.walk.map),)
    assert first.min() == 0
    assert first.max() > 20
    for number in (0, 10):
        own_m = apply(inverse(rig.walk.T_world_camera[number]), rig.walk.map.points_m[first == number])
        pixels = project(recording.frame(number).intrinsics, own_m)
        inside = np.all((pixels > -3.0) & (pixels < [322.0, 242.0]), axis=1)
        assert inside.mean() > 0.98


def test_the_tracked_path_begins_where_the_final_one_does(rig, recording):
    np.testing.assert_allclose(rig.walk.T_world_tracked[0], rig.walk.T_world_camera[0], atol=1e-9)
    assert 0.0 < ate_m(rig.walk.T_world_tracked, recording.T_true) < 0.01


def test_the_map_has_the_colours_of_the_photographs(rig, recording):
    own_m = in_the_true_world(rig, recording, rig.walk.map.points_m)
    apart = np.abs(color_at(own_m).astype(int) - rig.walk.map.colors.astype(int)).max(axis=1)
    assert np.median(apart) <= 3


def test_a_few_views_have_the_final_poses_of_their_frames(rig, recording):
    assert 1 <= len(rig.frames) <= MOST_VIEWS
    for frame in rig.frames:
        number = int(frame.name.removeprefix("frame_"))
        assert number in rig.walk.keyframes
        np.testing.assert_array_equal(frame.T_world_camera, rig.walk.T_world_camera[number])
        np.testing.assert_array_equal(frame.rgb, recording.frame(number).rgb)
        assert frame.pose_known


def test_a_depth_camera_of_its_own_moves_the_poses_only(recording):
    T_color_depth = moved([0, 1, 0], 2.0, [0.05, 0.0, 0.0])
    beside = replace(recording, T_color_depth=T_color_depth)
    rig = drain(iterate_walk(beside))
    assert ate_m(rig.walk.T_world_camera, beside.T_true) < 0.003
    scene = triangle_scene(beside.vertices_m, beside.triangles)
    own_m = in_the_true_world(rig, beside, rig.walk.map.points_m)
    assert np.median(scene.compute_distance(tensor(own_m, np.float32)).numpy()) < 0.004


def test_poses_that_come_with_the_frames_give_the_world(recording):
    rig = drain(iterate_walk(replace(recording, given=True)))
    apart = [np.abs(a - b).max() for a, b in zip(rig.walk.T_world_camera, recording.T_true, strict=True)]
    assert max(apart) < 0.01


def test_the_part_with_the_most_keyframes_is_mapped_and_a_part_of_the_same_place_is_joined():
    """The camera turns round for some frames: they show another place and have no pose."""
    poses = around(24)
    away = [poses[11] @ moved([0, 1, 0], 180.0, [0, 0, 0])] * 8
    recording = in_the_living_room([*poses[:12], *away, *poses[12:]])
    walk = drain(iterate_walk(recording)).walk
    lost = [k for k, T in enumerate(walk.T_world_camera) if T is None]
    assert set(range(12, 20)) <= set(lost)
    assert len(lost) < 16
    assert ate_m(walk.T_world_camera, recording.T_true) < 0.005


def test_too_few_frames_or_no_depth_is_one_sentence(recording):
    with pytest.raises(InputError, match="rendered has too few frames: a recording needs 2"):
        drain(iterate_walk(replace(recording, T_true=recording.T_true[:1])))
    blind = replace(recording, T_true=recording.T_true[:3], blind=frozenset(range(3)))
    with pytest.raises(InputError, match="No frame of rendered has enough depth"):
        drain(iterate_walk(blind))


def test_a_photograph_that_cannot_be_read_is_left_out_and_the_others_give_the_colours(
    recording, rig, monkeypatch
):
    first = int(rig.frames[0].name.removeprefix("frame_"))
    read = type(recording).frame

    def damaged(self, index):
        if index == first:
            raise InputError("color.png is no image")
        return read(self, index)

    monkeypatch.setattr(type(recording), "frame", damaged)
    again = drain(iterate_walk(recording))
    assert [frame.name for frame in again.frames] == [frame.name for frame in rig.frames[1:]]
    assert again.notes == ()  # the recording counts its own images that cannot be used


def test_points_that_no_view_measured_are_grey(recording):
    frame = replace(recording.frame(0), T_world_camera=recording.T_true[0])
    ahead = recording.T_true[0][:3, 3] + 0.3 * recording.T_true[0][:3, 2]  # in free space
    behind = recording.T_true[0][:3, 3] - recording.T_true[0][:3, 2]
    points = PointCloud(np.array([ahead, behind]), normals=np.tile(-recording.T_true[0][:3, 2], (2, 1)))
    assert (colors_of(points, [frame]) == 128).all()


def test_a_near_view_that_faces_a_point_gives_its_colour(recording):
    """Black from twice the distance and white from here: four parts to one."""
    near = recording.frame(0)
    z_m = near.depth.z_m[60, 80]
    T = recording.T_true[0]
    point_m = T[:3, 3] + z_m * (T[:3, :3] @ [(80 - 79.5) / 131.25, (60 - 59.5) / 131.25, 1.0])
    far_T = T.copy()
    far_T[:3, 3] += T[:3, 3] - point_m
    flat = replace(near.depth, z_m=np.full_like(near.depth.z_m, 2.0 * z_m))
    white = replace(near, rgb=np.full_like(near.rgb, 250), T_world_camera=T)
    black = replace(near, rgb=np.zeros_like(near.rgb), depth=flat, T_world_camera=far_T)
    normal = (T[:3, 3] - point_m) / np.linalg.norm(T[:3, 3] - point_m)
    point = PointCloud(point_m[None], normals=normal[None])
    assert colors_of(point, [white, black])[0, 0] == pytest.approx(200, abs=1)


def nodes_of(rig, inferred=None):
    config = PRESETS["packetmesh"]
    network = DepthNetwork.of(config.depth) if inferred else None
    return [
        prepare_node(
            frame,
            infer_depth(network, frame) if network else nothing_inferred(frame),
            acquire(frame, config.acquisition),
            config.depth,
            "fill",
        )
        for frame in rig.frames
    ]


def test_without_guesses_the_merged_cloud_is_the_map(rig):
    merged = merge_map(rig.walk, rig.frames, nodes_of(rig), [f.T_world_camera for f in rig.frames], 0)
    np.testing.assert_array_equal(merged.fused.points_m, rig.walk.map.points_m)
    assert merged.measured == len(rig.walk.map)
    assert (merged.fused.source == PointSource.SENSOR).all()


def test_guesses_stand_only_where_nothing_was_measured(rig):
    """A view with a hole that the map fills, and the same with a map that lacks the place, too."""
    frame = rig.frames[0]
    z_m = frame.depth.z_m.copy()
    z_m[50:75, 60:90] = np.nan
    pierced = [replace(frame, depth=replace(frame.depth, z_m=z_m))]
    nodes, poses = nodes_of(replace(rig, frames=pierced), inferred=True), [frame.T_world_camera]
    own_m = apply(inverse(frame.T_world_camera), rig.walk.map.points_m)
    pixels = project(frame.intrinsics, own_m)
    away = (own_m[:, 2] <= 0.1) | np.any(np.abs(pixels - (75, 62)) > (25, 22), axis=1)
    lacking = replace(rig.walk, map=rig.walk.map.select(away))
    counts = []
    for walk in (rig.walk, lacking):
        merged = merge_map(walk, pierced, nodes, poses, 1)
        guessed = merged.fused.source == PointSource.INFERRED
        np.testing.assert_array_equal(np.flatnonzero(guessed), np.arange(merged.measured, len(merged.fused)))
        counts.append(guessed.sum())
    assert counts[1] > 30
    assert counts[0] < 0.2 * counts[1]


def test_the_views_agree_at_their_poses(rig):
    placement = place_walked(rig.frames, nodes_of(rig))
    assert len(placement.verdicts) == len(rig.frames)
    assert all(verdict.placed for verdict in placement.verdicts)
    assert placement.agreement.within_2pct_share > 0.97
    off = [
        replace(f, T_world_camera=f.T_world_camera @ moved([0, 1, 0], 8.0 * k, [0, 0, 0]))
        for k, f in enumerate(rig.frames)
    ]
    assert place_walked(off, nodes_of(rig)).agreement.within_2pct_share < 0.9


def test_a_recording_says_its_command():
    spec = Spec(Recorded("walks/kitchen", 1000.0, "camera.json"))
    assert spec.command("out") == (
        "packetmesh reconstruct --recording walks/kitchen --intrinsics camera.json --depth-scale 1000 "
        "--preset packetmesh --out out"
    )


def test_ate_is_the_rmse_after_alignment():
    truth = around(12)
    turned = [moved([1, 2, 3], 50.0, [1.0, 2.0, 3.0]) @ T for T in truth]
    assert ate_m(turned, truth) == pytest.approx(0.0, abs=1e-9)
    assert ate_m([None, *turned[1:]], truth) == pytest.approx(0.0, abs=1e-9)
    square = [np.eye(4) for _ in range(4)]
    for T, at in zip(square, ([1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]), strict=True):
        T[:3, 3] = at
    out = [T.copy() for T in square]
    for T in out:
        T[2, 3] = 0.1 * T[0, 3] * T[1, 3]  # alternately up and down: no rigid motion helps
    assert ate_m(out, square) == pytest.approx(0.1)
    assert np.isnan(ate_m(truth[:2], truth[:2]))


def test_views_are_chosen_from_some_of_many_keyframes(recording, monkeypatch):
    """Two places, each seen by twenty keyframes: one view of each is enough."""
    monkeypatch.setattr("pipeline.recording.walk.MOST_COMPARED", 10)
    here, there = recording.T_true[0], recording.T_true[0] @ moved([0, 1, 0], 90.0, [0, 0, 0])
    both = replace(recording, T_true=[here, there])
    clouds = [organised(both.view(k).depth, CAMERA) for k in range(2)]
    poses = {k: inverse(here) @ both.T_true[k // 20] for k in range(40)}
    track = Track((None,) * 40, {k: clouds[k // 20] for k in range(40)}, ())
    reports = []
    views = drain(iterate_views(Trajectory((None,) * 40, poses, ()), track), reports.append)
    assert [k // 20 for k in views] == [0, 1]
    assert len(reports) == 1
