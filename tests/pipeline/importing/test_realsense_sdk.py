"""Bags of the RealSense SDK, whose topics librealsense's ros_file_format.h names."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import rigid
from tests.pipeline.importing.bag_parts import D, Images, Info, K, P, colors, wall
from tests.pipeline.importing.bags import BagWriter

COLOR, DEPTH = "/device_0/sensor_1/Color_0", "/device_0/sensor_0/Depth_0"
INFRARED = "/device_0/sensor_0/Infrared_1"
SMALL = np.array([[60.0, 0.0, 44.5], [0.0, 60.0, 29.5], [0.0, 0.0, 1.0]])
T_COLOR_DEPTH = rigid(Rotation.from_rotvec([0.0, 0.03, 0.01]).as_matrix(), np.array([0.015, 0.001, -0.002]))


def info(k=P[:, :3], **named):
    return Info(k=k, model="Brown Conrady", frame="0", **named)


def write_sdk(
    path: Path, infos: dict[str, Info], depth: np.ndarray, T=None, unit_m=None, infrared=False
) -> Path:
    """The extrinsics of a stream map the reference stream's points, here depth's, to its own."""
    bag = BagWriter(path, "ros1")
    images = {COLOR: Images(colors(3), frame="0"), DEPTH: Images(depth, frame="0")}
    if infrared:
        images[INFRARED] = Images(colors(3), frame="0")
    with bag.writer:
        for stream, own in infos.items():
            bag.write(f"{stream}/info/camera_info", own.message(bag, 0.0), 1e-9)
        for stream, T_stream_reference in (T or {}).items():
            turn = Rotation.from_matrix(T_stream_reference[:3, :3]).as_quat().tolist()
            transform = bag.make(
                "geometry_msgs/msg/Transform",
                bag.make("geometry_msgs/msg/Vector3", *T_stream_reference[:3, 3].tolist()),
                bag.make("geometry_msgs/msg/Quaternion", *turn),
            )
            bag.write(f"{stream}/tf/0", transform, 1e-9)
        if unit_m is not None:
            value = bag.make("std_msgs/msg/Float32", float(np.float32(unit_m)))
            bag.write("/device_0/sensor_0/option/Depth_Units/value", value, 1e-9)
        for moment in range(3):
            for stream, own in images.items():
                time_s = 1000.0 + moment / 30.0
                bag.write(f"{stream}/image/data", own.message(bag, time_s, moment), time_s)
    return path


def imported(tmp_path, *args, **named):
    report = drain(iterate_import(write_sdk(tmp_path / "a.bag", *args, **named), tmp_path / "rig"))
    return report, load_rig(tmp_path / "rig").frames


def test_cameras_extrinsics_and_unit_are_those_that_the_sdk_recorded(tmp_path):
    infos = {COLOR: info(), DEPTH: info(SMALL, size=(90, 60))}
    T = {DEPTH: np.eye(4), COLOR: T_COLOR_DEPTH}
    report, frames = imported(tmp_path, infos, 4 * wall(3, (90, 60)), T, 0.00025)
    node = tmp_path / "rig" / "node_01"
    assert len(frames) == 3
    np.testing.assert_array_equal(frames[0].intrinsics.matrix, P[:, :3])
    np.testing.assert_array_equal(read_intrinsics(node / "depth_intrinsics.json").matrix, SMALL)
    np.testing.assert_allclose(read_extrinsics(node / "extrinsics.json"), T_COLOR_DEPTH, atol=1e-9)
    assert report.depth_scale == 4000.0
    assert np.nanmedian(frames[1].depth.z_m) == pytest.approx(2.0, abs=0.05)


def test_a_reference_that_is_neither_stream_cancels(tmp_path):
    T_depth_imu = rigid(Rotation.from_rotvec([0.4, 0.0, 0.2]).as_matrix(), np.array([0.1, -0.3, 0.2]))
    infos = {COLOR: info(), DEPTH: info(SMALL, size=(90, 60))}
    imported(tmp_path, infos, wall(3, (90, 60)), {DEPTH: T_depth_imu, COLOR: T_COLOR_DEPTH @ T_depth_imu})
    found = read_extrinsics(tmp_path / "rig" / "node_00" / "extrinsics.json")
    np.testing.assert_allclose(found, T_COLOR_DEPTH, atol=1e-9)


def test_a_unit_that_is_given_is_preferred_to_the_recorded_one(tmp_path):
    path = write_sdk(tmp_path / "a.bag", {COLOR: info(), DEPTH: info()}, wall(3), unit_m=0.0001)
    assert drain(iterate_import(path, tmp_path / "own")).depth_scale == 10000.0
    assert drain(iterate_import(path, tmp_path / "given", depth_scale=500.0)).depth_scale == 500.0


def test_colour_is_taken_and_infrared_left_out_though_it_shares_the_sensor_with_depth(tmp_path):
    infos = {COLOR: info(), DEPTH: info(), INFRARED: info()}
    report, frames = imported(tmp_path, infos, wall(3), infrared=True)
    assert [frame.color for frame in report.frames] == [f"{COLOR}/image/data"] * 3
    assert f"{INFRARED}/image/data is left out: no depth belongs to it" in report.notes
    assert len(frames) == 3


def test_without_extrinsics_the_place_is_assumed_and_said(tmp_path):
    report, _ = imported(tmp_path, {COLOR: info(), DEPTH: info()}, wall(3))
    assert any(f"no {COLOR}/tf/0 and {DEPTH}/tf/0" in note for note in report.notes)


def test_distortion_of_the_sdk_is_that_of_opencv(tmp_path):
    _, frames = imported(tmp_path, {COLOR: info(K, d=D), DEPTH: info(K, d=D)}, wall(3))
    np.testing.assert_array_equal(frames[0].intrinsics.distortion, D)


def test_a_stream_without_camera_info_is_named_with_the_usual_name(tmp_path):
    with pytest.raises(InputError, match=f"try to record {COLOR}/info/camera_info, too"):
        imported(tmp_path, {DEPTH: Info(frame="1")}, wall(3))
