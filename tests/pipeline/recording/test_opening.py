"""Whether a recording's camera stands, and what then becomes of its frames."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.acquisition import back_project
from pipeline.importing.recorded import open_recording
from pipeline.kernels.geometry import inverse
from pipeline.recording.opening import (
    alike_share,
    iterate_recording,
    iterate_still,
    stands,
    unchanged_share,
)
from pipeline.types import CameraIntrinsics, DepthMap
from tests.pipeline.recording.rendered import around, in_the_living_room, moved
from tests.pipeline.recording.standing import LAW, Frames, pictures, standing, wall, write_tum


def poses_at_rest(frames):
    return [around(30)[0]] * frames


def test_a_camera_at_rest_stands_and_one_that_walks_does_not():
    assert stands(in_the_living_room(poses_at_rest(12), noise_m=0.002))
    assert not stands(in_the_living_room(around(60), noise_m=0.002))
    assert not stands(in_the_living_room(around(60)[:8], noise_m=0.002))


def test_it_walks_if_it_moves_at_any_time():
    rest = poses_at_rest(30)
    ways = [moved([0, 1, 0], 0.5, [0.0, 0.0, 0.0]), moved([0, 0, 1], 0.0, [0.0, 0.0, 0.02])]
    for motion in ways:
        for poses in (rest[:20] + [rest[0] @ motion] * 10, [rest[0] @ motion, *rest[1:]]):
            assert not stands(in_the_living_room(poses, noise_m=0.002))


def resting_then_moving():
    """Eight frames at rest, and four that are 3 cm to the side: not far enough for another keyframe."""
    aside = around(30)[0] @ moved([0, 0, 1], 0.0, [0.03, 0.0, 0.0])
    return in_the_living_room([*poses_at_rest(8), *[aside] * 4], noise_m=0.002)


def test_rest_is_judged_within_the_frames_that_are_asked_for():
    recording = resting_then_moving()
    assert [stands(recording, frames) for frames in (1, 2, 8, 9, 12, 64)] == [True] * 3 + [False] * 3
    rig = drain(iterate_recording(recording, 8))
    assert rig.walk is None
    assert rig.frames[0].averaging.frames == 8


def test_a_walk_that_hardly_moves_names_its_frames_at_rest():
    walk = drain(iterate_recording(resting_then_moving())).walk
    assert len(walk.keyframes) == 1
    assert "stood in the first 8 frames: `--set recording.frames=8` averages" in walk.notes[-1]


def test_noise_alone_is_no_motion():
    assert stands(standing())
    recording = standing()
    rng = np.random.default_rng(1)
    recording.depths_m = [d + 3.0 * LAW.sd_m(d) * rng.standard_normal(d.shape) for d in recording.depths_m]
    assert stands(recording)


def test_someone_who_walks_by_does_not_move_the_camera():
    recording = standing()
    for k in range(3, 9):
        recording.depths_m[k][:, 10 * k : 10 * k + 50] = 1.0
    assert stands(recording)


def texture(seed=0):
    """Smooth noise, wider than a picture."""
    noise = np.random.default_rng(seed).uniform(0.0, 255.0, (120, 300)).astype(np.float32)
    return np.repeat(cv2.GaussianBlur(noise, (0, 0), 2.0)[..., None], 3, axis=2) * 2.0 - 127.0


def with_pictures(pictures):
    return Frames(wall(len(pictures)), [np.clip(one, 0.0, 255.0).astype(np.uint8) for one in pictures])


def test_a_camera_that_slides_along_a_wall_is_seen_by_its_photographs():
    image = texture()
    assert stands(with_pictures([image[:, :160]] * 12))
    assert not stands(with_pictures([image[:, 3 * k : 160 + 3 * k] for k in range(12)]))


def test_a_lamp_or_another_exposure_does_not_move_the_camera():
    image = texture()[:, :160]
    assert stands(with_pictures([60.0 + (0.4 + 0.03 * k) * (image - 60.0) for k in range(12)]))
    covered = [image.copy() for _ in range(12)]
    for k, one in enumerate(covered):
        one[:, 8 * k : 8 * k + 40] = texture(1)[:, :40]
    assert stands(with_pictures(covered))


def test_photographs_of_a_bare_wall_decide_nothing():
    assert alike_share(np.full((120, 160), 100.0), np.full((120, 160), 50.0)) == 1.0
    assert alike_share(texture()[:, :160, 0], texture(1)[:, :160, 0]) < 0.1
    assert alike_share(texture()[:, :160, 0], texture()[:, :80, 0]) == 0.0


def test_a_scene_that_moves_as_a_whole_is_a_walk():
    recording = standing()
    recording.depths_m[8:] = wall(8, z_m=2.03, seed=1)
    recording.depths_m = [d[:41].repeat(3, axis=0)[:120] for d in recording.depths_m]
    assert not stands(recording)


def test_given_poses_that_are_apart_are_a_walk_although_nothing_changes():
    along = [moved([0, 1, 0], 0.0, [0.05 * k, 0.0, 0.0]) for k in range(16)]
    assert not stands(standing(T_world_camera=tuple(along)))
    assert not stands(standing(T_world_camera=tuple(inverse(T) for T in along)))
    assert stands(standing(T_world_camera=tuple(along[:1] * 16)))


def test_frames_without_depth_tell_nothing():
    recording = standing()
    for k in (0, 5, 15):
        recording.depths_m[k][:] = np.nan
    assert stands(recording)
    recording.depths_m = [np.full_like(d, np.nan) for d in recording.depths_m]
    assert not stands(recording)


def test_one_frame_is_no_recording():
    with pytest.raises(InputError, match="too few frames"):
        drain(iterate_recording(standing(1)))


def test_a_view_of_another_size_is_another_view():
    first = standing().view(0)
    other = replace(first, depth=DepthMap(first.depth.z_m[::2, ::2]))
    assert unchanged_share(first, first) == 1.0
    assert unchanged_share(first, other) == 0.0


def test_a_camera_that_stands_is_one_node_without_a_walk():
    rig = drain(iterate_recording(standing(notes=("A note.",))))
    assert rig.walk is None
    (frame,) = rig.frames
    assert (frame.averaging.frames, frame.averaging.available) == (16, 16)
    assert frame.depth.valid[60, 60]
    assert not frame.depth.valid[30, 40]
    assert "A note." in frame.notes
    assert any(
        "The camera stands: 16 of 16 frames were averaged; 0.0 % of the pixels moved" in note
        for note in rig.notes
    )


def test_a_camera_that_walks_is_tracked_as_ever():
    rig = drain(iterate_recording(in_the_living_room(around(60)[:8], noise_m=0.001)))
    assert rig.walk is not None
    assert len(rig.walk.times_s) == 8


def test_only_the_frames_asked_for_are_averaged():
    recording = standing(20)
    recording.depths_m[5:] = [d * 1.2 for d in recording.depths_m[5:]]
    frame = drain(iterate_still(recording, 5))
    assert frame.averaging.frames == 5
    assert np.nanmedian(frame.depth.z_m) == pytest.approx(np.nanmedian(wall(1)[0]), rel=0.01)
    assert drain(iterate_still(standing(3), 64)).averaging.frames == 3
    assert drain(iterate_still(standing(70), 64)).averaging.available == 64


def test_each_frame_that_is_averaged_is_read_once():
    read = []

    class Counted(Frames):
        def view(self, index):
            read.append(index)
            return super().view(index)

    drain(iterate_still(Counted(wall(16), pictures(*[100] * 16)), 16))
    assert sorted(read) == list(range(16))


def test_points_get_the_deviation_of_the_average():
    one, many = (drain(iterate_still(standing(64), frames)) for frames in (1, 64))
    of_wall_m = [np.median(back_project(frame).sigma_m[: 10 * 160]) for frame in (one, many)]
    assert of_wall_m[0] == pytest.approx(0.006, rel=0.01)
    assert of_wall_m[0] / of_wall_m[1] == pytest.approx(8.0, rel=0.1)


def test_colours_are_the_median_of_three_photographs():
    recording = standing(9)
    recording.rgbs = pictures(100, 0, 0, 0, 250, 0, 0, 0, 110)
    assert np.all(drain(iterate_still(recording, 9)).rgb == 110)
    assert np.all(drain(iterate_still(recording, 1)).rgb == 100)


def test_depth_of_another_camera_is_carried_to_the_colours_with_its_deviation():
    """A colour camera of twice the pixels: each of its pixels has the deviation of the one it lies in."""
    matrix = np.array([[262.5, 0, 159.5], [0, 262.5, 119.5], [0, 0, 1.0]])
    fine = CameraIntrinsics(matrix, np.zeros(5), 320, 240)
    depths_m = [np.full((120, 160), 2.0) for _ in range(4)]
    rng = np.random.default_rng(0)
    for depth_m in depths_m:
        depth_m[:, 80:] += 0.004 * rng.standard_normal((120, 80))
    recording = Frames(depths_m, [np.zeros((240, 320, 3), np.uint8)] * 4, color_camera=fine)
    frame = drain(iterate_still(recording, 4))
    assert frame.depth.z_m.shape == frame.averaging.sd_m.shape == (240, 320)
    assert frame.depth.coverage > 0.97
    sd_m = frame.averaging.sd_m
    assert np.nanmax(sd_m[:, :150]) < 1e-6
    assert np.nanmedian(sd_m[:, 170:]) == pytest.approx(0.002, rel=0.2)
    shifted = replace(recording, T_color_depth=moved([0, 1, 0], 0.0, [0.1, 0.0, 0.0]))
    edge = int(159.5 + 262.5 * 0.1 / 2.0)
    sd_m = drain(iterate_still(shifted, 4)).averaging.sd_m
    assert np.nanmax(sd_m[:, 40 : edge - 5]) < 1e-6
    assert np.nanmedian(sd_m[:, edge + 5 :]) == pytest.approx(0.002, rel=0.2)


def test_a_recording_in_which_everything_moves_gives_a_sentence():
    recording = standing(12)
    recording.depths_m = [depth_m * (1.0 + 0.1 * (k % 4)) for k, depth_m in enumerate(recording.depths_m)]
    with pytest.raises(InputError, match=r"keeps its depth; try recording\.frames=1"):
        drain(iterate_still(recording, 12))


def test_frames_without_depth_or_colours_are_not_used(tmp_path):
    """The first two frames have no depth; of the three photographs chosen then the last one is damaged."""
    depths_m = wall(8)
    depths_m[0][:] = depths_m[1][:] = np.nan
    write_tum(tmp_path / "still", depths_m)
    image = tmp_path / "still" / "rgb" / "0007.png"
    image.write_bytes(image.read_bytes()[:60])
    frame = drain(iterate_still(open_recording(tmp_path / "still"), 64))
    assert (frame.averaging.frames, frame.averaging.available) == (6, 8)
    assert frame.averaging.flickering_share == 0.0
    assert any("6 of 8 frames were averaged" in note for note in frame.notes)
    (note,) = (note for note in frame.notes if image.name in note)
    assert note.startswith("1 colour image could not be used: ")
    assert drain(iterate_still(open_recording(tmp_path / "still"), 1)).depth.valid.any()


def test_without_any_photograph_or_depth_there_is_a_sentence(tmp_path):
    write_tum(tmp_path / "still", wall(4))
    recording = open_recording(tmp_path / "still")
    for image in (tmp_path / "still" / "rgb").iterdir():
        image.write_bytes(b"damaged")
    with pytest.raises(InputError, match=r"frame 0 gives no colours: .*0000\.png is neither"):
        drain(iterate_still(recording, 4))
    blind = standing(4)
    blind.depths_m = [np.full_like(depth_m, np.nan) for depth_m in blind.depths_m]
    with pytest.raises(InputError, match=r"No frame of frames has depth"):
        drain(iterate_still(blind, 4))
