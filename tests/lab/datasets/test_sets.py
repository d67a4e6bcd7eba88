"""The door to all sets, and anybody's own folder of pairs."""

from pathlib import Path

import numpy as np
import pytest

from lab.datasets import SETS, Pair, open_set
from packetmesh.errors import InputError
from tests.lab.datasets.setfiles import cut, picture, write_rgb, write_units

UNITS = np.arange(48).reshape(6, 8) * 40  # the first pixel is unknown


def _truth_m(units_per_metre):
    return np.where(UNITS > 0, UNITS / units_per_metre, np.nan)


@pytest.mark.parametrize(
    ("rgb_file", "depth_file"),
    [
        ("color/a.png", "depth/a.png"),
        ("rgb/a.png", "depth/a.png"),
        ("kitchen/image/a.png", "kitchen/depth/a.png"),
        ("a_1_rgb.png", "a_1_depth.png"),
        ("bath/a_color.png", "bath/a_depth.png"),
        ("desk/color.png", "desk/depth.png"),
    ],
)
def test_a_folder_pairs_by_name_and_reads_millimetres(tmp_path, rgb_file, depth_file):
    write_rgb(tmp_path / rgb_file, picture())
    write_units(tmp_path / depth_file, UNITS)
    (pair,) = open_set(f"folder={tmp_path}")
    assert pair.picture == tmp_path / rgb_file
    np.testing.assert_array_equal(pair.rgb, picture())
    np.testing.assert_allclose(pair.truth_m, _truth_m(1000.0), rtol=1e-6)
    assert pair.truth_m.dtype == np.float32
    assert pair.judged is None


def test_pictures_without_depth_are_left_out_with_a_warning(tmp_path, caplog):
    for stem in "ab":
        write_rgb(tmp_path / "color" / f"{stem}.png", picture())
    write_units(tmp_path / "depth" / "b.png", UNITS)
    assert [pair.picture.name for pair in open_set(f"folder={tmp_path}")] == ["b.png"]
    assert "1 pictures" in caplog.text


def test_pairs_are_read_only_when_asked_for(tmp_path):
    for stem in "ab":
        write_rgb(tmp_path / "color" / f"{stem}.png", picture())
        write_units(tmp_path / "depth" / f"{stem}.png", UNITS)
    cut(tmp_path / "depth" / "b.png")
    pairs = open_set(f"folder={tmp_path}")
    assert next(pairs).picture.name == "a.png"
    with pytest.raises(InputError, match=r"b\.png is truncated or damaged"):
        next(pairs)


def test_a_truncated_picture_is_named(tmp_path):
    cut(write_rgb(tmp_path / "color.png", picture()))
    write_units(tmp_path / "depth.png", UNITS)
    with pytest.raises(InputError, match=r"color\.png is truncated or damaged; try"):
        next(open_set(f"folder={tmp_path}"))


def test_depth_of_another_size_is_refused():
    with pytest.raises(InputError, match=r"x/1\.png has a picture of 8 x 6 and depth of 6 x 8 pixels"):
        Pair(Path("x/1.png"), picture(), np.ones((8, 6), np.float32))


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("nyuv2", "nyu"), ("Kity", "kitti"), ("sun-rgbd", "sunrgbd"), ("midlebury", "middlebury")],
)
def test_an_unknown_kind_is_answered_with_the_nearest_one(tmp_path, wrong, right):
    with pytest.raises(InputError, match=f"no kind of set '{wrong.lower()}'.* did you mean {right}\\?"):
        open_set(f"{wrong}={tmp_path}")


def test_a_kind_like_no_other_is_answered_with_all_of_them(tmp_path):
    with pytest.raises(InputError, match=f"try one of {', '.join(SETS)}"):
        open_set(f"###={tmp_path}")


@pytest.mark.parametrize("kind", SETS)
def test_every_kind_refuses_missing_and_empty_folders_at_once(tmp_path, kind):
    with pytest.raises(InputError, match=f"{tmp_path}/nowhere of the set {kind} does not exist"):
        open_set(f"{kind}={tmp_path}/nowhere")
    with pytest.raises(InputError, match=f"no pair of picture and depth in {tmp_path}; a {kind} set has "):
        open_set(f"{kind}={tmp_path}")
    with pytest.raises(InputError, match=f"names no folder; try {kind}=/path"):
        open_set(kind)


def test_real_frames_are_a_folder_of_pairs(shared_data):
    pairs = {pair.picture.parent.name: pair for pair in open_set(f"folder={shared_data}")}
    assert {"kinect_basket", "kinect_desk"} <= set(pairs)
    for pair in pairs.values():
        assert pair.rgb.shape[:2] == pair.truth_m.shape == (480, 640)
        assert 0.5 < np.nanmedian(pair.truth_m) < 4.0
