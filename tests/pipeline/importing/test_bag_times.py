"""Moments of a bag: headers without times, and never the same moment twice."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.bag import _iterate_moments
from pipeline.importing.bag_times import moments_from_middle, moments_of, times_of
from pipeline.io.images import NoDepthError
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.bag_parts import Images, Info, colors, wall, write_parts

COLOR, DEPTH, INFO = "/zed/left/image_rect_color", "/zed/depth/depth_registered", "/zed/left/camera_info"


def imported(tmp_path, color, depth, frames=3, kind="ros2"):
    path = write_parts(
        tmp_path / ("a.bag" if kind == "ros1" else "a"), {COLOR: color, DEPTH: depth}, {INFO: Info()}, kind
    )
    report = drain(iterate_import(path, tmp_path / "rig", frames))
    return report, load_rig(tmp_path / "rig").frames


def order_of(frames, written):
    """Indices of the written moments in the nodes, by colour and by depth."""
    by_color = [
        next(k for k, one in enumerate(written) if np.array_equal(one, frame.rgb)) for frame in frames
    ]
    return by_color, [round(1000 * float(frame.depth.z_m[5, 5])) - 2000 for frame in frames]


@pytest.mark.parametrize("kind", ["ros1", "ros2", "mcap"])
@pytest.mark.parametrize("stamp", [lambda _: 0.0, lambda _: 77.25])
@pytest.mark.parametrize("only", ["both", "colour", "depth"])
def test_headers_without_times_leave_the_times_of_the_bag(tmp_path, kind, stamp, only):
    written = colors(3)
    color = Images(written, **({"stamp_s": stamp} if only != "depth" else {}))
    depth = Images(wall(3), late_s=0.004, **({"stamp_s": stamp} if only != "colour" else {}))
    report, frames = imported(tmp_path, color, depth, kind=kind)
    assert order_of(frames, written) == ([0, 1, 2], [0, 1, 2])
    assert [frame.time_s for frame in report.frames] == pytest.approx([100.0, 100.5, 101.0])
    assert any("came into the bag are used" in note for note in report.notes)


def test_good_headers_are_used_though_the_bag_is_late(tmp_path):
    """The depth comes 0.3 s late into the bag, but its header has the time of the colour image."""
    written = colors(3)
    depth = Images(wall(3), late_s=0.3, stamp_s=lambda time_s: time_s - 0.3)
    report, frames = imported(tmp_path, Images(written), depth)
    assert order_of(frames, written) == ([0, 1, 2], [0, 1, 2])
    assert not any("came into the bag" in note for note in report.notes)


def test_a_time_that_two_headers_have_is_one_moment(tmp_path):
    """The second of four headers repeats the first."""
    repeated = {100.5: 100.0}
    stamp = {"stamp_s": lambda time_s: repeated.get(time_s, time_s)}
    _, frames = imported(tmp_path, Images(colors(4), **stamp), Images(wall(4), **stamp), frames=6)
    by_color, by_depth = order_of(frames, colors(4))
    assert by_color == [0, 2, 3]
    assert by_depth == [0, 2, 3]


def test_a_depth_image_is_in_one_moment_only():
    """Colour every 20 ms and depth every 40 ms, 4 ms late: of two colour images the nearer one counts."""
    color_s, depth_s = np.arange(6) * 0.02, np.arange(3) * 0.04 + 0.004
    moments = moments_of(Path("a.bag"), [color_s, depth_s])
    np.testing.assert_array_equal(moments, [[0, 0], [2, 1], [4, 2]])


def test_moments_of_several_cameras_begin_in_the_middle():
    """Of seven images the fourth has no partner within 50 ms; the middle is 3.5."""
    first_s, second_s = np.arange(7) * 1.0, np.array([0.0, 1.0, 2.0, 3.2, 4.0, 5.0, 6.0])
    moments = moments_from_middle(Path("a.bag"), [first_s, second_s])
    np.testing.assert_array_equal(moments[:, 0], [4, 2, 5, 1, 6, 0])


def test_one_header_without_a_time_is_no_statement_on_all_headers():
    def topic(stamps_s):
        return SimpleNamespace(name="/rgb", stamps_s=np.array(stamps_s), recorded_ns=np.array([5, 6, 7]))

    assert times_of([topic([1.0, 0.0, 3.0])])[1][0].startswith("Some headers of /rgb have no time: ")
    assert times_of([topic([0.0, 0.0, 0.0])])[1][0].startswith("All headers of /rgb have no time: ")
    assert times_of([topic([1.0, 2.0, 3.0])])[1] == ()


def test_all_messages_at_one_time_are_one_moment(tmp_path):
    times_s = [np.zeros(5), np.zeros(5)]
    assert len(moments_of(Path("a.bag"), times_s)) == 1


def test_messages_that_came_at_the_same_time_are_told_apart(tmp_path):
    """Two cameras' worth of messages in one topic: the headers differ, the times in the bag do not."""
    from tests.pipeline.importing.bags import BagWriter

    written, walls = colors(2), wall(2)
    bag = BagWriter(tmp_path / "a.bag", "ros1")
    with bag.writer:
        bag.write(INFO, Info().message(bag, 100.0), 100.0)
        for topic, values in ((COLOR, written), (DEPTH, walls)):
            for moment in range(2):
                message = Images(values).message(bag, 100.0 + moment, moment)
                bag.write(topic, message, 105.0)
    drain(iterate_import(tmp_path / "a.bag", tmp_path / "rig"))
    assert order_of(load_rig(tmp_path / "rig").frames, written) == ([0, 1], [0, 1])


