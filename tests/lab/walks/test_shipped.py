"""The walk that ships: small, a loop, without given poses, and what its script renders."""

import cv2
import numpy as np
import pytest

from lab.walks.shipped import CAMERA, EVERY, FRAMES, NAME, SENSOR, frames, path_poses
from lab.worlds.living_room import living_room
from lab.worlds.raycast import world_mesh
from pipeline.importing.recorded import open_recording
from pipeline.importing.tum import poses_at
from pipeline.io.demos import RECORDINGS, TRUE_PATH
from pipeline.io.images import read_color, read_depth_values
from pipeline.kernels.geometry import inverse, rotation_angle_rad
from pipeline.kernels.rays import Camera, hit_depths
from pipeline.sources import demo_of
from pipeline.stages import drain, open_rig

FOLDER = RECORDINGS / NAME
LARGEST_BYTES = 6_000_000


@pytest.fixture(scope="module")
def recording():
    return open_recording(FOLDER)


@pytest.fixture(scope="module")
def poses(recording):
    return poses_at(FOLDER / TRUE_PATH, recording.times_s)


def test_it_is_small_and_has_all_frames_without_poses(recording, poses):
    assert sum(path.stat().st_size for path in FOLDER.rglob("*") if path.is_file()) <= LARGEST_BYTES
    assert len(recording.times_s) == len(poses) == FRAMES
    assert recording.T_world_camera is None
    np.testing.assert_allclose(np.diff(recording.times_s), EVERY / 30.0, atol=1e-6)
    camera = recording.frame(0).intrinsics
    np.testing.assert_array_equal(camera.matrix, CAMERA.matrix)


def test_it_is_a_walk_that_ends_where_it_began(poses):
    at_m = np.array([poses[k][:3, 3] for k in range(FRAMES)])
    assert np.linalg.norm(np.diff(at_m, axis=0), axis=1).sum() > 3.0
    closing = inverse(poses[0]) @ poses[FRAMES - 1]
    assert np.linalg.norm(closing[:3, 3]) < 0.1
    assert np.degrees(rotation_angle_rad(closing[:3, :3])) < 10.0


def test_depth_is_that_of_the_room_seen_from_the_true_poses(recording, poses):
    some = range(0, FRAMES, 40)
    true = hit_depths(*world_mesh(living_room()), [Camera(CAMERA, poses[k]) for k in some])
    for k, expected in zip(some, true, strict=True):
        z_m = recording.frame(k).depth.z_m
        known = np.isfinite(z_m)
        assert known.mean() > 0.6
        assert np.median(np.abs(z_m - expected.z_m)[known] / z_m[known]) < 0.01


def test_depth_has_the_sensors_steps():
    units = read_depth_values(FOLDER / "depth" / "000050.png")
    disparity_px = 2.0 * CAMERA.fx_px * SENSOR.baseline_m * 5000.0 / np.unique(units[units > 0])
    steps = disparity_px / SENSOR.disparity_step_px
    assert np.abs(steps - np.rint(steps)).max() < 0.1


def test_the_script_renders_its_first_frame_again():
    rgb, units = next(frames(path_poses()))
    stored = read_depth_values(FOLDER / "depth" / "000000.png")
    assert (stored == units).mean() > 0.999
    assert cv2.PSNR(read_color(FOLDER / "rgb" / "000000.jpg"), rgb) > 30.0


@pytest.mark.slow
def test_its_path_is_found_and_said_to_be_near_the_true_one():
    rig = drain(open_rig(demo_of(NAME)))
    assert rig.walk is not None
    assert all(T is not None for T in rig.walk.T_world_camera)
    assert sum(link.loop and link.used for link in rig.walk.links) >= 3
    (note,) = (note for note in rig.notes if "from the true one" in note)
    assert float(note.split(" by ")[1].split()[0]) <= 1.5
