"""Captures of telephones: photographs with LiDAR depth of the same view in fewer pixels."""

import json
import shutil
from dataclasses import replace

import av
import cv2
import numpy as np
import pytest
from PIL import Image

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.recorded import open_recording
from pipeline.io.images import read_depth
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.rigs import load_rig
from pipeline.types import Rig
from tests.pipeline.importing.phone_captures import (
    PHOTO,
    photograph,
    write_polycam,
    write_record3d,
    write_stray,
)
from tests.pipeline.importing.recordings import CAMERA, orbit
from tests.pipeline.strangers.containers import write_video
from tests.pipeline.strangers.phones import write_scanner_app

WRITERS = {"Stray Scanner": write_stray, "Polycam": write_polycam, "Record3D": write_record3d}


def imported(tmp_path, **options):
    report = drain(iterate_import(tmp_path / "capture", tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig").frames


@pytest.mark.parametrize("kind", WRITERS)
def test_a_capture_is_the_rig_that_it_was_written_from(tmp_path, kind):
    written = orbit(3)
    WRITERS[kind](tmp_path / "capture", written)
    report, frames = imported(tmp_path)
    assert report.kind == kind
    for index, (frame, expected) in enumerate(zip(frames, written.frames, strict=True)):
        node = tmp_path / "rig" / f"node_{index:02d}"
        np.testing.assert_array_equal(frame.rgb, photograph(expected))
        z_m = read_depth(node / "depth.png").z_m
        known = np.isfinite(z_m)
        np.testing.assert_allclose(z_m[known], expected.depth.z_m[known], atol=1e-6)
        np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-9)
        small = read_intrinsics(node / "depth_intrinsics.json")
        np.testing.assert_allclose(small.matrix[1:], CAMERA.matrix[1:], atol=1e-12)
    assert any("40 x 30 pixels and colour 120 x 90: taken as the same view" in note for note in report.notes)


@pytest.mark.parametrize("kind", ["Polycam", "Record3D"])
def test_every_keyframe_has_its_own_camera(tmp_path, kind):
    if kind == "Polycam":
        write_polycam(tmp_path / "capture", orbit(3))
    else:
        write_record3d(tmp_path / "capture", orbit(3), each=True)
    _, frames = imported(tmp_path)
    assert [frame.intrinsics.fx_px for frame in frames] == [90.0, 91.0, 92.0]
    small = read_intrinsics(tmp_path / "rig" / "node_02" / "depth_intrinsics.json")
    assert small.fx_px == pytest.approx(92.0 / 3.0)


def test_depth_of_the_lowest_confidence_is_left_out_and_said(tmp_path):
    written = orbit(2)
    write_stray(tmp_path / "capture", written, low=True)
    report, _ = imported(tmp_path)
    known = np.isfinite(read_depth(tmp_path / "rig" / "node_00" / "depth.png").z_m)
    expected = written.frames[0].depth.valid
    assert not known[:, :20].any()
    np.testing.assert_array_equal(known[:, 20:], expected[:, 20:])
    assert any("lowest confidence (0) is left out" in note for note in report.notes)


def test_all_depth_of_low_confidence_opens_when_the_confidence_is_removed(tmp_path):
    """The remedy of the message."""
    write_stray(tmp_path / "capture", orbit(2))
    for path in (tmp_path / "capture" / "confidence").iterdir():
        cv2.imwrite(str(path), np.zeros((30, 40), np.uint8))
    with pytest.raises(InputError, match=r"low confidence by .*; try to remove the confidence images"):
        imported(tmp_path)
    for path in (tmp_path / "capture" / "confidence").iterdir():
        path.unlink()
    assert len(imported(tmp_path)[1]) == 2


def test_an_uncorrected_session_of_polycam_has_its_first_cameras(tmp_path):
    written = orbit(2)
    write_polycam(tmp_path / "capture", written, corrected=False)
    (tmp_path / "capture" / "keyframes" / "corrected_cameras").mkdir()
    _, frames = imported(tmp_path)
    np.testing.assert_allclose(frames[1].T_world_camera, written.frames[1].T_world_camera, atol=1e-9)


@pytest.mark.parametrize("kind", WRITERS)
def test_intrinsics_that_are_given_are_taken(tmp_path, kind):
    WRITERS[kind](tmp_path / "capture", orbit(2))
    (tmp_path / "own.csv").write_text("80,0,60\n0,80,45\n0,0,1\n")
    _, frames = imported(tmp_path, intrinsics=tmp_path / "own.csv")
    assert [frame.intrinsics.fx_px for frame in frames] == [80.0, 80.0]


def test_cameras_of_odometry_are_taken_without_a_matrix(tmp_path):
    write_stray(tmp_path / "capture", orbit(2), matrix=False)
    _, frames = imported(tmp_path)
    np.testing.assert_array_equal(frames[1].intrinsics.matrix, PHOTO.matrix)


def test_a_capture_without_any_camera_opens_with_intrinsics(tmp_path):
    """The remedy of the message."""
    write_stray(tmp_path / "capture", orbit(2), matrix=False)
    odometry = tmp_path / "capture" / "odometry.csv"
    short = [",".join(line.split(",")[:9]) for line in odometry.read_text().splitlines()]
    odometry.write_text("\n".join(short) + "\n")
    with pytest.raises(InputError, match=r"no camera_matrix.csv, .*; try --intrinsics FILE"):
        imported(tmp_path)
    (tmp_path / "own.csv").write_text("80,0,60\n0,80,45\n0,0,1\n")
    assert len(imported(tmp_path, intrinsics=tmp_path / "own.csv")[1]) == 2


def as_video(folder, codec="mpeg4"):
    """Replace the photographs by rgb.mp4, as the app leaves them."""
    photographs = sorted((folder / "rgb").iterdir())
    write_video(folder / "rgb.mp4", [np.asarray(Image.open(path)) for path in photographs], codec)
    shutil.rmtree(folder / "rgb")


def grey(count):
    """A rig whose photographs are even grey of 20 k, which a video keeps."""
    frames = orbit(count).frames
    return Rig("grey", tuple(replace(own, rgb=np.full_like(own.rgb, 20 * k)) for k, own in enumerate(frames)))


@pytest.mark.parametrize("codec", ["mpeg4", "libx264"])
def test_frames_of_a_video_are_read_in_any_order(tmp_path, codec):
    """Also of H.264, whose frames are stored in another order than they are shown in."""
    if codec not in av.codecs_available:
        pytest.skip(f"this FFmpeg has no {codec}")
    write_stray(tmp_path / "capture", grey(12))
    as_video(tmp_path / "capture", codec)
    recording = open_recording(tmp_path / "capture")
    np.testing.assert_allclose(recording.times_s, 0.1 * np.arange(12))
    for k in (0, 1, 2, 11, 3, 10, 3, 7, 0):
        frame = recording.frame(k)
        assert np.abs(frame.rgb.astype(int) - 20 * k).max() <= 4
        np.testing.assert_array_equal(frame.intrinsics.matrix, PHOTO.matrix)
    assert recording.T_world_camera is not None


def test_a_video_with_other_frames_than_depth_counts_them_by_number(tmp_path):
    write_stray(tmp_path / "capture", grey(6))
    as_video(tmp_path / "capture")
    (tmp_path / "capture" / "depth" / "000002.png").unlink()
    report, _ = imported(tmp_path)
    assert any("rgb.mp4 has 6 frames and depth/ 5 images: 5 are used" in note for note in report.notes)
    recording = open_recording(tmp_path / "capture")
    for place, k in enumerate((0, 1, 3, 4, 5)):
        assert np.abs(recording.frame(place).rgb.astype(int) - 20 * k).max() <= 4


@pytest.mark.parametrize("data", [b"", b"no video", None])
def test_a_damaged_video_gets_a_sentence(tmp_path, data):
    write_stray(tmp_path / "capture", grey(3))
    as_video(tmp_path / "capture")
    video = tmp_path / "capture" / "rgb.mp4"
    video.write_bytes(video.read_bytes()[:-200] if data is None else data)
    with pytest.raises(InputError, match=r"rgb.mp4 cannot be read as a video file"):
        imported(tmp_path)


def test_a_capture_without_photographs_and_video_gets_a_sentence(tmp_path):
    write_stray(tmp_path / "capture", orbit(2))
    shutil.rmtree(tmp_path / "capture" / "rgb")
    with pytest.raises(InputError, match=r"neither photographs in rgb/ nor the video rgb.mp4"):
        imported(tmp_path)


def test_frames_of_3d_scanner_app_are_those_that_were_written(tmp_path):
    written = orbit(3)
    write_scanner_app(tmp_path / "capture", written)
    report, frames = imported(tmp_path)
    assert (report.kind, report.candidates) == ("3D Scanner App", 3)
    for k, (frame, expected) in enumerate(zip(frames, written.frames, strict=True)):
        node = tmp_path / "rig" / f"node_{k:02d}"
        known = expected.depth.valid
        np.testing.assert_allclose(read_depth(node / "depth.png").z_m[known], expected.depth.z_m[known])
        np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-9)
        np.testing.assert_allclose(frame.intrinsics.matrix, PHOTO.matrix)
    np.testing.assert_allclose(open_recording(tmp_path / "capture").times_s, [40.0, 40.1, 40.2])


