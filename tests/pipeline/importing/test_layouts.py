"""Recordings in other people's layouts become the rig they were written from."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.images import read_depth
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import LEVEL_POSE, look_at, rigid
from pipeline.types import DepthMap, RgbdFrame, Rig
from tests.pipeline.importing.recordings import (
    CAMERA,
    LAYOUTS,
    orbit,
    write_redwood,
    write_scannet,
    write_seven_scenes,
    write_sunrgbd,
    write_tum,
)

every_layout = pytest.mark.parametrize("kind", LAYOUTS)


def imported(tmp_path, **options):
    """The report and the rig."""
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig")


def assert_same(frame: RgbdFrame, expected: RgbdFrame):
    np.testing.assert_array_equal(frame.rgb, expected.rgb)
    np.testing.assert_array_equal(frame.depth.z_m, expected.depth.z_m)
    np.testing.assert_array_equal(frame.intrinsics.matrix, CAMERA.matrix)
    np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-6)


@every_layout
def test_a_recording_is_the_rig_that_it_was_written_from(tmp_path, kind):
    written = orbit(3)
    LAYOUTS[kind](tmp_path / "recording", written)
    report, rig = imported(tmp_path)
    assert report.kind == kind
    for frame, expected in zip(rig.frames, written.frames, strict=True):
        assert_same(frame, expected)


@every_layout
def test_chosen_frames_keep_their_own_depth_and_pose(tmp_path, kind):
    written = orbit(12)
    LAYOUTS[kind](tmp_path / "recording", written)
    report, rig = imported(tmp_path, frames=4)
    assert report.candidates == 12
    assert len(rig.frames) == 4
    for frame in rig.frames:
        (expected,) = (own for own in written.frames if np.array_equal(own.rgb, frame.rgb))
        assert_same(frame, expected)


def test_the_recording_may_lie_in_the_folder_that_is_named(tmp_path):
    write_tum(tmp_path / "recording" / "rgbd_dataset_x", orbit(2))
    report, rig = imported(tmp_path)
    assert report.folder.endswith("rgbd_dataset_x")
    assert len(rig.frames) == 2


def test_rotated_bits_are_turned_back_and_a_frame_without_pose_stands_level(tmp_path):
    (expected,) = orbit(1).frames
    write_sunrgbd(tmp_path / "recording", expected)
    report, rig = imported(tmp_path)
    np.testing.assert_array_equal(rig.frames[0].depth.z_m, expected.depth.z_m)
    np.testing.assert_array_equal(rig.frames[0].T_world_camera, LEVEL_POSE)
    assert any("bits" in note for note in report.notes)


def test_a_world_on_its_side_is_turned_upright_and_the_cameras_stay_as_they_are_to_each_other(tmp_path):
    """Redwood's world has the axes of the first camera: its y points down."""
    upright = orbit(3)
    T_first = upright.frames[0].T_world_camera
    fallen = [np.linalg.inv(T_first) @ frame.T_world_camera for frame in upright.frames]
    frames = tuple(
        RgbdFrame(frame.name, frame.rgb, frame.depth, frame.intrinsics, T)
        for frame, T in zip(upright.frames, fallen, strict=True)
    )
    write_redwood(tmp_path / "recording", Rig("fallen", frames))
    report, rig = imported(tmp_path)
    poses = [frame.T_world_camera for frame in rig.frames]
    assert any("z is up" in note for note in report.notes)
    assert np.mean([-T[2, 1] for T in poses]) > 0.9
    for T, own in zip(poses, fallen, strict=True):
        np.testing.assert_allclose(np.linalg.inv(poses[0]) @ T, np.linalg.inv(fallen[0]) @ own, atol=1e-6)


def test_frames_that_lost_their_track_are_left_out(tmp_path):
    write_scannet(tmp_path / "recording", orbit(3))
    (tmp_path / "recording" / "pose" / "1.txt").write_text("-inf -inf -inf -inf\n" * 4)
    report, rig = imported(tmp_path)
    assert len(rig.frames) == 2
    assert any("1 of 3 frames have no pose" in note for note in report.notes)


