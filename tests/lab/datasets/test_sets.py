"""The door to all sets, splits by scene, and anybody's own folder of pairs."""

import json

import numpy as np
import pytest

from lab.datasets import SETS, Pair, open_set, scene_of, split_by_scene
from packetmesh.errors import InputError
from tests.lab.datasets.setfiles import cut, picture, write_rgb, write_units

UNITS = np.arange(48).reshape(6, 8) * 40  # the first pixel is unknown


def _truth_m(units_per_metre):
    return np.where(UNITS > 0, UNITS / units_per_metre, np.nan)


@pytest.mark.parametrize(
    ("rgb_file", "depth_file", "name"),
    [
        ("color/a.png", "depth/a.png", "mine/a"),
        ("rgb/a.png", "depth/a.png", "mine/a"),
        ("kitchen/image/a.png", "kitchen/depth/a.png", "kitchen/a"),
        ("a_1_rgb.png", "a_1_depth.png", "mine/a_1"),
        ("bath/a_color.png", "bath/a_depth.png", "bath/a"),
        ("desk/color.png", "desk/depth.png", "desk/color"),
    ],
)
def test_a_folder_pairs_by_name_and_reads_millimetres(tmp_path, rgb_file, depth_file, name):
    root = tmp_path / "mine"
    write_rgb(root / rgb_file, picture())
    write_units(root / depth_file, UNITS)
    (pair,) = open_set(f"folder={root}")
    assert pair.name == name
    np.testing.assert_array_equal(pair.rgb, picture())
    np.testing.assert_allclose(pair.truth_m, _truth_m(1000.0), rtol=1e-6)
    assert pair.truth_m.dtype == np.float32
    assert pair.judged is None
    assert pair.intrinsics is None


def test_a_folder_takes_intrinsics_that_lie_beside_the_pair(tmp_path):
    write_rgb(tmp_path / "color.png", picture())
    write_units(tmp_path / "depth.png", UNITS)
    camera = {"width": 8, "height": 6, "fx": 7.0, "fy": 7.5, "cx": 3.5, "cy": 2.5}
    (tmp_path / "intrinsics.json").write_text(json.dumps(camera))
    (pair,) = open_set(f"folder={tmp_path}")
    assert (pair.intrinsics.fx_px, pair.intrinsics.fy_px) == (7.0, 7.5)
    assert (pair.intrinsics.cx_px, pair.intrinsics.cy_px) == (3.5, 2.5)


def test_pictures_without_depth_are_left_out_with_a_warning(tmp_path, caplog):
    for stem in "ab":
        write_rgb(tmp_path / "color" / f"{stem}.png", picture())
    write_units(tmp_path / "depth" / "b.png", UNITS)
    assert [scene_of(pair.name) + pair.name[-2:] for pair in open_set(f"folder={tmp_path}")] == [
        f"{tmp_path.name}/b"
    ]
    assert "1 pictures" in caplog.text


def test_pairs_are_read_only_when_asked_for(tmp_path):
    for stem in "ab":
        write_rgb(tmp_path / "color" / f"{stem}.png", picture())
        write_units(tmp_path / "depth" / f"{stem}.png", UNITS)
    cut(tmp_path / "depth" / "b.png")
    pairs = open_set(f"folder={tmp_path}")
    assert next(pairs).name.endswith("/a")
    with pytest.raises(InputError, match=r"b\.png is truncated or damaged"):
        next(pairs)


def test_a_truncated_picture_is_named(tmp_path):
    cut(write_rgb(tmp_path / "color.png", picture()))
    write_units(tmp_path / "depth.png", UNITS)
    with pytest.raises(InputError, match=r"color\.png is truncated or damaged; try"):
        next(open_set(f"folder={tmp_path}"))


def test_depth_of_another_size_is_refused():
    with pytest.raises(InputError, match="x/1 has a picture of 8 x 6 and depth of 6 x 8 pixels"):
        Pair("x/1", picture(), np.ones((8, 6), np.float32))


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


@pytest.mark.parametrize("share", [0.01, 0.2, 0.5, 0.99])
@pytest.mark.parametrize("seed", range(5))
def test_no_scene_is_on_both_sides_of_a_split(share, seed):
    names = [f"house/room{room}/{frame}" for frame in range(4) for room in range(9)]
    kept, held_out = split_by_scene(names, share, seed)
    rooms, other_rooms = ({scene_of(name) for name in side} for side in (kept, held_out))
    assert rooms.isdisjoint(other_rooms)
    assert sorted(kept + held_out) == sorted(names)
    assert len(other_rooms) == np.clip(round(9 * share), 1, 8)
    assert kept == [name for name in names if name in kept]


def test_a_split_depends_on_the_seed_and_not_on_the_order():
    names = [f"room{room}/{frame}" for room in range(12) for frame in range(3)]
    _, held_out = split_by_scene(names, 0.25, 4)
    assert set(split_by_scene(reversed(names), 0.25, 4)[1]) == set(held_out)
    assert any(set(split_by_scene(names, 0.25, seed)[1]) != set(held_out) for seed in range(4))


def test_what_cannot_be_split_is_refused():
    with pytest.raises(InputError, match=r"share of scenes to hold out is 1\.5"):
        split_by_scene(["a/1", "b/1"], 1.5, 0)
    with pytest.raises(InputError, match="only the scene a, too little"):
        split_by_scene(["a/1", "a/2"], 0.5, 0)
    with pytest.raises(InputError, match="no scene, too little"):
        split_by_scene([], 0.5, 0)


def test_a_set_without_a_split_of_its_own_is_split_by_scene(tmp_path):
    for scene in "abcde":
        for stem in "12":
            write_rgb(tmp_path / scene / "color" / f"{stem}.png", picture())
            write_units(tmp_path / scene / "depth" / f"{stem}.png", UNITS)
    train, test = ([pair.name for pair in open_set(f"folder={tmp_path}", part)] for part in ("train", "test"))
    assert len(train) == 8
    assert len(test) == 2
    assert {scene_of(name) for name in train}.isdisjoint(map(scene_of, test))
    assert sorted(train + test) == [pair.name for pair in open_set(f"folder={tmp_path}")]


def test_real_frames_are_a_folder_of_pairs(shared_data):
    pairs = {pair.name: pair for pair in open_set(f"folder={shared_data}")}
    assert {"kinect_basket/color", "kinect_desk/color"} <= set(pairs)
    for pair in pairs.values():
        assert pair.rgb.shape[:2] == pair.truth_m.shape == (480, 640)
        assert 0.5 < np.nanmedian(pair.truth_m) < 4.0
        assert pair.intrinsics.width_px == 640
