"""A run that was killed goes on from its checkpoint to the same bits."""

import os
import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lab.walks.walk import kinect, render_walk
from lab.worlds.rooms import random_room
from packetmesh.progress import drain
from pipeline.importing.recorded import open_recording
from pipeline.recording.checkpoint import GOES_ON, OLD_S, Checkpoint, cache_folder, checkpoint_of
from pipeline.recording.tracking import Track, iterate_tracking
from pipeline.recording.walk import iterate_walk
from tests.pipeline.recording.rendered import around, in_the_living_room, moved
from tests.pipeline.recording.standing import wall, write_tum


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("pipeline.recording.tracking.EVERY_S", 0.0)
    return tmp_path / "cache"


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings") / "walk"
    render_walk(random_room(5_000_001), 12, kinect(160), folder)
    return folder


def lost_and_found():
    """A camera that turns away for seven frames, of which one has no depth, and comes back."""
    poses = around(36)[:24]
    poses[8:15] = [T @ moved([0, 1, 0], 180.0, [0, 0, 0]) for T in poses[8:15]]
    return in_the_living_room(poses, noise_m=0.001, blind=frozenset({9}))


def assert_same(one: Track, other: Track) -> None:
    assert list(one.clouds) == list(other.clouds)
    for number in one.clouds:
        np.testing.assert_array_equal(one.clouds[number].points_m, other.clouds[number].points_m)
        np.testing.assert_array_equal(one.clouds[number].rows, other.clouds[number].rows)
    assert [(link.source, link.target) for link in one.links] == [(k.source, k.target) for k in other.links]
    for a, b in zip(one.links, other.links, strict=True):
        np.testing.assert_array_equal(a.T_target_source, b.T_target_source)
        np.testing.assert_array_equal(a.information, b.information)
        assert (a.overlap_share, a.agreeing_share, a.loop) == (b.overlap_share, b.agreeing_share, b.loop)
    for a, b in zip(one.frames, other.frames, strict=True):
        assert (a is None) == (b is None)
        if a is not None and b is not None:
            assert a.keyframe == b.keyframe
            np.testing.assert_array_equal(a.T_keyframe_frame, b.T_keyframe_frame)


@pytest.mark.parametrize("stopped", [0, 1, 2])
def test_tracking_goes_on_to_the_same_bits(tmp_path, monkeypatch, stopped):
    """Before the first frame, after 10, in the middle of those that are lost, and after 20."""
    monkeypatch.setattr("pipeline.recording.tracking.REPORTED", 10)
    recording, checkpoint = lost_and_found(), Checkpoint(tmp_path / "state.npz")
    whole = drain(iterate_tracking(recording))
    steps = iterate_tracking(recording, None, checkpoint)
    for _ in range(stopped + 1):
        next(steps)
    steps.close()
    followed = []
    monkeypatch.setattr("pipeline.recording.tracking._Tracker.follow", counted(followed), raising=True)
    assert_same(drain(iterate_tracking(recording, None, checkpoint)), whole)
    assert followed == list(range(10 * stopped, 24))


def counted(numbers):
    from pipeline.recording.tracking import _Tracker

    follow = _Tracker.follow

    def counting(self, k, cloud):
        numbers.append(k)
        follow(self, k, cloud)

    return counting


def test_a_damaged_state_is_not_used(tmp_path):
    checkpoint = Checkpoint(tmp_path / "state.npz")
    assert checkpoint.read() is None
    checkpoint.write({"now": np.arange(3)})
    whole = checkpoint.path.read_bytes()
    np.testing.assert_array_equal(checkpoint.read()["now"], np.arange(3))
    for damage in (whole[: len(whole) // 2], b"", b"no archive", whole[:60] + b"\0" * 40 + whole[100:]):
        checkpoint.path.write_bytes(damage)
        assert checkpoint.read() is None
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".npz"] == ["state.npz"]


def test_the_time_of_all_interrupted_runs_adds_up(tmp_path):
    path, state = tmp_path / "state.npz", {"now": np.arange(3)}
    Checkpoint(path, began_s=time.monotonic() - 100.0).write(state)
    again = Checkpoint.of(path)
    assert again.resumed_s >= 100.0
    replace(again, began_s=again.began_s - 50.0).write(state)
    assert Checkpoint.of(path).resumed_s >= 150.0


def test_a_state_that_cannot_be_written_does_not_stop_the_tracking(tmp_path):
    (tmp_path / "file").write_text("no folder")
    checkpoint = Checkpoint(tmp_path / "file" / "state.npz")
    assert len(drain(iterate_tracking(in_the_living_room(around(36)[:3]), None, checkpoint)).frames) == 3


def test_the_state_belongs_to_these_files_and_settings(walk, tmp_path):
    folder = tmp_path / "walk"
    shutil.copytree(walk, folder)
    recording = open_recording(folder)
    own = checkpoint_of(recording, None)
    assert own == checkpoint_of(open_recording(folder), None)
    assert own != checkpoint_of(open_recording(folder, 1234.0), None)
    assert own != checkpoint_of(recording, [np.eye(4)] * 12)
    image = min((folder / "depth").iterdir())
    os.utime(image, ns=(1, 1))
    assert own != checkpoint_of(open_recording(folder), None)
    assert checkpoint_of(in_the_living_room(around(3)), None) is None


def test_the_depth_scale_counts_although_the_first_image_is_empty(tmp_path):
    depths_m = wall(4)
    depths_m[0][:] = np.nan
    folder = write_tum(tmp_path / "walk", depths_m)
    one, other = (checkpoint_of(open_recording(folder, scale), None) for scale in (5000.0, 1234.0))
    assert one != other


def test_a_finished_walk_keeps_its_tracking_until_the_results_are_written(walk, monkeypatch):
    recording = open_recording(walk)
    steps = iterate_walk(recording)
    for step in steps:
        if "mapping" in step.stage:
            break
    steps.close()
    rig = drain(iterate_walk(recording))
    assert rig.walk.resumed_s > 0.0
    assert list((cache_folder() / "tracking").iterdir()) == [rig.walk.state]
    tracked = []
    monkeypatch.setattr("pipeline.recording.tracking._Tracker.follow", counted(tracked))
    again = drain(iterate_walk(recording))
    assert tracked == []
    assert again.walk.resumed_s == rig.walk.resumed_s
    np.testing.assert_array_equal(rig.walk.map.points_m, again.walk.map.points_m)
    np.testing.assert_array_equal(rig.walk.map.colors, again.walk.map.colors)


def test_an_error_says_whether_the_tracking_is_kept(walk):
    steps = iterate_walk(open_recording(walk))
    for step in steps:
        if "mapping" in step.stage:
            break
    with pytest.raises(KeyboardInterrupt) as stopped:
        steps.throw(KeyboardInterrupt())
    assert stopped.value.__notes__ == [GOES_ON]
    steps = iterate_walk(in_the_living_room(around(6)))
    next(steps)
    with pytest.raises(KeyboardInterrupt) as stopped:
        steps.throw(KeyboardInterrupt())
    assert not hasattr(stopped.value, "__notes__")


def test_old_states_are_deleted(walk):
    own = checkpoint_of(open_recording(walk), None)
    own.write({})
    old = own.path.with_name("old.npz")
    shutil.copy(own.path, old)
    os.utime(old, (time.time() - 1.1 * OLD_S,) * 2)
    checkpoint_of(open_recording(walk), None)
    assert list(own.path.parent.iterdir()) == [own.path]
