"""Bags become the rig that was recorded."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import bag_topics, iterate_import
from pipeline.importing.bag_reader import SUFFIXES
from pipeline.importing.recorded import open_recording
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.images import read_depth
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import rigid, rotation_exp
from tests.pipeline.importing.bags import DEPTHS, write_bag
from tests.pipeline.importing.foxglove_files import write_foxglove
from tests.pipeline.importing.recordings import orbit


def file_of(tmp_path, kind):
    return tmp_path / ("recording.bag" if kind == "ros1" else "recording")


def imported(tmp_path, kind="ros2", **options):
    report = drain(iterate_import(file_of(tmp_path, kind), tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig")


def assert_same(frame, expected):
    np.testing.assert_array_equal(frame.rgb, expected.rgb)
    np.testing.assert_allclose(frame.depth.z_m, expected.depth.z_m, atol=1e-6)
    np.testing.assert_array_equal(frame.intrinsics.matrix, expected.intrinsics.matrix)
    np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "depth"), [*(("ros2", depth) for depth in DEPTHS), ("ros1", "image"), ("mcap", "image")]
)
def test_cameras_of_a_bag_are_the_nodes_that_were_recorded(tmp_path, kind, depth):
    written = orbit(3)
    write_bag(file_of(tmp_path, kind), written, kind, depth)
    report, rig = imported(tmp_path, kind)
    assert report.kind == "bag"
    for frame, expected in zip(rig.frames, written.frames, strict=True):
        assert_same(frame, expected)


def test_a_single_file_of_a_bag_is_enough(tmp_path):
    write_bag(tmp_path / "recording", orbit(2), "mcap")
    (file,) = (tmp_path / "recording").glob("*.mcap")
    drain(iterate_import(file, tmp_path / "rig"))
    assert len(load_rig(tmp_path / "rig").frames) == 2


@pytest.mark.parametrize("kind", ["ros1", "ros2", "mcap", "foxglove"])
def test_a_bags_suffix_may_be_in_capitals(tmp_path, kind):
    """As on a card that was written under Windows; a folder with only this bag is the bag, too."""
    written = orbit(2)
    if kind == "foxglove":
        file = write_foxglove(tmp_path / "a.mcap", written)
    else:
        write_bag(file_of(tmp_path, kind), written, kind)
        (file,) = (path for path in tmp_path.rglob("*") if path.suffix in SUFFIXES)
    (tmp_path / "card").mkdir()
    loud = file.rename(tmp_path / "card" / f"WALK{file.suffix.upper()}")
    drain(iterate_import(loud, tmp_path / "rig"))
    for frame, expected in zip(load_rig(tmp_path / "rig").frames, written.frames, strict=True):
        assert_same(frame, expected)
    assert open_recording(tmp_path / "card").path == loud
    with pytest.raises(InputError, match=r"holds the bag WALK.*; try .*/card/WALK"):
        drain(iterate_import(tmp_path / "card", tmp_path / "other"))


def test_one_camera_gives_moments_spread_over_the_bag(tmp_path):
    write_bag(tmp_path / "recording", orbit(1), moments=9)
    report, rig = imported(tmp_path, frames=3)
    assert len(rig.frames) == 3
    assert [frame.time_s for frame in report.frames] == pytest.approx([100.0, 102.0, 104.0])
    assert any("reconstruct looks for their poses" in note for note in report.notes)


@pytest.mark.parametrize(
    ("cameras", "leave_out", "nodes", "says"),
    [
        (3, "cam1/depth", 2, ["/cam1/color/image is left out: no depth belongs to it"]),
        (
            3,
            "cam2/color/camera_info",
            2,
            [
                "/cam2/color/image is left out: no camera_info of /cam2/color/image is in the bag, which has "
                "only /cam0/color/camera_info, /cam1/color/camera_info; try to record "
                "/cam2/color/camera_info, too",
                "/cam2/depth/image is left out: no colour topic belongs to it alone",
            ],
        ),
        (3, "cam0/color/image", 2, ["/cam0/depth/image is left out: no colour topic belongs to it alone"]),
        (8, "nothing", 8, []),
        (2, "nothing", 2, []),
    ],
)
def test_every_camera_that_is_left_out_is_named_with_the_reason(tmp_path, cameras, leave_out, nodes, says):
    write_bag(tmp_path / "recording", orbit(cameras), leave_out=leave_out)
    report, rig = imported(tmp_path)
    assert len(rig.frames) == nodes
    assert [note for note in report.notes if "left out" in note] == says


def test_cameras_beyond_the_largest_rig_are_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(bag_topics, "MAX_NODES", 2)
    write_bag(tmp_path / "recording", orbit(3))
    report, rig = imported(tmp_path)
    assert len(rig.frames) == 2
    assert "/cam2/color/image is left out: a rig has at most 2 nodes" in report.notes


def test_a_scan_tells_how_far_it_is_and_can_be_stopped(tmp_path):
    write_bag(tmp_path / "recording", orbit(2), moments=30)
    steps = iterate_import(tmp_path / "recording", tmp_path / "rig")
    told = [next(steps).fraction for _ in range(4)]
    assert told == sorted(set(told))
    steps.close()
    assert not (tmp_path / "rig").exists()


@pytest.mark.parametrize(
    ("spoiled", "says"),
    [
        ({"leave_out": "depth"}, "no depth images"),
        ({"leave_out": "color"}, "no colour images"),
        ({"leave_out": "camera_info"}, "no camera_info"),
        ({"leave_out": "cam"}, "no images at all"),
        ({"late_s": 7.0}, "clocks"),
    ],
)
def test_a_bag_that_lacks_something_gets_one_sentence_and_leaves_nothing(tmp_path, spoiled, says):
    write_bag(tmp_path / "recording", orbit(2), **spoiled)
    with pytest.raises(InputError, match=says) as error:
        imported(tmp_path)
    assert "\n" not in str(error.value)
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]


def test_depth_with_a_frame_of_its_own_keeps_its_camera_and_its_place(tmp_path):
    T_color_depth = rigid(rotation_exp(np.array([0.0, 0.02, 0.0])), np.array([0.05, 0.0, 0.01]))
    written = orbit(2)
    write_bag(tmp_path / "recording", written, T_color_depth=T_color_depth)
    _, rig = imported(tmp_path)
    node = tmp_path / "rig" / "node_01"
    np.testing.assert_allclose(read_extrinsics(node / "extrinsics.json"), T_color_depth, atol=1e-9)
    np.testing.assert_allclose(read_depth(node / "depth.png").z_m, written.frames[1].depth.z_m, atol=1e-6)
    np.testing.assert_allclose(rig.frames[1].T_world_camera, written.frames[1].T_world_camera, atol=1e-9)


def test_depth_with_a_frame_that_nothing_links_is_refused(tmp_path):
    write_bag(tmp_path / "recording", orbit(1), T_color_depth=np.eye(4), leave_out="tf_static")
    with pytest.raises(InputError, match="static transform"):
        imported(tmp_path)


@pytest.mark.parametrize(("depth", "usual"), [("image", 1000.0), ("image/metres", 1.0)])
def test_the_scale_is_the_encodings_own_or_the_one_that_is_given(tmp_path, depth, usual):
    write_bag(tmp_path / "recording", orbit(1), depth=depth)
    report, rig = imported(tmp_path)
    assert report.depth_scale == usual
    given = drain(iterate_import(tmp_path / "recording", tmp_path / "half", depth_scale=2.0 * usual))
    half = load_rig(tmp_path / "half").frames[0]
    assert given.depth_scale == 2.0 * usual
    np.testing.assert_allclose(half.depth.z_m, rig.frames[0].depth.z_m / 2.0, atol=6e-4)


def test_a_bag_has_its_own_cameras(tmp_path):
    write_bag(tmp_path / "recording", orbit(1))
    with pytest.raises(InputError, match="without intrinsics"):
        imported(tmp_path, intrinsics=tmp_path / "camera.json")


@pytest.mark.parametrize("name", ["broken.bag", "broken.mcap", "broken.db3"])
def test_a_damaged_bag_gets_one_sentence(tmp_path, name):
    (tmp_path / name).write_bytes(b"not a bag at all" * 20)
    with pytest.raises(InputError, match="cannot be read") as error:
        drain(iterate_import(tmp_path / name, tmp_path / "rig"))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("share", [0.2, 0.6, 0.95])
@pytest.mark.parametrize("kind", ["ros1", "ros2", "mcap"])
def test_a_bag_that_was_cut_off_gets_one_sentence(tmp_path, kind, share):
    write_bag(file_of(tmp_path, kind), orbit(2), kind)
    folder = tmp_path if kind == "ros1" else tmp_path / "recording"
    (file,) = (path for path in folder.iterdir() if path.suffix in (".bag", ".db3", ".mcap"))
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match="The bag") as error:
        imported(tmp_path, kind)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "rig").exists()
