"""Walks: a smooth closed path in free space, and a recording without poses that agrees with its truth."""

import sys

import numpy as np
import pytest

from lab.places.overlap import OverlapMeter
from lab.places.views import is_usable
from lab.walks import __main__ as command
from lab.walks.path import CLEARANCE_M, HEIGHTS_M, RATE_HZ, walk_poses
from lab.walks.walk import TRUE_POSES, kinect, read_truth, render_walk
from lab.worlds.living_room import living_room
from lab.worlds.raycast import RayCaster
from lab.worlds.rooms import random_room
from lab.worlds.scene import Scene
from lab.worlds.sensor import axial_sigma_m
from lab.worlds.shell import shell
from packetmesh.errors import InputError
from pipeline.importing.tum import UNITS_PER_METRE, poses_at, read_tum
from pipeline.io.images import read_color, read_depth
from pipeline.kernels.geometry import rotation_angle_rad
from pipeline.kernels.rays import hit_depth

CAMERA = kinect(80)
FRAMES = 6
WALKS = {
    "full turn": (lambda: random_room(5_000_002), 300),
    "there and back": (living_room, 120),
    "laps": (lambda: random_room(5_000_004), 900),
}


@pytest.fixture(scope="module", params=WALKS)
def walk(request):
    make, count = WALKS[request.param]
    scene = make()
    return scene, np.array(walk_poses(scene, CAMERA, count, np.random.default_rng(3)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("walk")
    render_walk(random_room(5_000_002), FRAMES, CAMERA, out, 1)
    return out


def turns_deg(poses):
    """Angles between consecutive poses."""
    pairs = zip(poses[:-1, :3, :3], poses[1:, :3, :3], strict=True)
    return np.degrees([rotation_angle_rad(a.T @ b) for a, b in pairs])


def test_poses_are_rigid_at_the_height_of_a_hand(walk):
    _, poses = walk
    rotations = poses[:, :3, :3]
    assert np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(rotations), 1.0)
    assert np.array_equal(poses[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (len(poses), 1)))
    assert poses[:, 2, 3].min() > HEIGHTS_M[0] - 0.05
    assert poses[:, 2, 3].max() < HEIGHTS_M[1] + 0.05
    assert np.degrees(np.arccos(-poses[:, 2, 1])).max() < 45.0  # upright


def test_the_hand_moves_and_turns_slowly_and_trembles(walk):
    _, poses = walk
    speed = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) * RATE_HZ
    assert speed.max() < 0.4
    assert speed.mean() > 0.08
    assert turns_deg(poses).max() * RATE_HZ < 46.0
    roll_deg = np.degrees(np.arcsin(poses[:, 2, 0]))  # the path without the jitter has none
    assert 0.1 < roll_deg.std() < 0.6
    assert np.abs(np.diff(roll_deg)).max() < 0.5


def test_the_loop_closes_after_most_directions_were_seen(walk):
    _, poses = walk
    assert np.linalg.norm(poses[0, :3, 3] - poses[-1, :3, 3]) < 0.05
    assert np.degrees(rotation_angle_rad(poses[0, :3, :3].T @ poses[-1, :3, :3])) < 3.0
    yaw_deg = np.unwrap(np.degrees(np.arctan2(poses[:, 1, 2], poses[:, 0, 2])), period=360.0)
    assert np.ptp(yaw_deg) > (355.0 if len(poses) >= 300 else 50.0)


def test_nothing_is_near_any_camera_and_every_view_is_usable(walk):
    scene, poses = walk
    caster, directions = RayCaster(scene, threads=1), np.random.default_rng(0).standard_normal((400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    some = poses[:: len(poses) // 50]
    for eye_m in some[:, :3, 3]:
        hits = caster.cast(np.insert(directions, [0, 0, 0], eye_m, axis=1).astype(np.float32))
        assert CLEARANCE_M - 1e-4 < hits.t.min() < hits.t.max() < 15.0
    meter = OverlapMeter(caster, CAMERA)
    assert all(is_usable(meter.look(T)) for T in some)


def test_the_seed_decides_the_path():
    scene = random_room(5_000_003)
    one, same, other = (walk_poses(scene, CAMERA, 30, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.allclose(one, other, atol=0.05)


def test_short_walks_and_rooms_without_space():
    assert len(walk_poses(random_room(5_000_003), CAMERA, 1, np.random.default_rng(0))) == 1
    with pytest.raises(InputError, match="at least 1"):
        walk_poses(random_room(5_000_003), CAMERA, 0, np.random.default_rng(0))
    rng = np.random.default_rng(0)
    closet = Scene("closet", tuple(shell(rng, np.array([0.7, 2.0, 2.4]), 0.5)), (), np.ones(3), (), CAMERA)
    with pytest.raises(InputError, match="no room for a walk"):
        walk_poses(closet, CAMERA, 30, rng)


def test_the_folder_imports_as_a_recording_without_poses(folder):
    recording = read_tum(folder, None)
    assert len(recording.candidates) == FRAMES
    assert all(candidate.T_world_camera is None for candidate in recording.candidates)
    assert [candidate.time_s for candidate in recording.candidates] == pytest.approx(
        np.arange(FRAMES) / RATE_HZ, abs=1e-6
    )
    assert np.array_equal(recording.camera.matrix, CAMERA.matrix)
    assert recording.units_per_metre == UNITS_PER_METRE
    assert recording.notes == ()
    assert recording.without_poses == "No groundtruth.txt: poses are not known; reconstruct looks for them"
    assert read_color(recording.candidates[0].color).shape == (60, 80, 3)


def test_depth_agrees_with_the_true_surface_within_the_noise(folder):
    truth = read_truth(folder)
    assert truth.T_world_camera.shape == (FRAMES, 4, 4)
    for candidate, T in zip(read_tum(folder, None).candidates, truth.T_world_camera, strict=True):
        z_m = read_depth(candidate.depth, UNITS_PER_METRE).z_m
        true_m = hit_depth(truth.vertices_m, truth.triangles, CAMERA, T).z_m
        known = np.isfinite(z_m)
        assert known.mean() > 0.4
        error = (z_m - true_m)[known] / axial_sigma_m(true_m[known])
        assert np.median(np.abs(error)) < 1.0
        assert abs(np.median(error)) < 0.3


def test_true_poses_are_read_back(folder):
    true = read_truth(folder).T_world_camera
    found = poses_at(folder / TRUE_POSES, np.arange(FRAMES) / RATE_HZ)
    assert np.allclose([found[k] for k in range(FRAMES)], true, atol=1e-8)


def test_the_same_seed_gives_the_same_files(folder, tmp_path):
    render_walk(random_room(5_000_002), FRAMES, CAMERA, tmp_path, 1)
    names = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.suffix != ".npz")
    assert len(names) == 2 * FRAMES + 6  # with two folders, three lists and the camera
    for name in names:
        assert (folder / name).is_dir() or (folder / name).read_bytes() == (tmp_path / name).read_bytes()


def test_the_command_refuses_a_walk_without_frames_in_one_sentence(tmp_path, monkeypatch):
    words = ["--scene", "living-room", "--frames", "0", "--out", str(tmp_path / "walk")]
    monkeypatch.setattr(sys, "argv", ["walks", *words])
    with pytest.raises(SystemExit, match="at least 1"):
        command.main()


def test_a_folder_without_truth_is_refused(tmp_path):
    with pytest.raises(InputError, match="render the walk again"):
        read_truth(tmp_path)
