"""SUN RGB-D's rotated depth and TUM's clocks."""

import numpy as np
import pytest

from lab.datasets import open_set
from packetmesh.errors import InputError
from pipeline.importing.tum import associate
from tests.lab.datasets.setfiles import cut, picture, write_rgb, write_units

MILLIMETRES = np.array([[0, 1, 7, 8, 500], [1234, 4095, 8000, 8001, 8191], [8192, 9999, 20000, 40000, 65534]])


def _rotated(millimetres):
    """What SUN RGB-D's writers do: three bits to the left, the top ones come in at the bottom."""
    units = millimetres.astype(np.uint16)
    return (units << 3) | (units >> 13)


def _sun(folder, kind="depth_bfx", millimetres=MILLIMETRES):
    write_rgb(folder / "image/0001.png", picture(5, 3))
    write_units(folder / kind / "0001.png", _rotated(millimetres))


def test_sun_depth_is_rotated_back_and_unknown_beyond_8_m(tmp_path):
    _sun(tmp_path / "kv2/kinect2data/000002")
    (pair,) = open_set(f"sunrgbd={tmp_path}")
    assert pair.picture == tmp_path / "kv2/kinect2data/000002/image/0001.png"
    np.testing.assert_array_equal(pair.rgb, picture(5, 3))
    known = (MILLIMETRES > 0) & (MILLIMETRES <= 8000)
    np.testing.assert_allclose(pair.truth_m, np.where(known, MILLIMETRES / 1000.0, np.nan), rtol=1e-6)
    assert pair.judged is None


def test_sun_prefers_the_merged_depth(tmp_path):
    _sun(tmp_path / "a", "depth", np.full((3, 5), 1000))
    _sun(tmp_path / "b", "depth", np.full((3, 5), 1000))
    _sun(tmp_path / "b", "depth_bfx", np.full((3, 5), 2000))
    first, second = open_set(f"sunrgbd={tmp_path}")
    np.testing.assert_array_equal(first.truth_m, 1.0)
    np.testing.assert_array_equal(second.truth_m, 2.0)
    cut(tmp_path / "a/depth/0001.png")
    with pytest.raises(InputError, match=r"a/depth/0001\.png is truncated or damaged"):
        next(open_set(f"sunrgbd={tmp_path}"))


def _tum(folder, rgb_s, depth_s):
    folder.mkdir(parents=True)
    for kind, times_s in (("rgb", rgb_s), ("depth", depth_s)):
        lines = ["# timestamp filename"]
        for index, time_s in enumerate(times_s):
            file = folder / kind / f"{time_s:.6f}.png"
            if kind == "rgb":
                write_rgb(file, picture(seed=index))
            else:
                write_units(file, np.full((6, 8), 5000 + 1000 * index))
            lines.append(f"{time_s:.6f} {kind}/{file.name}")
        (folder / f"{kind}.txt").write_text("\n".join(lines) + "\n")


def test_tum_frames_are_matched_by_time_and_scaled_by_5000(tmp_path):
    _tum(tmp_path / "rgbd_dataset_freiburg1_desk", [1.0, 1.03, 1.5, 2.0], [1.011, 1.034, 1.519, 2.021])
    pairs = list(open_set(f"tum={tmp_path}"))
    assert [pair.picture.stem for pair in pairs] == ["1.000000", "1.030000", "1.500000"]
    for index, pair in enumerate(pairs):
        np.testing.assert_array_equal(pair.rgb, picture(seed=index))
        np.testing.assert_allclose(pair.truth_m, 1.0 + 0.2 * index, rtol=1e-6)


def test_association_takes_each_time_once_and_the_nearest_first():
    first_s, second_s = np.array([0.0, 0.010, 1.0]), np.array([0.009, 0.025, 1.02, 3.0])
    assert associate(first_s, second_s) == [(1, 0)]
    assert associate(np.array([0.0, 0.010]), np.array([0.006, 0.0295])) == [(1, 0)]
    assert associate(np.array([0.0, 0.010]), np.array([0.009, -0.005])[::-1]) == [(0, 0), (1, 1)]
    rng = np.random.default_rng(0)
    first_s, second_s = np.sort(rng.uniform(0, 3, 80)), np.sort(rng.uniform(0, 3, 90))
    pairs = associate(first_s, second_s)
    assert all(len(set(side)) == len(pairs) for side in zip(*pairs, strict=True))
    assert all(abs(first_s[i] - second_s[j]) < 0.02 for i, j in pairs)


def test_bad_tum_lists_are_named(tmp_path):
    _tum(tmp_path / "s", [1.0], [1.5])
    with pytest.raises(InputError, match=r"no pair of picture and depth .* less than 20 ms apart"):
        open_set(f"tum={tmp_path}")
    (tmp_path / "s/depth.txt").write_text("yesterday depth/1.png\n")
    with pytest.raises(InputError, match=r"s/depth\.txt has the line 'yesterday depth/1\.png'"):
        open_set(f"tum={tmp_path}")
    (tmp_path / "s/depth.txt").write_text("1.0 depth/gone.png\n")
    with pytest.raises(InputError, match=r"depth/gone\.png does not exist"):
        next(open_set(f"tum={tmp_path}"))
