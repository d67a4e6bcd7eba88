"""Bags opened as recordings: frames are those that were written, read in any order."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing.bag_stream import BagStream
from pipeline.importing.recorded import iterate_opening, open_recording
from pipeline.importing.recorded_bag import BagRecording
from pipeline.io.depth_to_color import register_depth
from pipeline.io.images import NoDepthError
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.recording.recording import read_ahead
from pipeline.types import DepthMap, Rig
from tests.pipeline.importing.bag_parts import D, Images, Info, K, colors, wall, write_parts
from tests.pipeline.importing.bags import BagWriter, write_bag
from tests.pipeline.importing.foxglove_files import FoxgloveWriter, calibration, millimetres, raw
from tests.pipeline.importing.recordings import CAMERA, orbit

KINDS = ("ros1", "ros2", "mcap", "foxglove", "foxglove without an index")


def write_walk(folder, rig: Rig, kind: str, order=None, stamp=lambda time_s: time_s):
    """One camera, each of the rig's frames at the next tenth of a second; depth comes 4 ms after colour."""
    order = range(len(rig.frames)) if order is None else order
    folder.mkdir(parents=True, exist_ok=True)
    if kind.startswith("foxglove"):
        writer = FoxgloveWriter(folder / "walk.mcap", chunked=kind == "foxglove")
        for at, k in enumerate(order):
            frame, time_s, in_bag_s = rig.frames[k], 1400.0 + 0.1 * k, 1400.0 + 0.1 * at
            writer.write("/rgb/image", raw(frame.rgb, "a", time_s), in_bag_s)
            writer.write("/rgb/calibration", calibration(CAMERA, "a", time_s), in_bag_s)
            writer.write("/depth/image", raw(millimetres(frame), "a", time_s + 0.004), in_bag_s + 0.004)
        writer.close()
        return folder / "walk.mcap"
    bag = BagWriter(folder / ("walk.bag" if kind == "ros1" else "walk"), kind)
    info = Info(k=CAMERA.matrix, size=(40, 30), frame="a")
    with bag.writer:
        for at, k in enumerate(order):
            frame, time_s, in_bag_s = rig.frames[k], 1400.0 + 0.1 * k, 1400.0 + 0.1 * at
            rgb, depth = Images(frame.rgb[None], "a"), Images(millimetres(frame)[None], "a")
            bag.write("/rgb/camera_info", info.message(bag, stamp(time_s)), in_bag_s)
            bag.write("/rgb/image", rgb.message(bag, stamp(time_s), 0), in_bag_s)
            bag.write("/depth/image", depth.message(bag, stamp(time_s + 0.004), 0), in_bag_s + 0.004)
    return folder / ("walk.bag" if kind == "ros1" else "walk")


def assert_frame(recording, k, expected):
    view, frame = recording.view(k), recording.frame(k)
    np.testing.assert_allclose(view.depth.z_m, expected.depth.z_m, atol=1e-6)
    np.testing.assert_array_equal(view.camera.matrix, CAMERA.matrix)
    np.testing.assert_array_equal(view.T_color_depth, np.eye(4))
    np.testing.assert_array_equal(frame.rgb, expected.rgb)
    np.testing.assert_allclose(frame.depth.z_m, expected.depth.z_m, atol=1e-6)
    assert (frame.name, frame.pose_known) == (f"frame_{k:05d}", False)


@pytest.mark.parametrize("kind", KINDS)
def test_every_frame_is_read_on_in_order_and_again_in_any_order(tmp_path, monkeypatch, kind):
    written = orbit(40)
    recording = open_recording(write_walk(tmp_path, written, kind))
    assert isinstance(recording, BagRecording)
    np.testing.assert_allclose(recording.times_s, 1400.0 + 0.1 * np.arange(40), atol=1e-6)
    assert recording.T_world_camera is None
    looked_up = []
    look_up = BagStream._look_up

    def counted(stream, index):
        looked_up.append(stream.topic)
        look_up(stream, index)

    monkeypatch.setattr(BagStream, "_look_up", counted)
    for k, view in read_ahead(recording, range(40)):
        np.testing.assert_allclose(view.depth.z_m, written.frames[k].depth.z_m, atol=1e-6)
    assert looked_up == ["/depth/image"]
    for k in (39, 0, 7, 7, 8, 30):
        assert_frame(recording, k, written.frames[k])


