"""Poses of recordings from moving transforms and odometry of bags."""

from collections.abc import Callable

import numpy as np
import pytest

from pipeline.importing.bag_links import TransformLink
from pipeline.importing.recorded import open_recording
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from tests.pipeline.importing.bag_parts import Images, Info, colors, wall
from tests.pipeline.importing.bags import BagWriter, link
from tests.pipeline.importing.foxglove_files import FoxgloveWriter, calibration, raw, transform
from tests.pipeline.importing.recordings import CAMERA

T_MAP_ODOM = rigid(rotation_exp(np.array([0.0, 0.0, 0.7])), np.array([3.0, -1.0, 0.2]))
T_BASE_OPTICAL = rigid(rotation_exp(np.array([-1.2, 1.2, -1.2])), np.array([0.1, 0.02, 0.3]))
START_S, FRAMES = 100.0, 5
SMALL = colors(FRAMES, (40, 30)), wall(FRAMES, (40, 30))


def T_odom_base(time_s: float) -> np.ndarray:
    """A base that drives straight ahead and turns, both evenly: interpolation is exact."""
    passed_s = time_s - START_S
    turn = rotation_exp(np.array([0.0, 0.0, 0.4 * passed_s]))
    return rigid(turn, np.array([0.5 * passed_s, 0.2 * passed_s, 0.0]))


def T_map_optical(time_s: float) -> np.ndarray:
    return T_MAP_ODOM @ T_odom_base(time_s) @ T_BASE_OPTICAL


def times(first_s=-0.13, last_s=2.3, step_s=0.07):
    """Times of transforms, none of which is that of an image."""
    return START_S + np.arange(first_s, last_s, step_s)


def known_in(recording) -> list[int]:
    """Numbers of the frames with a pose."""
    return [k for k, T in enumerate(recording.T_world_camera) if T is not None]


def at(bag: BagWriter, parent: str, child: str, T: np.ndarray, time_s: float):
    made = link(bag, parent, child, T)
    made.header = bag.header(parent, time_s)
    return bag.make("tf2_msgs/msg/TFMessage", [made])


def write(
    path,
    kind: str = "ros1",
    moved: np.ndarray | None = None,
    stamp: Callable[[float], float] = lambda time_s: time_s,
    fixed: str = "/tf_static",
    odometry: bool = False,
):
    """Images at 2 Hz in the frame optical, and its transforms from map by odom and base."""
    bag = BagWriter(path, kind)
    moved = times() if moved is None else moved
    with bag.writer:
        bag.write("/rgb/camera_info", Info(k=CAMERA.matrix, size=(40, 30)).message(bag, START_S), START_S)
        again = (0.0, 1.0) if fixed == "/tf" else (0.0,)
        for late_s in again:
            if not odometry:
                message = at(bag, "map", "odom", T_MAP_ODOM, START_S + late_s)
                bag.write(fixed, message, START_S + late_s)
            message = at(bag, "base", "optical", T_BASE_OPTICAL, START_S + late_s)
            bag.write(fixed, message, START_S + late_s)
        for k in range(FRAMES):
            time_s = START_S + 0.5 * k
            rgb, depth = (Images(own, stamp_s=stamp) for own in SMALL)
            bag.write("/rgb/image", rgb.message(bag, time_s, k), time_s)
            bag.write("/depth/image", depth.message(bag, time_s, k), time_s)
        for time_s in moved:
            if odometry:
                bag.write("/odom", odometry_of(bag, time_s), time_s)
            else:
                message = at(bag, "odom", "base", T_odom_base(time_s), stamp(time_s))
                bag.write("/tf", message, time_s)
    return open_recording(path)


