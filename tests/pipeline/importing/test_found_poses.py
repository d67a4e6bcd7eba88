"""Poses of recordings that are not quite rotations, or none, are not said to be missing."""

import json

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.recorded import open_recording
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import (
    LAYOUTS,
    orbit,
    write_redwood,
    write_scannet,
    write_seven_scenes,
)

WITH_MATRICES = {"7-Scenes": write_seven_scenes, "ScanNet": write_scannet, "Redwood or Open3D": write_redwood}


def imported(tmp_path, **options):
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig").frames


def bend(folder, off, first_only=False):
    """Lengthen the first row of every rotation, so that it departs from orthonormal by ``off``."""

    def bent(rows):
        rows[0][:3] = (np.array(rows[0][:3], float) * np.sqrt(1.0 + off)).tolist()
        return [" ".join(f"{float(value):.12g}" for value in row) for row in rows]

    for path in sorted([*folder.glob("*.pose.txt"), *(folder / "pose").glob("*.txt")])[
        : 1 if first_only else None
    ]:
        path.write_text("\n".join(bent([line.split() for line in path.read_text().splitlines()])))
    for path in folder.glob("*.log"):
        lines = path.read_text().splitlines()
        for start in range(0, 5 if first_only else len(lines), 5):
            lines[start + 1 : start + 5] = bent([line.split() for line in lines[start + 1 : start + 5]])
        path.write_text("\n".join(lines))


@pytest.mark.parametrize("kind", WITH_MATRICES)
@pytest.mark.parametrize(("off", "said"), [(5e-4, False), (5e-3, True)])
def test_poses_that_are_nearly_rotations_are_taken_through_the_nearest(tmp_path, kind, off, said):
    written = orbit(3)
    WITH_MATRICES[kind](tmp_path / "recording", written)
    bend(tmp_path / "recording", off)
    report, frames = imported(tmp_path)
    for frame, expected in zip(frames, written.frames, strict=True):
        np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-6)
        rotation = frame.T_world_camera[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert any("orthonormal only to 0.005" in note for note in report.notes) is said


@pytest.mark.parametrize("kind", WITH_MATRICES)
def test_a_pose_that_is_none_is_left_out_with_the_reason(tmp_path, kind):
    WITH_MATRICES[kind](tmp_path / "recording", orbit(3))
    bend(tmp_path / "recording", 0.5, first_only=True)
    report, frames = imported(tmp_path)
    assert len(frames) == 2
    (note,) = (note for note in report.notes if "1 of 3 frames have no pose" in note)
    assert "is not a rigid transform: its 3 x 3 part is orthonormal only to 0.5" in note


@pytest.mark.parametrize("kind", WITH_MATRICES)
def test_a_recording_keeps_frames_without_a_pose(tmp_path, kind):
    written = orbit(3)
    WITH_MATRICES[kind](tmp_path / "recording", written)
    bend(tmp_path / "recording", 0.5, first_only=True)
    recording = open_recording(tmp_path / "recording")
    assert [T is None for T in recording.T_world_camera] == [True, False, False]
    np.testing.assert_allclose(recording.T_world_camera[1], written.frames[1].T_world_camera, atol=1e-6)
    assert not recording.frame(0).pose_known
    assert any("1 of 3 frames have no pose" in note for note in recording.notes)


@pytest.mark.parametrize("kind", WITH_MATRICES)
def test_poses_of_which_none_can_be_used_are_not_said_to_be_missing(tmp_path, kind):
    WITH_MATRICES[kind](tmp_path / "recording", orbit(2))
    bend(tmp_path / "recording", 0.5)
    report, frames = imported(tmp_path)
    assert not any(frame.pose_known for frame in frames)
    assert not any(note.startswith("No ") and "pose" in note for note in report.notes)
    (note,) = (note for note in report.notes if "poses are not known; reconstruct looks for them" in note)
    assert "is not a rigid transform" in note
    assert "(and 1 more)" in note


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("frame-000000.pose.txt", "1 2 3\n", "frame-000000.pose.txt does not hold 4 x 4 numbers"),
        ("frame-000000.pose.txt", "a b c d\n" * 4, "frame-000000.pose.txt does not hold 4 x 4 numbers"),
        ("frame-000000.pose.txt", "", "is empty"),
        ("frame-000000.pose.txt", "-inf -inf -inf -inf\n" * 4, "tracking was lost"),
    ],
)
def test_the_reason_is_the_file_s_own(tmp_path, name, text, why):
    write_seven_scenes(tmp_path / "recording", orbit(1))
    (tmp_path / "recording" / name).write_text(text)
    report, _ = imported(tmp_path)
    assert any(why in note and "poses are not known" in note for note in report.notes)


def test_poses_that_are_missing_are_said_to_be_missing(tmp_path):
    write_seven_scenes(tmp_path / "recording", orbit(1))
    (tmp_path / "recording" / "frame-000000.pose.txt").unlink()
    report, _ = imported(tmp_path)
    assert any(note.startswith("No frame-000000.pose.txt: poses are not known") for note in report.notes)