@pytest.mark.parametrize("kind", KINDS)
def test_frames_are_in_order_of_their_own_times(tmp_path, kind):
    """They came into the bag in another order, as over a network."""
    written = orbit(6)
    recording = open_recording(write_walk(tmp_path, written, kind, order=[1, 0, 2, 5, 3, 4]))
    np.testing.assert_allclose(recording.times_s, 1400.0 + 0.1 * np.arange(6), atol=1e-6)
    for k in range(6):
        assert_frame(recording, k, written.frames[k])


def test_without_times_in_headers_those_of_the_bag_count(tmp_path):
    written = orbit(4)
    recording = open_recording(write_walk(tmp_path, written, "ros1", stamp=lambda time_s: 0.0))
    np.testing.assert_allclose(recording.times_s, 1400.0 + 0.1 * np.arange(4), atol=1e-6)
    assert any("the times at which the messages came into the bag" in note for note in recording.notes)
    assert_frame(recording, 3, written.frames[3])


def test_messages_of_one_time_in_the_bag_are_told_apart(tmp_path):
    """As where a program writes a whole bag with one clock reading."""
    written = orbit(3)
    bag = BagWriter(tmp_path / "a.bag", "ros1")
    info = Info(k=CAMERA.matrix, size=(40, 30))
    with bag.writer:
        bag.write("/rgb/camera_info", info.message(bag, 1.0), 5.0)
        for k, frame in enumerate(written.frames):
            bag.write("/rgb/image", Images(frame.rgb[None]).message(bag, 1.0 + k, 0), 5.0)
            bag.write("/depth/image", Images(millimetres(frame)[None]).message(bag, 1.0 + k, 0), 5.0)
    recording = open_recording(tmp_path / "a.bag")
    for k in (2, 0, 1):
        assert_frame(recording, k, written.frames[k])


def test_a_topic_may_have_several_publishers(tmp_path):
    """As after a driver was started again; ROS 1 gives each its own connection."""
    written = orbit(4)
    bag = BagWriter(tmp_path / "a.bag", "ros1")
    with bag.writer:
        bag.write("/rgb/camera_info", Info(k=CAMERA.matrix, size=(40, 30)).message(bag, 1.0), 1.0)
        for k, frame in enumerate(written.frames):
            if k == 2:
                name = "sensor_msgs/msg/Image"
                for topic in ("/rgb/image", "/depth/image"):
                    again = bag.writer.add_connection(topic, name, typestore=bag.store, callerid="/again")
                    bag.connections[topic] = again
            bag.write("/rgb/image", Images(frame.rgb[None]).message(bag, 1.0 + k, 0), 1.0 + k)
            bag.write("/depth/image", Images(millimetres(frame)[None]).message(bag, 1.0 + k, 0), 1.0 + k)
    recording = open_recording(tmp_path / "a.bag")
    assert len(recording.times_s) == 4
    for k in (3, 1, 2, 0):
        assert_frame(recording, k, written.frames[k])


def test_threads_share_a_recording(tmp_path):
    written = orbit(12)
    recording = open_recording(write_walk(tmp_path, written, "mcap"))
    wrong = []

    def read(numbers):
        for k in numbers:
            depth = recording.view(k).depth.z_m
            if not np.allclose(depth, written.frames[k].depth.z_m, atol=1e-6, equal_nan=True):
                wrong.append(k)

    readers = [threading.Thread(target=read, args=(numbers,)) for numbers in (range(12), range(11, -1, -1))]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()
    assert not wrong


@pytest.mark.parametrize("late_s", [0.0, 0.2, 0.7])
def test_each_colour_image_has_the_depth_of_its_time(tmp_path, late_s):
    """Depth at 2 Hz: shifted by 0.2 s there is no moment; by 0.7 s, that of another image is too far away."""
    images = {"/rgb/image": Images(colors(4)), "/depth/image": Images(wall(4), late_s=late_s)}
    bag = write_parts(tmp_path / "a.bag", images, {"/rgb/camera_info": Info()})
    if late_s:
        with pytest.raises(InputError, match=r"are never less than 0\.2 s apart"):
            open_recording(bag)
    else:
        medians = [np.median(open_recording(bag).view(k).depth.z_m) for k in range(4)]
        np.testing.assert_allclose(medians, [2.0, 2.001, 2.002, 2.003], atol=1e-6)


