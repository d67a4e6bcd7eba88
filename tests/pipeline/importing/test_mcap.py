"""MCAP files of Foxglove's schemas and of ROS 1 become the rig that was recorded."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.recorded import open_recording
from pipeline.io.rigs import load_rig
from pipeline.types import CameraIntrinsics
from tests.pipeline.importing.bags import write_bag
from tests.pipeline.importing.foxglove_files import (
    FoxgloveWriter,
    calibration,
    millimetres,
    raw,
    write_foxglove,
    write_ros1_mcap,
)
from tests.pipeline.importing.recordings import orbit

FORMS = {
    "protocol buffers": {},
    "JSON": {"encoding": "json"},
    "PNG": {"compressed": True},
    "PNG in JSON": {"compressed": True, "encoding": "json"},
    "metres": {"metres": True},
    "without an index": {"chunked": False},
}


def assert_same(frame, expected):
    np.testing.assert_array_equal(frame.rgb, expected.rgb)
    np.testing.assert_allclose(frame.depth.z_m, expected.depth.z_m, atol=1e-6)
    np.testing.assert_array_equal(frame.intrinsics.matrix, expected.intrinsics.matrix)


@pytest.mark.parametrize("form", FORMS)
def test_cameras_of_foxglove_are_the_nodes_that_were_recorded(tmp_path, form):
    written = orbit(3)
    path = write_foxglove(tmp_path / "a.mcap", written, **FORMS[form])
    report = drain(iterate_import(path, tmp_path / "rig"))
    assert report.kind == "bag"
    for frame, expected in zip(load_rig(tmp_path / "rig").frames, written.frames, strict=True):
        assert_same(frame, expected)
        np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_frames_of_foxglove_are_read_in_any_order(tmp_path, form):
    written = orbit(1)
    path = write_foxglove(tmp_path / "a.mcap", written, moments=5, **FORMS[form])
    recording = open_recording(path)
    np.testing.assert_allclose(recording.times_s, 1400.0 + 0.1 * np.arange(5), atol=1e-9)
    for k in (3, 4, 0, 2, 2):
        assert_same(recording.frame(k), written.frames[0])
        np.testing.assert_allclose(recording.view(k).depth.z_m, written.frames[0].depth.z_m, atol=1e-6)


def test_a_bag_of_ros_1_may_be_in_mcap(tmp_path):
    written = orbit(3)
    write_bag(tmp_path / "a.bag", written, "ros1")
    path = write_ros1_mcap(tmp_path / "a.mcap", tmp_path / "a.bag")
    drain(iterate_import(path, tmp_path / "rig"))
    for frame, expected in zip(load_rig(tmp_path / "rig").frames, written.frames, strict=True):
        assert_same(frame, expected)
        np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-9)


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_the_lens_of_a_calibration_counts(tmp_path, encoding):
    own = orbit(1).frames[0]
    lens = np.array([-0.2, 0.05, 0.001, -0.002, 0.01])
    camera = CameraIntrinsics(own.intrinsics.matrix, lens, 40, 30)
    writer = FoxgloveWriter(tmp_path / "a.mcap", encoding)
    writer.write("/color/image", raw(own.rgb, "a", 7.0), 7.0)
    writer.write("/color/calibration", calibration(camera, "a", 7.0), 7.0)
    writer.write("/depth/image", raw(millimetres(own), "a", 7.0), 7.0)
    writer.close()
    recording = open_recording(tmp_path / "a.mcap")
    np.testing.assert_array_equal(recording.frame(0).intrinsics.distortion, lens)
    np.testing.assert_array_equal(recording.view(0).camera.distortion, np.zeros(5))


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_a_file_without_a_calibration_or_without_images_gets_one_sentence(tmp_path, encoding):
    own = orbit(1).frames[0]
    writer = FoxgloveWriter(tmp_path / "a.mcap", encoding)
    writer.write("/color/image", raw(own.rgb, "a", 7.0), 7.0)
    writer.write("/depth/image", raw(millimetres(own), "a", 7.0), 7.0)
    writer.close()
    with pytest.raises(InputError, match="no camera_info of /color/image is in the bag"):
        open_recording(tmp_path / "a.mcap")
    writer = FoxgloveWriter(tmp_path / "b.mcap", encoding)
    writer.write("/log", Log(message="hello"), 7.0)
    writer.close()
    with pytest.raises(InputError, match=r"no images at all but /log \(foxglove.Log\)"):
        open_recording(tmp_path / "b.mcap")


@pytest.mark.parametrize("share", [0.02, 0.3, 0.7, 0.97])
@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_a_file_that_was_cut_off_gets_one_sentence(tmp_path, encoding, share):
    path = write_foxglove(tmp_path / "a.mcap", orbit(2), encoding)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=r"a.mcap cannot be read .* or mcap recover") as error:
        drain(iterate_import(path, tmp_path / "rig"))
    assert "\n" not in str(error.value)
    assert not (tmp_path / "rig").exists()
