"""A rig whose nodes hold recordings of cameras that stand."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.config import PipelineConfig, RecordingConfig
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_pose
from pipeline.io.rigs import save_rig
from pipeline.kernels.geometry import look_at
from pipeline.recording.opening import iterate_still
from pipeline.recording.rig import holds_recordings, iterate_recorded_rig
from pipeline.sources import Calibrated, Demo, Recorded, RigFolder
from pipeline.spec import Spec, key
from pipeline.stages import open_rig
from pipeline.types import CameraIntrinsics, Rig
from tests.pipeline.recording.standing import standing, wall, write_tum

POSE = look_at([1.0, 2.0, 1.5], [0.0, 0.0, 1.0])


@pytest.fixture
def rig(tmp_path):
    """Two recordings, of which the second has a pose, and a single pair of images."""
    for index, frames in enumerate((6, 4)):
        write_tum(tmp_path / "rig" / f"node_{index:02d}", wall(frames, seed=index))
    write_pose(tmp_path / "rig" / "node_01" / "pose.txt", POSE)
    frame = replace(drain(iterate_still(standing(1), 1)), averaging=None)
    save_rig(tmp_path / "pair", Rig("pair", (frame,)))
    (tmp_path / "pair" / "node_00").rename(tmp_path / "rig" / "node_02")
    return tmp_path / "rig"


def test_each_node_is_averaged_over_its_own_frames(rig):
    assert holds_recordings(rig)
    found = drain(iterate_recorded_rig(rig, 5))
    assert [frame.name for frame in found.frames] == ["node_00", "node_01", "node_02"]
    assert [frame.averaging and frame.averaging.frames for frame in found.frames] == [5, 4, None]
    assert [frame.pose_known for frame in found.frames] == [False, True, True]
    np.testing.assert_allclose(found.frames[1].T_world_camera, POSE, atol=1e-9)
    assert any(note.startswith("node_00: The camera stands: 5 of 6 frames") for note in found.notes)


def test_the_chain_opens_it_with_the_frames_of_the_settings(rig):
    opened = drain(open_rig(RigFolder(str(rig)), 2))
    assert [frame.averaging and frame.averaging.frames for frame in opened.frames] == [2, 2, None]
    opened = drain(open_rig(RigFolder(str(rig))))
    assert [frame.averaging and frame.averaging.frames for frame in opened.frames] == [6, 4, None]


def test_a_rig_of_images_holds_no_recording(rig, tmp_path):
    (tmp_path / "single").mkdir()
    (rig / "node_02").rename(tmp_path / "single" / "node_00")
    assert not holds_recordings(tmp_path / "single")
    assert not holds_recordings(tmp_path / "missing")
    assert drain(open_rig(RigFolder(str(tmp_path / "single")), 2)).frames[0].averaging is None


def test_a_node_whose_camera_walks_is_named(rig):
    moving = [depth_m * (1.0 + 0.02 * k) for k, depth_m in enumerate(wall(6))]
    write_tum(rig / "node_01", moving)
    with pytest.raises(InputError, match=r"node_01 does not stand still.*--recording"):
        drain(iterate_recorded_rig(rig, 5))


def test_files_that_would_be_ignored_are_named(rig):
    (rig / "node_00" / "depth_correction.json").write_text("{}")
    with pytest.raises(InputError, match=r"node_00 has depth_correction\.json.*move it away"):
        drain(iterate_recorded_rig(rig, 5))


def test_a_recording_of_one_frame_stands(tmp_path):
    write_tum(tmp_path / "rig" / "node_00", wall(1))
    assert drain(iterate_recorded_rig(tmp_path / "rig", 5)).frames[0].averaging.frames == 1


def test_intrinsics_of_a_node_are_used_for_the_recording_in_it(tmp_path):
    """Of a bag, they are refused."""
    own = CameraIntrinsics.pinhole(200.0, 201.0, 80.0, 60.0, 160, 120)
    node = tmp_path / "rig" / "node_00"
    inner = write_tum(node / "walk", wall(3))
    write_intrinsics(node / "intrinsics.json", own)
    frame = drain(iterate_recorded_rig(tmp_path / "rig", 5)).frames[0]
    np.testing.assert_allclose(frame.intrinsics.matrix, own.matrix)
    shutil.rmtree(inner)
    (node / "walk.bag").write_bytes(b"#ROSBAG V2.0")
    with pytest.raises(InputError, match="try without intrinsics"):
        drain(iterate_recorded_rig(tmp_path / "rig", 5))


def test_another_calibration_is_refused(rig, tmp_path):
    with pytest.raises(InputError, match=r"are recordings.*pose\.txt"):
        Calibrated(RigFolder(str(rig)), str(tmp_path)).load()


def test_a_recording_in_the_chain_is_averaged_over_the_frames_of_the_settings(tmp_path):
    source = Recorded(str(write_tum(tmp_path / "still", wall(6))))
    assert drain(open_rig(source, 3)).frames[0].averaging.frames == 3
    assert drain(open_rig(source)).frames[0].averaging.frames == 6


def test_the_number_of_frames_matters_to_recordings_only():
    few = PipelineConfig(recording=RecordingConfig(frames=3))
    for source, differs in ((Demo("office"), False), (Recorded("walk"), True), (RigFolder("rig"), True)):
        assert (key(Spec(source), "rig") != key(Spec(source, config=few), "rig")) == differs
    command = Spec(Recorded("still"), config=few).command("out")
    assert command.endswith("--preset packetmesh --set recording.frames=3 --out out")


@pytest.mark.parametrize("frames", [0, 65])
def test_frames_are_1_to_64(frames):
    with pytest.raises(InputError, match=rf"recording\.frames is {frames}; try a number from 1 to 64"):
        with_settings(PipelineConfig(), [f"recording.frames={frames}"])
