"""Frames of nerfstudio's transforms.json, whose cameras look along -z with y up."""

import json

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import orbit
from tests.pipeline.importing.test_layouts import assert_same

CAMERA = {"fl_x": 30.0, "fl_y": 30.5, "cx": 20.0, "cy": 15.0, "w": 40, "h": 30, "camera_model": "OPENCV"}


def write(folder, rig, depth_key="depth_file_path", of_frames=False, camera=CAMERA):
    frames = []
    for k, frame in enumerate(rig.frames):
        names = f"images/frame_{k:05d}.png", f"depths/frame_{k:05d}.png"
        write_color(folder / names[0], frame.rgb)
        write_depth_mm(folder / names[1], frame.depth)
        axes = frame.T_world_camera.copy()
        axes[:3, 1:3] *= -1.0
        frames.append({"file_path": names[0], depth_key: names[1], "transform_matrix": axes.tolist()})
    shared = {} if of_frames else camera
    own = [frame | (camera if of_frames else {}) for frame in frames]
    (folder / "transforms.json").write_text(json.dumps(shared | {"frames": own}))


def imported(tmp_path, **options):
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig")


@pytest.mark.parametrize("of_frames", [False, True])
@pytest.mark.parametrize("depth_key", ["depth_file_path", "depth_path"])
def test_a_capture_is_the_rig_that_it_was_written_from(tmp_path, depth_key, of_frames):
    written = orbit(3)
    write(tmp_path / "recording", written, depth_key, of_frames)
    report, rig = imported(tmp_path)
    assert report.kind == "nerfstudio"
    assert "The poses of transforms.json are taken to be in metres" in report.notes
    for frame, expected in zip(rig.frames, written.frames, strict=True):
        assert_same(frame, expected)


def test_a_lens_is_that_of_the_file(tmp_path):
    write(tmp_path / "recording", orbit(2))
    file = tmp_path / "recording" / "transforms.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"k1": -0.1, "p2": 1e-3}))
    _, rig = imported(tmp_path)
    np.testing.assert_array_equal(rig.frames[0].intrinsics.distortion, [-0.1, 0.0, 0.0, 1e-3, 0.0])


@pytest.mark.parametrize("of_frames", [False, True])
@pytest.mark.parametrize("named", [{"is_fisheye": True}, {"camera_model": "OPENCV_FISHEYE"}])
def test_a_fisheye_is_named_by_instant_ngp_or_by_nerfstudio(tmp_path, named, of_frames):
    lens = {"k1": 0.1, "k2": 0.02, "k3": 3e-3, "k4": 4e-4, "p1": 0.0, "p2": 0.0}
    camera = {key: value for key, value in CAMERA.items() if key != "camera_model"} | lens | named
    write(tmp_path / "recording", orbit(2), of_frames=of_frames, camera=camera)
    intrinsics = imported(tmp_path)[1].frames[0].intrinsics
    assert intrinsics.fisheye
    np.testing.assert_array_equal(intrinsics.distortion, [0.1, 0.02, 3e-3, 4e-4])


@pytest.mark.parametrize("model", ["EQUIRECTANGULAR", "FISHEYE624"])
def test_a_camera_of_another_model_is_refused_by_its_name(tmp_path, model):
    write(tmp_path / "recording", orbit(2), camera=CAMERA | {"camera_model": model})
    with pytest.raises(InputError, match=f"transforms.json has the distortion model {model}; try"):
        imported(tmp_path)
    assert not (tmp_path / "rig").exists()


def test_without_a_camera_the_option_that_names_one_helps(tmp_path):
    write(tmp_path / "recording", orbit(2))
    file = tmp_path / "recording" / "transforms.json"
    values = json.loads(file.read_text())
    file.write_text(json.dumps({"frames": values["frames"]}))
    with pytest.raises(InputError, match=r"transforms.json has no camera that can be read.*try --intrinsics"):
        imported(tmp_path)
    own = tmp_path / "camera.json"
    own.write_text(json.dumps({"width": 40, "height": 30, "fx": 30, "fy": 31, "cx": 19.5, "cy": 14.5}))
    assert imported(tmp_path, intrinsics=own)[1].frames[0].intrinsics.fy_px == 31.0