def test_images_that_repeat_are_said(tmp_path):
    """Three times, and the same bytes: a recording that stood still."""
    repeated = Images(np.repeat(colors(1), 3, axis=0)), Images(np.repeat(wall(1), 3, axis=0))
    report, _ = imported(tmp_path, *repeated)
    assert "2 other nodes have the same images as node_00" in report.notes


@pytest.mark.parametrize(
    ("blank", "chosen"), [([0], [1, 5, 8]), ([0, 1, 8], [2, 4, 7]), (range(1, 9), [0]), ([], [0, 4, 8])]
)
def test_moments_without_depth_are_not_chosen(tmp_path, blank, chosen):
    """As where the first image came before the sensor had started."""
    depth = wall(9)
    depth[list(blank)] = 0
    report, frames = imported(tmp_path, Images(colors(9)), Images(depth))
    assert order_of(frames, colors(9))[1] == chosen
    notes = [note for note in report.notes if "without any depth" in note]
    what = "1 moment" if len(blank) == 1 else f"{len(blank)} moments"
    expected = f"{what} with a depth image without any depth {'was' if len(blank) == 1 else 'were'} left out"
    assert notes == ([expected] if blank else [])


@pytest.mark.parametrize("frames", [20, 200])
def test_the_depth_of_a_moment_is_read_once(frames):
    """The second half of 1800 moments is blank; after 300 of them those known to have depth remain."""
    read = []

    def check_depth(moment):
        read.append(int(moment[1]))
        if moment[1] >= 900:
            raise NoDepthError("blank")

    moments = np.repeat(np.arange(1800)[:, None], 2, axis=1)
    shares = []
    steps = _iterate_moments(moments, frames, check_depth)
    chosen, (note,) = drain(steps, lambda step: shares.append(step.fraction))
    assert len(read) == len(set(read)) <= 1200
    assert shares == sorted(shares)
    assert len(chosen) == frames
    assert chosen.max() < 900
    assert note.startswith("300 moments with")


def test_a_camera_that_is_always_blank_is_named_before_the_whole_bag_is_read():
    read = []

    def check_depth(moment):
        read.append(moment)
        raise NoDepthError("A depth image of /right has no depth anywhere")

    with pytest.raises(NoDepthError, match="/right"):
        drain(_iterate_moments(np.zeros((5000, 4), int), 1, check_depth))
    assert len(read) == 300


def test_a_bag_without_any_depth_is_refused(tmp_path):
    with pytest.raises(NoDepthError, match=f"A depth image of {DEPTH} has no depth anywhere"):
        imported(tmp_path, Images(colors(3)), Images(0 * wall(3)))
    assert not (tmp_path / "rig").exists()


def test_clocks_that_disagree_are_refused(tmp_path):
    depth = Images(wall(3), stamp_s=lambda time_s: time_s + 7.0)
    with pytest.raises(InputError, match="never less than 6 s apart"):
        imported(tmp_path, Images(colors(3)), depth)