def test_depth_with_a_camera_of_its_own_is_registered_when_the_rig_is_read(tmp_path):
    """A wall 2 m ahead of both cameras has the same depth in the colour camera's image."""
    folder = tmp_path / "recording"
    write_scannet(folder, orbit(2))
    for index in range(2):
        cv2.imwrite(str(folder / "depth" / f"{index}.png"), np.full((15, 20), 2000, np.uint16))
    (folder / "intrinsic" / "intrinsic_depth.txt").write_text("12 0 9.5 0\n0 12 7 0\n0 0 1 0\n0 0 0 1\n")
    np.savetxt(folder / "intrinsic" / "extrinsic_depth.txt", rigid(np.eye(3), np.array([0.02, 0.0, 0.0])))
    _, rig = imported(tmp_path)
    assert rig.frames[0].depth.z_m.shape == (30, 40)
    np.testing.assert_allclose(rig.frames[0].depth.z_m, 2.0, atol=1e-6)


def test_a_depth_scale_that_is_given_counts_and_one_that_makes_no_room_is_said(tmp_path):
    write_tum(tmp_path / "recording", orbit(2))
    report, rig = imported(tmp_path, depth_scale=250.0)
    assert report.depth_scale == 250.0
    assert np.nanmedian(rig.frames[0].depth.z_m) == pytest.approx(40.0, abs=3.0)
    assert any("--depth-scale 5000" in note for note in report.notes)


def test_what_was_assumed_is_said(tmp_path):
    write_tum(tmp_path / "recording", orbit(2))
    (tmp_path / "recording" / "groundtruth.txt").unlink()
    report, _ = imported(tmp_path)
    assert any("poses are not known" in note for note in report.notes)
    assert any("5000 units in a metre" in note for note in report.notes)


def test_65535_is_no_value(tmp_path):
    write_seven_scenes(tmp_path, orbit(1))
    z_m = read_depth(tmp_path / "frame-000000.depth.png").z_m
    assert np.isnan(z_m[:6, :8]).all()
    assert np.isfinite(z_m[6:]).all()


def no_depth(folder):
    write_seven_scenes(folder, orbit(2))
    for path in folder.glob("*.depth.png"):
        path.unlink()


def clocks_disagree(folder):
    write_tum(folder, orbit(2))
    (folder / "depth.txt").write_text("17.0 depth/a.png\n")


def other_size(folder):
    write_tum(folder, orbit(2))
    for path in (folder / "depth").iterdir():
        cv2.imwrite(str(path), np.full((15, 24), 9000, np.uint16))


def camera_of_other_size(folder):
    write_redwood(folder, orbit(2))
    (folder / "camera_intrinsic.json").unlink()


def damaged_trajectory(folder):
    write_redwood(folder, orbit(2))
    (folder / "trajectory.log").write_text("0 0 1\n1 0 0\n")


def bad_list(folder):
    write_tum(folder, orbit(2))
    (folder / "rgb.txt").write_text("noon rgb/a.png\n")


def two_recordings(folder):
    for name in ("seq-01", "seq-02"):
        write_seven_scenes(folder / name, orbit(1))


def all_unknown(folder):
    write_seven_scenes(folder, orbit(1))
    cv2.imwrite(str(folder / "frame-000000.depth.png"), np.full((30, 40), 65535, np.uint16))


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda folder: None, "does not exist"),
        (lambda folder: folder.mkdir(), "TUM .*7-Scenes .*ScanNet .*SUN RGB-D .*Redwood or Open3D"),
        (lambda folder: folder.write_text("a letter"), "is a file"),
        (no_depth, "frame-000000.depth.png"),
        (clocks_disagree, "20 ms"),
        (other_size, "24 x 15 pixels but .* 40 x 30, whose sides"),
        (camera_of_other_size, "--intrinsics"),
        (damaged_trajectory, "Redwood's format"),
        (bad_list, "noon"),
        (two_recordings, "seq-01, seq-02"),
        (all_unknown, "no depth anywhere"),
    ],
)
def test_what_cannot_be_used_gets_one_sentence_and_leaves_nothing(tmp_path, spoil, says):
    spoil(tmp_path / "recording")
    with pytest.raises(InputError, match=says) as error:
        imported(tmp_path)
    assert "\n" not in str(error.value)
    assert [path.name for path in tmp_path.iterdir() if path.name != "recording"] == []


def test_a_rig_that_is_there_is_not_overwritten(tmp_path):
    write_tum(tmp_path / "recording", orbit(2))
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="rig is not empty; try another name"):
        imported(tmp_path)
    assert (tmp_path / "rig" / "notes.txt").read_text() == "mine"


def test_a_file_at_the_rig_s_place_is_kept(tmp_path):
    write_tum(tmp_path / "recording", orbit(2))
    (tmp_path / "rig").write_text("mine")
    with pytest.raises(InputError, match="rig exists already; try another name"):
        imported(tmp_path)
    assert (tmp_path / "rig").read_text() == "mine"