def test_of_several_cameras_that_with_the_most_frames_is_used(tmp_path):
    images = {
        "/a/rgb/image": Images(colors(2), "a"),
        "/a/depth/image": Images(wall(2), "a"),
        "/b/rgb/image": Images(colors(5), "b"),
        "/b/depth/image": Images(wall(5, z_mm=3000), "b"),
    }
    infos = {f"/{name}/rgb/camera_info": Info(frame=name) for name in "ab"}
    recording = open_recording(write_parts(tmp_path / "a.bag", images, infos))
    assert len(recording.times_s) == 5
    assert np.median(recording.view(0).depth.z_m) == np.float32(3.0)
    assert "/b/rgb/image is used, and /a/rgb/image left out: a recording is of one camera" in recording.notes


def test_depth_of_another_place_keeps_it_in_views_and_is_registered_in_frames(tmp_path):
    T_color_depth = rigid(rotation_exp(np.array([0.0, 0.05, 0.0])), np.array([0.05, 0.0, 0.01]))
    written = orbit(1)
    write_bag(tmp_path / "recording", written, T_color_depth=T_color_depth)
    recording = open_recording(tmp_path / "recording")
    view, frame = recording.view(1), recording.frame(1)
    np.testing.assert_allclose(view.T_color_depth, T_color_depth, atol=1e-9)
    np.testing.assert_allclose(view.depth.z_m, written.frames[0].depth.z_m, atol=1e-6)
    expected = register_depth(view.depth, CAMERA, CAMERA, T_color_depth)
    np.testing.assert_array_equal(frame.depth.z_m, expected.z_m)


def test_distortion_is_taken_out_of_views_and_kept_in_frames(tmp_path):
    """A wall ahead has one depth, whatever the lens; beyond the image's edge it is unknown."""
    images = {"/rgb/image_raw": Images(colors(1)), "/depth/image_raw": Images(wall(1))}
    infos = {"/rgb/camera_info": Info(k=K, d=-D), "/depth/camera_info": Info(k=K, d=-D)}
    recording = open_recording(write_parts(tmp_path / "a.bag", images, infos))
    view, frame = recording.view(0), recording.frame(0)
    np.testing.assert_array_equal(view.camera.distortion, np.zeros(5))
    np.testing.assert_array_equal(view.camera.matrix, K)
    np.testing.assert_array_equal(frame.intrinsics.distortion, -D)
    assert frame.depth.valid.all()
    known = view.depth.valid
    assert not known[0, 0]
    assert known[60, 80]
    assert (view.depth.z_m[known] == np.float32(2.0)).all()


@pytest.mark.parametrize(("scale", "median_m"), [(None, 2.0), (500.0, 4.0)])
def test_a_scale_that_is_given_counts(tmp_path, scale, median_m):
    images = {"/rgb/image": Images(colors(1)), "/depth/image": Images(wall(1))}
    bag = write_parts(tmp_path / "a.bag", images, {"/rgb/camera_info": Info()})
    assert np.median(open_recording(bag, scale).view(0).depth.z_m) == np.float32(median_m)


def blind(written, *numbers):
    """A rig some of whose frames have no depth."""
    nothing = DepthMap(np.full((30, 40), np.nan, np.float32))
    frames = [replace(f, depth=nothing) if k in numbers else f for k, f in enumerate(written.frames)]
    return Rig("blind", tuple(frames))


@pytest.mark.parametrize("number", [0, 1])
def test_a_frame_without_depth_is_unknown_everywhere(tmp_path, number):
    recording = open_recording(write_walk(tmp_path, blind(orbit(3), number), "ros1"))
    assert [recording.view(k).depth.valid.any() for k in range(3)] == [k != number for k in range(3)]
    assert recording.view(number).depth.z_m.shape == (30, 40)
    with pytest.raises(NoDepthError, match="has no depth anywhere"):
        recording.frame(number)
    assert not any("left out" in note for note in recording.notes)


@pytest.mark.parametrize("number", [0, 1])
def test_a_damaged_depth_image_is_left_out_and_named(tmp_path, number):
    written = orbit(3)
    bag = BagWriter(tmp_path / "a.bag", "ros1")
    with bag.writer:
        bag.write("/rgb/camera_info", Info(k=CAMERA.matrix, size=(40, 30)).message(bag, 1.0), 1.0)
        for k, frame in enumerate(written.frames):
            depth = Images(millimetres(frame)[None]).message(bag, 1.0 + k, 0)
            if k == number:
                depth.data = depth.data[:100]
            bag.write("/rgb/image", Images(frame.rgb[None]).message(bag, 1.0 + k, 0), 1.0 + k)
            bag.write("/depth/image", depth, 1.0 + k)
    recording = open_recording(tmp_path / "a.bag")
    before = recording.notes
    assert [recording.view(k).depth.valid.any() for k in range(3)] == [k != number for k in range(3)]
    assert recording.notes[:-1] == before
    assert recording.notes[-1].startswith("1 depth image could not be used: An image of /depth")
    with pytest.raises(InputError, match="shorter than its size"):
        recording.frame(number)
    assert_frame(recording, 2, written.frames[2])


