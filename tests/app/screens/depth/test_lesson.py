"""The lesson about depth: what a stop sets, bad settings, and whether what it says is true."""

import numpy as np
import pytest

from app.lesson.reading import read_lesson
from app.screens.depth.hide_job import hidden_pixels
from app.screens.depth.labels import EVERYWHERE
from app.screens.depth.lesson import KIND, SHIPPED, DepthLook
from app.screens.depth.view import Disc, HideRequest
from packetmesh.errors import InputError
from pipeline.config import DepthConfig
from pipeline.depth import DepthNetwork, align_depth
from pipeline.depth.confidence import distance_to_measured, judge
from pipeline.io.demos import load_demo


def lesson(tmp_path, text):
    path = tmp_path / "lesson.md"
    path.write_text(text)
    return read_lesson(path, KIND)


def test_a_stop_sets_what_it_names_and_leaves_the_rest_as_the_screen_begins(tmp_path):
    bare, full = lesson(
        tmp_path,
        "# A\n## One\nx\n## Two\nset: left = difference\nset: right = confidence\nset: split = 30 %\n"
        "set: alignment = median\nset: colours = confidence of inferred points\n"
        "set: inferred points = everywhere\nset: reach = 7 %\nset: least confidence = 40 %\n"
        "set: hide = 20 % wide at 30 % 62.5 %\nx",
    ).stops
    begin = DepthConfig()
    assert (bare.look.alignment, bare.look.reach) == (begin.alignment, begin.reach)
    assert bare.look == DepthLook()
    hide = HideRequest(0, (Disc(0.3, 0.625, 0.2),))
    assert full.look == DepthLook(
        "difference", "confidence", 0.3, "median", "confidence", EVERYWHERE, 0.07, 0.4, hide
    )


def test_to_hide_nothing_takes_back_what_was_to_be_hidden(tmp_path):
    (stop,) = lesson(
        tmp_path, "# A\n## One\nset: hide = 20 % wide at 30 % 40 %\nset: hide = nothing\nx"
    ).stops
    assert stop.look == DepthLook()


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ("picture = photo", "cannot set picture = photo: try one of left, right, split"),
        ("left = rgb", "try one of photo, sensor depth, inferred depth, difference, confidence"),
        ("split = half", "try 0 to 100 %"),
        ("split = 101 %", "try 0 to 100 %"),
        ("alignment = best", "try one of none, median, affine_depth, affine_inverse, local"),
        ("colours = red", "try one of source, photo, confidence of inferred points"),
        ("inferred points = all", "try one of only in the holes, everywhere, hidden"),
        ("reach = 0.1", "try more than 0 to 100 %"),
        ("reach = 0 %", "try more than 0 to 100 %"),
        ("least confidence = high", "try 0 to 100 %"),
        ("hide = table", "try 'nothing' or for example '20 % wide at 50 % 40 %'"),
        ("hide = 20 % wide at 50 % 140 %", "try 'nothing' or for example '20 % wide at 50 % 40 %'"),
    ],
)
def test_a_bad_setting_is_one_sentence(tmp_path, setting, sentence):
    with pytest.raises(InputError) as error:
        lesson(tmp_path, f"# A\n## One\nset: {setting}\nx")
    assert str(error.value).startswith("The lesson lesson.md, line 3, stop 'One' cannot set ")
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def look_at(title):
    (stop,) = (stop for stop in read_lesson(SHIPPED, KIND).stops if stop.title == title)
    return stop.look


def test_the_stops_show_what_their_text_speaks_of():
    assert (look_at("What the sensor saw").left, look_at("What the sensor saw").right) == ("photo", "sensor")
    assert look_at("What the network says").right == "inferred"
    assert look_at("What the network says").alignment == "none"
    assert look_at("A line and a correction").right == "difference"
    assert look_at("How much to trust it").coloring == "confidence"
    assert look_at("Points that fly").reach < DepthConfig().reach
    assert look_at("Hide measured depth").hide is not None


@pytest.fixture(scope="module")
def room():
    return load_demo("living-room").frames[0]


def test_alignment_does_what_the_lesson_says(room):
    inferred = DepthNetwork().infer(room.rgb)
    residual = {mode: align_depth(inferred, room.depth, mode) for mode in ("none", "median", "local")}
    assert np.all(inferred.valid)
    assert residual["local"].residual_rms_m < residual["median"].residual_rms_m
    bias_m = {mode: np.nanmedian(a.depth.z_m - room.depth.z_m) for mode, a in residual.items()}
    assert abs(bias_m["median"]) < 0.2


def test_confidence_and_what_is_left_out_are_as_the_lesson_says(room):
    alignment = align_depth(DepthNetwork().infer(room.rgb), room.depth)
    judged = judge(alignment, room.depth, room.rgb, look_at("Points that fly").reach, 0.0)
    blind = ~room.depth.valid
    distance = distance_to_measured(room.depth.valid)
    near, far = (distance < 0.005) & blind, (distance > 0.02) & blind
    assert judged.confidence[near].mean() > judged.confidence[far].mean() + 0.1
    assert judged.flying.sum() > 100
    assert judged.out_of_reach.sum() > 100
    assert not np.any(judged.depth.valid & (judged.flying | judged.out_of_reach))


@pytest.mark.parametrize("scene", ["living-room", "office", "workshop", "box-on-table"])
def test_what_the_last_stop_hides_was_measured_in_every_scene(scene):
    request = look_at("Hide measured depth").hide
    for frame in load_demo(scene).frames:
        columns = frame.depth.z_m.shape[1]
        (disc,) = request.discs
        disc_px = np.pi * (0.5 * disc.size_share * columns) ** 2
        assert hidden_pixels(frame.depth, request.discs).sum() > 0.8 * disc_px
