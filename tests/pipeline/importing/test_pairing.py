"""Colour, depth and poses of numbered frames belong together, also where images are missing."""

import json

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.rigs import load_rig
from pipeline.types import DepthMap
from tests.pipeline.importing.phone_captures import write_record3d
from tests.pipeline.importing.recordings import CAMERA, orbit, write_redwood


def imported(tmp_path, **options):
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig").frames


def steps(frames):
    poses = [frame.T_world_camera for frame in frames]
    return [np.linalg.inv(poses[0]) @ T for T in poses[1:]]


def assert_are(frames, rig, kept):
    expected = [rig.frames[k] for k in kept]
    for frame, own in zip(frames, expected, strict=True):
        np.testing.assert_array_equal(frame.rgb, own.rgb)
    np.testing.assert_allclose(steps(frames), steps(expected), atol=1e-5)


def images(folder, name, k):
    return sorted((folder / name).iterdir())[k]


@pytest.mark.parametrize("names", [["depth"], ["image"], ["depth", "image"]])
@pytest.mark.parametrize("write", [write_redwood])
def test_poses_stay_with_their_images_where_some_are_deleted(tmp_path, write, names):
    written = orbit(4)
    write(tmp_path / "recording", written)
    for name in names:
        images(tmp_path / "recording", name, 1).unlink()
    report, frames = imported(tmp_path, frames=6)
    assert_are(frames, written, [0, 2, 3])
    says = "have 4 and 3 images" if names == ["depth"] else "have 3 and 4 images"
    assert any(says in note and "3 pairs" in note for note in report.notes) is (len(names) == 1)


def test_a_trajectory_with_a_pose_for_each_pair_is_that_of_the_pairs(tmp_path):
    """Open3D numbers the frames that it has."""
    written = orbit(4)
    write_redwood(tmp_path / "recording", written)
    images(tmp_path / "recording", "depth", 1).unlink()
    log = tmp_path / "recording" / "trajectory.log"
    rows = log.read_text().splitlines()
    log.write_text("\n".join([*rows[:5], "1 1 2", *rows[11:15], "2 2 3", *rows[16:20]]) + "\n")
    assert_are(imported(tmp_path, frames=6)[1], written, [0, 2, 3])


def test_record3d_s_poses_and_cameras_stay_with_their_frames(tmp_path):
    written = orbit(4)
    write_record3d(tmp_path / "recording", written)
    metadata = tmp_path / "recording" / "metadata.json"
    values = json.loads(metadata.read_text())
    values["perFrameIntrinsicCoeffs"] = [[30.0 + k, 30.0 + k, 19.5, 14.5] for k in range(4)]
    metadata.write_text(json.dumps(values))
    images(tmp_path / "recording", "depth", 1).unlink()
    _, frames = imported(tmp_path, frames=6)
    assert [frame.intrinsics.fx_px for frame in frames] == [30.0, 32.0, 33.0]
    np.testing.assert_allclose(steps(frames), steps([written.frames[k] for k in (0, 2, 3)]), atol=1e-5)


def write_named(folder, color_names, depth_names):
    for name, frame in zip(color_names, orbit(len(color_names)).frames, strict=True):
        write_color(folder / "rgb" / f"{name}.png", frame.rgb)
    for name, frame in zip(depth_names, orbit(len(depth_names)).frames, strict=True):
        write_depth_mm(folder / "depth" / f"{name}.png", frame.depth)
    (folder / "K.json").write_text(
        json.dumps({"width": 40, "height": 30, "fx": 30, "fy": 30.5, "cx": 19.5, "cy": 14.5})
    )


def test_names_that_are_times_are_paired_by_time(tmp_path):
    """Seconds alone would pair images 0.8 s apart."""
    write_named(tmp_path / "recording", ["100.90", "101.90", "103.0"], ["100.10", "101.905", "102.985"])
    report, frames = imported(tmp_path)
    pairs = [(frame.color[-10:], frame.depth[-11:]) for frame in report.frames]
    assert pairs == [("101.90.png", "101.905.png"), ("/103.0.png", "102.985.png")]
    np.testing.assert_array_equal(frames[0].intrinsics.matrix, CAMERA.matrix)


def test_numbers_count_by_their_value(tmp_path):
    write_named(tmp_path / "recording", ["1", "2", "10"], ["01", "02", "10"])
    report, _ = imported(tmp_path)
    assert [frame.color.rpartition("/")[2] for frame in report.frames] == ["1.png", "2.png", "10.png"]


def test_images_shifted_by_one_are_counted(tmp_path):
    write_named(tmp_path / "recording", ["0", "1", "2"], ["1", "2", "3"])
    report, _ = imported(tmp_path)
    assert any(
        "rgb/ and depth/ have 3 and 3 images, of which 2 pairs have the same number" in n
        for n in report.notes
    )


def test_of_two_images_of_one_number_none_is_chosen(tmp_path):
    write_named(tmp_path / "recording", ["0", "1"], ["0", "1"])
    preview = tmp_path / "recording" / "depth" / "1_preview.png"
    write_color(preview, orbit(1).frames[0].rgb)
    with pytest.raises(
        InputError, match=r"several images of the same number, 1.png and 1_preview.png; try to"
    ):
        imported(tmp_path)
    preview.unlink()
    assert len(imported(tmp_path)[1]) == 2


def test_many_images_with_intrinsics_txt_are_no_sun_rgbd_frame(tmp_path):
    """SUN RGB-D has one image in a folder; all others would be dropped."""
    written = orbit(4)
    write_redwood(tmp_path / "recording", written)
    (tmp_path / "recording" / "camera_intrinsic.json").unlink()
    (tmp_path / "recording" / "intrinsics.txt").write_text("30 0 19.5\n0 30.5 14.5\n0 0 1\n")
    report, frames = imported(tmp_path, frames=6)
    assert report.kind == "Redwood or Open3D"
    assert_are(frames, written, [0, 1, 2, 3])


def test_hidden_files_of_a_mac_are_no_images(tmp_path):
    written = orbit(3)
    write_redwood(tmp_path / "recording", written)
    for name in ("image", "depth"):
        for path in list((tmp_path / "recording" / name).iterdir()):
            path.with_name(f"._{path.name}").write_bytes(b"Mac OS X")
    report, frames = imported(tmp_path)
    assert_are(frames, written, [0, 1, 2])
    assert report.candidates == 3


@pytest.mark.parametrize("empty", [[0], [2], [0, 2, 3]])
def test_frames_without_any_depth_are_left_out(tmp_path, empty):
    """As the first ones of some sensors."""
    written = orbit(5)
    write_redwood(tmp_path / "recording", written)
    for k in empty:
        unknown = DepthMap(np.full((30, 40), np.nan, np.float32))
        write_depth_mm(images(tmp_path / "recording", "depth", k), unknown)
    report, frames = imported(tmp_path, frames=6)
    assert_are(frames, written, [k for k in range(5) if k not in empty])
    count = (
        "1 frame without any depth was" if len(empty) == 1 else f"{len(empty)} frames without any depth were"
    )
    assert f"{count} left out" in report.notes