def test_damage_behind_the_index_is_one_sentence(tmp_path):
    """The bag is whole when it is opened, and its images are overwritten afterwards."""
    path = write_walk(tmp_path, orbit(3), "foxglove")
    recording = open_recording(path)
    data = path.read_bytes()
    path.write_bytes(data[:200] + bytes(len(data) - 400) + data[-200:])
    with pytest.raises(InputError, match=r"walk.mcap cannot be read") as error:
        recording.frame(1)
    assert "\n" not in str(error.value)
    assert not recording.view(1).depth.valid.any()


def test_images_of_another_size_are_compared_with_what_they_must_fit(tmp_path):
    """Colour has its camera's size, and depth, which is resized, that of the first depth image."""
    bag = BagWriter(tmp_path / "a.bag", "ros1")
    with bag.writer:
        bag.write("/rgb/camera_info", Info(k=CAMERA.matrix, size=(40, 30)).message(bag, 1.0), 1.0)
        for k, size in enumerate([(40, 30), (80, 60)]):
            bag.write("/rgb/image", Images(colors(1, size)).message(bag, 1.0 + k, 0), 1.0 + k)
            bag.write("/depth/image", Images(wall(1, size)).message(bag, 1.0 + k, 0), 1.0 + k)
    recording = open_recording(tmp_path / "a.bag")
    says = "An image of /rgb/image has 80 x 60 pixels and its camera 40 x 30"
    with pytest.raises(InputError, match=says):
        recording.frame(1)
    assert not recording.view(1).depth.valid.any()
    of_depth, of_colors = recording.notes[-2:]
    assert "/depth/image has 80 x 60 pixels and the first image of this topic with depth 40 x 30" in of_depth
    assert of_colors.startswith(f"1 colour image could not be used: {says}")


@pytest.mark.parametrize("kind", KINDS)
def test_opening_reports_progress_and_can_be_stopped(tmp_path, kind):
    steps = iterate_opening(write_walk(tmp_path, orbit(50), kind))
    fractions = [next(steps).fraction for _ in range(4)]
    assert fractions == sorted(set(fractions))
    steps.close()


def test_a_folder_with_one_bag_is_that_bag(tmp_path):
    path = write_walk(tmp_path / "once", orbit(2), "ros1")
    assert open_recording(tmp_path / "once").path == path
    (tmp_path / "once" / "second.bag").write_bytes(path.read_bytes())
    with pytest.raises(InputError, match=r"holds 2 bags; try one of them: second.bag, walk.bag"):
        open_recording(tmp_path / "once")


def test_a_bag_has_its_own_cameras(tmp_path):
    path = write_walk(tmp_path, orbit(2), "ros1")
    with pytest.raises(InputError, match="without intrinsics"):
        open_recording(path, intrinsics=tmp_path / "camera.json")


def test_a_bag_without_any_depth_or_without_a_topic_of_it_is_refused(tmp_path):
    path = write_walk(tmp_path, blind(orbit(2), 0, 1), "ros1")
    with pytest.raises(NoDepthError, match=r"No frame of .*walk.bag has depth; check .* /depth/image"):
        open_recording(path)
    bag = write_parts(tmp_path / "b.bag", {"/rgb/image": Images(colors(2))}, {"/rgb/camera_info": Info()})
    with pytest.raises(InputError, match="has no depth images but /rgb/image"):
        open_recording(bag)


@pytest.mark.parametrize("share", [0.2, 0.6, 0.95])
@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_that_was_cut_off_gets_one_sentence(tmp_path, kind, share):
    path = write_walk(tmp_path, orbit(6), kind)
    (file,) = [path] if path.is_file() else [f for f in path.iterdir() if f.suffix in (".db3", ".mcap")]
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match="The bag") as error:
        drain(iterate_opening(path))
    assert "\n" not in str(error.value)
