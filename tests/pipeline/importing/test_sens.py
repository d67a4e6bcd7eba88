"""ScanNet's .sens: all frames of a scan in one file."""

import struct

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.recorded import open_recording
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import CAMERA, orbit
from tests.pipeline.strangers.containers import write_sens
from tests.pipeline.strangers.images import photograph

HEADER_BYTES = 12 + len(b"StructureSensor") + 256 + 24 + 12


@pytest.mark.parametrize("compressions", [(0, 0), (1, 1), (2, 1)])
def test_the_frames_are_those_that_were_written_in_any_order(tmp_path, compressions):
    written = orbit(4)
    recording = open_recording(write_sens(tmp_path / "scan", written, compressions))
    assert (recording.kind, recording.name) == ("ScanNet .sens", "scene0000_00.sens")
    np.testing.assert_allclose(recording.times_s, 1.0 + 0.033333 * np.arange(4))
    for k in (3, 0, 2, 1):
        expected, view, frame = written.frames[k], recording.view(k), recording.frame(k)
        np.testing.assert_array_equal(view.depth.z_m, expected.depth.z_m)
        np.testing.assert_allclose(view.camera.matrix, CAMERA.matrix)
        np.testing.assert_allclose(recording.T_world_camera[k], expected.T_world_camera, atol=1e-6)
        if compressions[0] < 2:
            np.testing.assert_array_equal(frame.rgb, photograph(expected, 2)[0])
        assert frame.intrinsics.fx_px == pytest.approx(60.0)


def test_the_depth_camera_has_the_files_place(tmp_path):
    T_color_depth = np.eye(4)
    T_color_depth[:3, 3] = 0.025, -0.01, 0.005
    file = write_sens(tmp_path / "scan", orbit(2), T_color_depth=T_color_depth)
    drain(iterate_import(file, tmp_path / "rig"))
    node = tmp_path / "rig" / "node_00"
    np.testing.assert_allclose(read_extrinsics(node / "extrinsics.json"), T_color_depth, atol=1e-7)
    np.testing.assert_allclose(read_intrinsics(node / "depth_intrinsics.json").matrix, CAMERA.matrix)


def test_frames_whose_tracking_was_lost_are_left_out_and_said(tmp_path):
    written = orbit(4)
    file = write_sens(tmp_path / "scan", written, lost=(1,))
    report = drain(iterate_import(file, tmp_path / "rig"))
    assert any("1 of 4 frames have no pose" in note for note in report.notes)
    places = [frame.T_world_camera[:3, 3] for frame in load_rig(tmp_path / "rig").frames]
    expected = [written.frames[k].T_world_camera[:3, 3] for k in (0, 2, 3)]
    np.testing.assert_allclose(places, expected, atol=1e-6)


def test_a_file_that_ends_early_gives_its_whole_frames_and_says_so(tmp_path):
    written = orbit(4)
    file = write_sens(tmp_path / "scan", written)
    file.write_bytes(file.read_bytes()[:-300])
    recording = open_recording(file)
    assert len(recording.times_s) == 3
    assert any("is cut: it has 3 of its 4 frames" in note for note in recording.notes)
    np.testing.assert_array_equal(recording.view(2).depth.z_m, written.frames[2].depth.z_m)


def test_a_file_is_found_in_its_folder(tmp_path):
    write_sens(tmp_path / "scan", orbit(2))
    (tmp_path / "scan" / "scene0000_00.txt").write_text("axisAlignment\n")
    assert len(open_recording(tmp_path / "scan").times_s) == 2


@pytest.mark.parametrize(
    ("compressions", "says"),
    [
        ((2, 2), r"Occipital's own compression, which is not read; try ScanNet's SensReader"),
        ((2, 5), r"unknown compression \(colour 2, depth 5\)"),
        ((-1, 1), r"unknown compression \(colour -1, depth 1\)"),
    ],
)
def test_a_compression_that_is_not_read_is_named(tmp_path, compressions, says):
    file = write_sens(tmp_path / "scan", orbit(2))
    data = bytearray(file.read_bytes())
    data[HEADER_BYTES - 36 : HEADER_BYTES - 28] = struct.pack("<2i", *compressions)
    file.write_bytes(data)
    with pytest.raises(InputError, match=says) as error:
        drain(iterate_import(file, tmp_path / "rig"))
    assert "scene0000_00.sens" in str(error.value)
    assert not (tmp_path / "rig").exists()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda data: b"", "does not begin as a .sens file"),
        (lambda data: data[:100], "does not begin as a .sens file"),
        (lambda data: b"\x05" + data[1:], r"does not begin as a .sens file of ScanNet \(version 4\)"),
        (lambda data: data[:4] + b"\xff" * 8 + data[12:], "does not begin as a .sens file"),
        (lambda data: data[:27] + bytes(4) + data[31:], "focal lengths 0"),
        (lambda data: data[: HEADER_BYTES + 50], "cut before the end of its first frame"),
        (lambda data: data[: HEADER_BYTES + 3000], "cut before the end of its first frame"),
    ],
)
def test_a_damaged_file_gets_a_sentence(tmp_path, change, says):
    file = write_sens(tmp_path / "scan", orbit(2), compressions=(0, 1))
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(InputError, match=says) as error:
        drain(iterate_import(file, tmp_path / "rig"))
    assert "scene0000_00.sens" in str(error.value)


def test_a_damaged_image_gets_a_sentence_and_the_other_frames_are_read(tmp_path):
    written = orbit(3)
    file = write_sens(tmp_path / "scan", written, compressions=(0, 1))
    data = bytearray(file.read_bytes())
    color_bytes = 3 * 80 * 60
    start = HEADER_BYTES + 96 + color_bytes  # the first frame's depth
    data[start : start + 40] = bytes(40)
    file.write_bytes(data)
    recording = open_recording(file)
    with pytest.raises(InputError, match=r"depth image 0 in .*scene0000_00.sens is truncated or damaged"):
        recording.frame(0)
    assert np.isnan(recording.view(0).depth.z_m).all()
    assert any("depth image 0" in note for note in recording.notes)
    for k in (1, 2):
        np.testing.assert_array_equal(recording.view(k).depth.z_m, written.frames[k].depth.z_m)


def test_intrinsics_that_are_given_are_taken(tmp_path):
    file = write_sens(tmp_path / "scan", orbit(2))
    (tmp_path / "own.csv").write_text("70,0,40\n0,70,30\n0,0,1\n")
    drain(iterate_import(file, tmp_path / "rig", intrinsics=tmp_path / "own.csv"))
    assert load_rig(tmp_path / "rig").frames[0].intrinsics.fx_px == 70.0