def test_a_trajectory_of_another_name_is_named_and_then_read(tmp_path):
    write_redwood(tmp_path / "recording", orbit(2))
    log = tmp_path / "recording" / "trajectory.log"
    log.rename(log.with_name("camera.log"))
    report, _ = imported(tmp_path)
    assert any("No trajectory .log (not named so: camera.log)" in note for note in report.notes)
    log.with_name("camera.log").rename(log)
    drain(iterate_import(tmp_path / "recording", tmp_path / "again"))
    assert all(frame.pose_known for frame in load_rig(tmp_path / "again").frames)


def test_extrinsics_of_scannet_that_are_none_open_when_they_are_removed(tmp_path):
    """The remedy of the message; then the identity is assumed, and said."""
    folder = tmp_path / "recording"
    write_scannet(folder, orbit(2))
    for index in range(2):
        cv2.imwrite(str(folder / "depth" / f"{index}.png"), np.full((15, 20), 2000, np.uint16))
    (folder / "intrinsic" / "intrinsic_depth.txt").write_text("12 0 9.5 0\n0 12 7 0\n0 0 1 0\n0 0 0 1\n")
    bad = folder / "intrinsic" / "extrinsic_depth.txt"
    np.savetxt(bad, np.diag([2.0, 2.0, 2.0, 1.0]))
    with pytest.raises(
        InputError, match=r"extrinsic_depth.txt is not a rigid transform: it enlarges by 2; try"
    ):
        imported(tmp_path)
    bad.unlink()
    report, frames = imported(tmp_path)
    assert len(frames) == 2
    assert any("No extrinsic_depth.txt: taken as the identity" in note for note in report.notes)


@pytest.mark.parametrize("kind", ["7-Scenes", "Redwood or Open3D", "TUM"])
def test_intrinsics_that_were_assumed_are_not_said_to_exist(tmp_path, kind):
    """And the remedy, --intrinsics FILE, works."""
    LAYOUTS[kind](tmp_path / "recording", orbit(2))
    for path in [
        *(tmp_path / "recording").glob("*intrinsic*"),
        *(tmp_path / "recording").glob("camera.json"),
    ]:
        path.unlink()
    (tmp_path / "recording" / "scan.json").write_text('{"name": "a room"}')
    says = (
        r"no intrinsics that can be read \(scan.json holds none\), and .* has 40 x 30 pixels, not the 640 x "
        "480 of the camera that would be assumed .*; try --intrinsics FILE"
    )
    with pytest.raises(InputError, match=says):
        imported(tmp_path)
    (tmp_path / "own.txt").write_text("30 0 19.5\n0 30.5 14.5\n0 0 1\n")
    assert len(imported(tmp_path, intrinsics=tmp_path / "own.txt")[1]) == 2


def test_intrinsics_of_another_size_are_named_and_those_of_the_size_are_found_first(tmp_path):
    write_redwood(tmp_path / "recording", orbit(2))
    wide = {"width": 80, "height": 30, "fx": 30.0, "fy": 30.0, "cx": 40.0, "cy": 15.0}
    (tmp_path / "recording" / "a_wide.json").write_text(json.dumps(wide))
    assert len(imported(tmp_path)[1]) == 2
    (tmp_path / "recording" / "camera_intrinsic.json").unlink()
    with pytest.raises(
        InputError, match=r"a_wide.json is for 80 x 30 pixels but .* has 40 x 30; try --intrinsics"
    ):
        drain(iterate_import(tmp_path / "recording", tmp_path / "other"))


@pytest.mark.parametrize("name", ["camera.yaml", "calibration.yml", "camera_matrix.csv"])
def test_intrinsics_may_be_in_other_files(tmp_path, name):
    write_redwood(tmp_path / "recording", orbit(2))
    (tmp_path / "recording" / "camera_intrinsic.json").unlink()
    text = (
        "30,0,19.5\n0,30.5,14.5\n0,0,1\n"
        if name.endswith("csv")
        else "image_width: 40\nimage_height: 30\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
        "  data: [30, 0, 19.5, 0, 30.5, 14.5, 0, 0, 1]\n"
    )
    (tmp_path / "recording" / name).write_text(text)
    _, frames = imported(tmp_path)
    assert frames[0].intrinsics.fy_px == 30.5


def test_poses_of_scannet_under_other_names_are_looked_for_by_the_name_that_is_told(tmp_path):
    write_scannet(tmp_path / "recording", orbit(2))
    pose = tmp_path / "recording" / "pose"
    for index in range(2):
        (pose / f"{index}.txt").rename(pose / f"frame{index}.txt")
    report, _ = imported(tmp_path)
    assert any(note.startswith("No pose/0.txt: poses are not known") for note in report.notes)