@pytest.mark.parametrize("key", ["intrinsics", "cameraPoseARFrame"])
def test_a_frame_of_3d_scanner_app_without_a_matrix_gets_a_sentence(tmp_path, key):
    write_scanner_app(tmp_path / "capture", orbit(2))
    file = tmp_path / "capture" / "frame_00006.json"
    values = json.loads(file.read_text())
    values[key] = values[key][:-1]
    file.write_text(json.dumps(values))
    with pytest.raises(InputError, match=r"frame_00006.json is not in 3D Scanner App's format"):
        imported(tmp_path)


def test_depth_without_photographs_of_3d_scanner_app_gets_a_sentence(tmp_path):
    write_scanner_app(tmp_path / "capture", orbit(2))
    for path in (tmp_path / "capture").glob("*.jpg"):
        path.unlink()
    with pytest.raises(InputError, match=r"it lacks frame_00000.jpg"):
        imported(tmp_path)


@pytest.mark.parametrize(
    ("kind", "file", "text", "says"),
    [
        ("Stray Scanner", "odometry.csv", "time; place\n1; 2\n", "not in Stray Scanner's format"),
        ("Stray Scanner", "odometry.csv", "timestamp, frame, x\n0, 1, x\n", "not in Stray Scanner's format"),
        ("Stray Scanner", "odometry.csv", " \n\n", "not in Stray Scanner's format"),
        ("Stray Scanner", "odometry.csv", "timestamp, frame\n0, inf\n", "not in Stray Scanner's format"),
        ("Record3D", "metadata.json", '{"K": [1, 2], "w": 9, "h": 9}', "not in Record3D's format"),
        (
            "Record3D",
            "metadata.json",
            '{"K": [9e4, 0, 0, 0, 1, 0, 5, 5, 1], "w": 9, "h": 9}',
            "which no lens has",
        ),
    ],
)
def test_a_damaged_file_of_a_capture_gets_a_sentence(tmp_path, kind, file, text, says):
    WRITERS[kind](tmp_path / "capture", orbit(2))
    (tmp_path / "capture" / file).write_text(text)
    with pytest.raises(InputError, match=says) as error:
        imported(tmp_path)
    assert file in str(error.value)
    assert not (tmp_path / "rig").exists()


def test_a_camera_of_polycam_without_a_number_gets_a_sentence(tmp_path):
    write_polycam(tmp_path / "capture", orbit(2))
    file = next((tmp_path / "capture" / "keyframes" / "corrected_cameras").iterdir())
    values = json.loads(file.read_text())
    del values["t_12"]
    file.write_text(json.dumps(values))
    with pytest.raises(InputError, match=rf"{file.name} is not in Polycam's format"):
        imported(tmp_path)
