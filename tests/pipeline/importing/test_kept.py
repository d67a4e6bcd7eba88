"""All frames of a recording, kept as a folder in TUM's form."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_keep
from pipeline.importing.recorded import open_recording
from pipeline.types import DepthMap, Rig
from tests.pipeline.importing.phone_captures import write_polycam, write_stray
from tests.pipeline.importing.recordings import orbit, write_seven_scenes, write_tum
from tests.pipeline.importing.test_bag_motion import times
from tests.pipeline.importing.test_bag_motion import write as write_moving


def kept(path, out, **options):
    report = drain(iterate_keep(path, out, **options))
    return report, open_recording(out)


def test_frames_times_poses_and_camera_are_those_of_the_bag(tmp_path):
    bag = write_moving(tmp_path / "walk.bag")
    report, found = kept(tmp_path / "walk.bag", tmp_path / "out")
    assert (report.kind, report.candidates, report.frames) == ("bag", 5, 5)
    assert found.kind == "TUM"
    np.testing.assert_allclose(found.times_s, bag.times_s, atol=1e-6)
    for k in range(5):
        frame, expected = found.frame(k), bag.frame(k)
        np.testing.assert_array_equal(frame.rgb, expected.rgb)
        np.testing.assert_allclose(frame.depth.z_m, expected.depth.z_m, atol=1e-6)
        np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-7)
        np.testing.assert_array_equal(frame.intrinsics.matrix, expected.intrinsics.matrix)


def test_the_form_is_what_other_programs_read(tmp_path):
    """Times and names in two columns, 5000 units in a metre, poses as tx ty tz qx qy qz qw."""
    write_seven_scenes(tmp_path / "scenes", orbit(2))
    kept(tmp_path / "scenes", tmp_path / "out")
    for name in ("rgb", "depth"):
        comment, first, second = (tmp_path / "out" / f"{name}.txt").read_text().splitlines()
        assert comment.startswith("#")
        assert [first, second] == [f"0.000000 {name}/00000.png", f"0.033333 {name}/00001.png"]
    depth = cv2.imread(str(tmp_path / "out" / "depth" / "00001.png"), cv2.IMREAD_UNCHANGED)
    expected = np.rint(5000.0 * np.nan_to_num(orbit(2).frames[1].depth.z_m))
    np.testing.assert_array_equal(depth, expected)
    line = (tmp_path / "out" / "groundtruth.txt").read_text().splitlines()[1].split()
    np.testing.assert_allclose(np.array(line[1:4], float), [2.0, 0.0, 0.5], atol=1e-6)


def test_without_poses_there_is_no_ground_truth(tmp_path):
    write_tum(tmp_path / "tum", orbit(2))
    (tmp_path / "tum" / "groundtruth.txt").unlink()
    _, found = kept(tmp_path / "tum", tmp_path / "out")
    assert not (tmp_path / "out" / "groundtruth.txt").exists()
    assert found.T_world_camera is None


def test_frames_without_a_pose_have_no_line_in_the_ground_truth(tmp_path):
    write_moving(tmp_path / "walk.bag", moved=times(first_s=0.3))
    report, _ = kept(tmp_path / "walk.bag", tmp_path / "out")
    assert report.frames == 5
    lines = (tmp_path / "out" / "groundtruth.txt").read_text().splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["100.500000", "101.000000", "101.500000", "102.000000"]


def far_and_blind():
    """Three frames: one with a corner 20 m away, one without any depth."""
    written = orbit(3)
    far, nothing = written.frames[0].depth.z_m.copy(), np.full((30, 40), np.nan, np.float32)
    far[20:, 30:] = 20.0
    depths = [far, nothing, written.frames[2].depth.z_m]
    frames = (replace(f, depth=DepthMap(z_m)) for f, z_m in zip(written.frames, depths, strict=True))
    return Rig("far", tuple(frames))


def test_what_the_form_cannot_hold_is_said(tmp_path):
    write_seven_scenes(tmp_path / "scenes", far_and_blind())
    report, found = kept(tmp_path / "scenes", tmp_path / "out")
    assert (report.candidates, report.frames, len(found.times_s)) == (3, 2, 2)
    assert "100 depths beyond 13.1 m, the form's largest, were left out" in report.notes
    assert any(note.startswith("1 of 3 frames were left out, the first because:") for note in report.notes)
    assert not found.view(0).depth.valid[20:, 30:].any()
    np.testing.assert_array_equal(found.frame(1).rgb, orbit(3).frames[2].rgb)


def test_depth_in_fewer_pixels_is_registered_to_colour(tmp_path):
    write_stray(tmp_path / "capture", orbit(2))
    _, found = kept(tmp_path / "capture", tmp_path / "out")
    expected = open_recording(tmp_path / "capture").frame(1)
    frame = found.frame(1)
    assert frame.depth.z_m.shape == frame.rgb.shape[:2] == (90, 120)
    np.testing.assert_allclose(frame.depth.z_m, expected.depth.z_m, atol=1.01e-4)


def test_a_camera_that_changes_is_refused_and_nothing_is_left(tmp_path):
    write_polycam(tmp_path / "capture", orbit(3))
    with pytest.raises(InputError, match="TUM's form has only one; try `packetmesh reconstruct --recording`"):
        kept(tmp_path / "capture", tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["capture"]


def test_a_folder_with_files_is_not_overwritten(tmp_path):
    write_tum(tmp_path / "tum", orbit(2))
    with pytest.raises(InputError, match="is not empty; try another name"):
        kept(tmp_path / "tum", tmp_path / "tum")
    steps = iterate_keep(tmp_path / "tum", tmp_path / "out")
    told = [next(steps).fraction for _ in range(1)]
    steps.close()
    assert told == sorted(told)
    assert not (tmp_path / "out").exists()