def test_the_working_folder_becomes_the_rig_if_it_is_empty(tmp_path, monkeypatch):
    written = orbit(2)
    write_tum(tmp_path / "recording", written)
    (tmp_path / "rig").mkdir()
    monkeypatch.chdir(tmp_path / "rig")
    drain(iterate_import(tmp_path / "recording", "."))
    assert sorted(path.name for path in Path(".").iterdir()) == ["node_00", "node_01"]
    for frame, expected in zip(load_rig(".").frames, written.frames, strict=True):
        assert_same(frame, expected)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["recording", "rig"]


def test_an_empty_folder_stays_empty_if_the_import_stops(tmp_path):
    write_tum(tmp_path / "recording", orbit(2))
    (tmp_path / "rig").mkdir()
    steps = iterate_import(tmp_path / "recording", tmp_path / "rig")
    while next(steps).stage != "images":
        pass
    assert list((tmp_path / "rig").iterdir())
    steps.close()
    assert list((tmp_path / "rig").iterdir()) == []


@pytest.mark.parametrize("options", [{"frames": 0}, {"frames": 201}, {"depth_scale": 0.0}])
def test_numbers_that_cannot_be_are_refused(tmp_path, options):
    write_tum(tmp_path / "recording", orbit(2))
    with pytest.raises(InputError, match="try 1"):
        imported(tmp_path, **options)


def test_cancelling_leaves_nothing(tmp_path):
    write_tum(tmp_path / "recording", orbit(3))
    steps = iterate_import(tmp_path / "recording", tmp_path / "rig")
    while next(steps).stage != "images":
        pass
    next(steps)
    steps.close()
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]


def test_a_mean_pose_of_look_at_has_z_up():
    """What the test above takes as upright is so by the rig's own convention."""
    assert -look_at((2.0, 0.0, 0.5), (0.0, 0.0, 0.0))[2, 1] > 0.9


def test_frames_that_were_not_looked_at_and_extrinsics_that_are_missing_are_said(tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.importing.import_rig.MOST_CANDIDATES", 4)
    written = orbit(10)
    write_scannet(tmp_path / "recording", written)
    report, _ = imported(tmp_path)
    assert report.candidates == 4
    assert "One in 3 of the 10 frames is used, by number and not by motion (at most 4)" in report.notes
    assert not any("extrinsic" in note for note in report.notes)


@pytest.mark.parametrize("suffix", [".tif", ".npy", ".pgm"])
def test_depth_may_come_in_other_suffixes(tmp_path, suffix):
    """And in floating point it is in metres, unless a scale is given."""
    written = orbit(3)
    write_redwood(tmp_path / "recording", written)
    for path in sorted((tmp_path / "recording" / "depth").glob("*.png")):
        units = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        path.unlink()
        other = path.with_suffix(suffix)
        if suffix == ".npy":
            np.save(other, units / np.float32(1000.0))
        else:
            cv2.imwrite(str(other), units)
    _, rig = imported(tmp_path)
    for frame, expected in zip(rig.frames, written.frames, strict=True):
        assert_same(frame, expected)


def test_a_wrong_scale_of_a_recording_is_said_by_its_values(tmp_path):
    """Millimetres times five where the kind has millimetres."""
    frames = tuple(replace(frame, depth=DepthMap(5.0 * frame.depth.z_m)) for frame in orbit(2).frames)
    write_redwood(tmp_path / "recording", Rig("five", frames))
    report, _ = imported(tmp_path)
    assert sum("try --depth-scale 5000" in note for note in report.notes) == 1


def test_what_a_killed_import_left_in_its_folder_is_no_obstacle_and_goes(tmp_path):
    write_tum(tmp_path / "recording", orbit(3))
    left = tmp_path / "rig" / ".rig-0123abcd" / "node_00"
    left.mkdir(parents=True)
    drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    assert sorted(path.name for path in (tmp_path / "rig").iterdir()) == ["node_00", "node_01", "node_02"]


def test_a_disk_that_is_full_names_the_folder_that_was_asked_for(tmp_path, monkeypatch):
    def full(path, *_):
        raise InputError(f"{path} cannot be written (No space left on device); delete something there")

    monkeypatch.setattr("pipeline.importing.rig_folder.write_color", full)
    write_tum(tmp_path / "recording", orbit(3))
    with pytest.raises(InputError) as stopped:
        drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    assert str(stopped.value).startswith(f"{tmp_path.resolve() / 'rig' / 'node_00' / 'color.png'} cannot")
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]