def odometry_of(bag: BagWriter, time_s: float):
    made = link(bag, "odom", "base", T_odom_base(time_s))
    place, turn = made.transform.translation, made.transform.rotation
    point = bag.make("geometry_msgs/msg/Point", place.x, place.y, place.z)
    pose = bag.make("geometry_msgs/msg/Pose", point, turn)
    zero = bag.make("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
    twist = bag.make("geometry_msgs/msg/Twist", zero, zero)
    return bag.make(
        "nav_msgs/msg/Odometry",
        bag.header("odom", time_s),
        "base",
        bag.make("geometry_msgs/msg/PoseWithCovariance", pose, np.zeros(36)),
        bag.make("geometry_msgs/msg/TwistWithCovariance", twist, np.zeros(36)),
    )


@pytest.mark.parametrize("kind", ["ros1", "ros2", "mcap"])
def test_poses_are_those_at_the_images_times(tmp_path, kind):
    recording = write(tmp_path / ("a.bag" if kind == "ros1" else "a"), kind)
    assert len(recording.times_s) == len(recording.T_world_camera) == FRAMES
    for time_s, T in zip(recording.times_s, recording.T_world_camera, strict=True):
        np.testing.assert_allclose(T, T_map_optical(time_s), atol=1e-6)
    np.testing.assert_array_equal(recording.frame(2).T_world_camera, recording.T_world_camera[2])
    assert recording.frame(2).pose_known
    assert "The poses are those by the transforms from map to optical" in recording.notes


def test_fixed_transforms_may_be_published_again_and_again(tmp_path):
    """As ROS 1's static_transform_publisher did, on /tf."""
    recording = write(tmp_path / "a.bag", fixed="/tf")
    np.testing.assert_allclose(recording.T_world_camera[4], T_map_optical(START_S + 2.0), atol=1e-6)


def test_odometry_moves_the_camera_where_no_transform_does(tmp_path):
    recording = write(tmp_path / "a.bag", odometry=True)
    for time_s, T in zip(recording.times_s, recording.T_world_camera, strict=True):
        np.testing.assert_allclose(T, inverse(T_MAP_ODOM) @ T_map_optical(time_s), atol=1e-6)
    assert "The poses are those by the odometry /odom" in recording.notes


def test_without_times_in_headers_images_and_transforms_have_the_bags_times(tmp_path):
    recording = write(tmp_path / "a.bag", stamp=lambda time_s: 0.0)
    for k, T in enumerate(recording.T_world_camera):
        np.testing.assert_allclose(T, T_map_optical(START_S + 0.5 * k), atol=1e-6)


def test_frames_before_the_first_transform_have_no_pose(tmp_path):
    recording = write(tmp_path / "a.bag", moved=times(first_s=0.3))
    assert len(recording.times_s) == FRAMES
    assert known_in(recording) == [1, 2, 3, 4]
    np.testing.assert_allclose(recording.T_world_camera[1], T_map_optical(START_S + 0.5), atol=1e-6)
    assert [recording.frame(k).pose_known for k in (0, 1)] == [False, True]
    assert any(note.startswith("1 of 5 frames have no pose by the transforms") for note in recording.notes)


def test_the_end_of_the_transforms_holds_for_a_twentieth_of_a_second(tmp_path):
    """The last transform is 40 ms before the last image: its pose is taken as it was."""
    recording = write(tmp_path / "a.bag", moved=START_S + np.arange(-0.04, 1.97, 0.1))
    assert len(recording.times_s) == FRAMES
    np.testing.assert_allclose(recording.T_world_camera[4], T_map_optical(START_S + 1.96), atol=1e-6)


def test_no_pose_is_made_up_across_a_long_gap(tmp_path):
    before, after = times(last_s=0.65), times(first_s=1.8)
    recording = write(tmp_path / "a.bag", moved=np.concatenate([before, after]))
    assert known_in(recording) == [0, 1, 4]
    np.testing.assert_allclose(recording.T_world_camera[4], T_map_optical(START_S + 2.0), atol=1e-6)


def test_at_its_own_time_a_transform_holds_next_to_any_gap(tmp_path):
    """Samples 1.5 s apart; the first and the last one hold for a twentieth of a second beyond them."""
    link = TransformLink("odom", "base", False)
    for time_s in (0.0, 1.5, 3.0):
        link.samples.extend((time_s, time_s, time_s, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    times_s = np.array([-0.04, 0.0, 0.1, 1.4, 1.5, 1.6, 3.0, 3.04, 3.06])
    T, known = link.at(times_s, in_bag=False)
    assert times_s[known].tolist() == [-0.04, 0.0, 1.5, 3.0, 3.04]
    np.testing.assert_array_equal(T[known, 0, 3], [0.0, 0.0, 1.5, 3.0, 3.0])


def test_transforms_of_another_time_give_no_poses(tmp_path):
    recording = write(tmp_path / "a.bag", moved=times(first_s=50.0, last_s=52.0))
    assert recording.T_world_camera is None
    assert len(recording.times_s) == FRAMES
    assert any("No frame has a pose by the transforms from map" in note for note in recording.notes)


def test_transforms_may_be_in_any_order(tmp_path):
    shuffled = np.random.default_rng(3).permutation(times())
    recording = write(tmp_path / "a.bag", moved=shuffled)
    np.testing.assert_allclose(recording.T_world_camera[3], T_map_optical(START_S + 1.5), atol=1e-6)


def test_a_transform_without_a_rotation_is_ignored(tmp_path):
    """As a message whose fields nobody set: all four numbers of the quaternion are 0."""
    writer = FoxgloveWriter(tmp_path / "a.mcap")
    writer.write("/rgb/calibration", calibration(CAMERA, "optical", START_S), START_S)
    for k in range(FRAMES):
        time_s = START_S + 0.5 * k
        empty = transform("map", "optical", np.eye(4), time_s + 0.2)
        empty.rotation.w = 0.0
        writer.write("/tf", transform("map", "optical", T_odom_base(time_s), time_s), time_s)
        writer.write("/tf", empty, time_s + 0.2)
        writer.write("/rgb/image", raw(SMALL[0][k], "optical", time_s + 0.1), time_s + 0.1)
        writer.write("/depth/image", raw(SMALL[1][k], "optical", time_s + 0.1), time_s + 0.1)
    writer.close()
    recording = open_recording(tmp_path / "a.mcap")
    assert known_in(recording) == [0, 1, 2, 3]
    np.testing.assert_allclose(recording.T_world_camera[1], T_odom_base(START_S + 0.6), atol=1e-6)


def test_a_camera_that_nothing_moves_has_no_poses(tmp_path):
    recording = write(tmp_path / "a.bag", moved=np.array([]))
    assert recording.T_world_camera is None
    assert len(recording.times_s) == FRAMES
    assert not any("pose" in note for note in recording.notes)


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_transforms_of_foxglove_move_the_camera(tmp_path, encoding):
    writer = FoxgloveWriter(tmp_path / "a.mcap", encoding)
    writer.write("/tf", transform("map", "odom", T_MAP_ODOM, START_S), START_S)
    writer.write("/tf", transform("base", "optical", T_BASE_OPTICAL, START_S), START_S)
    writer.write("/rgb/calibration", calibration(CAMERA, "optical", START_S), START_S)
    for time_s in times():
        writer.write("/tf", transform("odom", "base", T_odom_base(time_s), time_s), time_s)
    for k in range(FRAMES):
        time_s = START_S + 0.5 * k
        writer.write("/rgb/image", raw(SMALL[0][k], "optical", time_s), time_s)
        writer.write("/depth/image", raw(SMALL[1][k], "optical", time_s), time_s)
    writer.close()
    recording = open_recording(tmp_path / "a.mcap")
    for time_s, T in zip(recording.times_s, recording.T_world_camera, strict=True):
        np.testing.assert_allclose(T, T_map_optical(time_s), atol=1e-6)
    assert recording.notes[0] == "The poses are those by the transforms from map to optical"
