"""A depth scale that is doubtful is said, and one that is right is not."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.importing.depth_units import unrotated
from pipeline.io.demos import load_demo
from pipeline.io.depth_scale import NO_VALUE, doubts
from pipeline.io.images import read_depth

RNG = np.random.default_rng(3)
MM = RNG.integers(600, 4000, (30, 40)).astype(np.uint16)
"""A room of 2.3 m."""


def rotated(mm):
    return ((mm << 3) | (mm >> 13)).astype(np.uint16)


def test_millimetres_of_a_room_leave_nothing_to_say():
    assert doubts(MM, 1000.0, stated=False) == ()
    assert doubts(5 * MM, 5000.0, stated=False) == ()
    assert doubts((MM / 1000.0).astype(np.float32), 1.0, stated=False) == ()
    for step in (2, 10, 100):  # sensors that resolve no millimetres
        assert doubts(MM // step * step, 1000.0, stated=False) == ()
    assert doubts(np.full((30, 40), 2000, np.uint16), 1000.0, stated=False) == ()


@pytest.mark.parametrize(
    ("values", "says"),
    [
        (5 * MM, "--depth-scale 5000, which makes it 2."),
        (5 * (MM // 5), "--depth-scale 5000"),  # 3 m that are .6 m
        (rotated(MM), "--depth-scale 8000, which makes it 2."),
        (16 * MM.astype(np.int32), "unlikely for a room: try --depth-scale 10000"),
        (20 * MM.astype(np.int32), "unlikely for a room: try --depth-scale 10000"),
        (MM // 50, "unlikely for a room: try --depth-scale 100"),
        (MM.astype(np.float32) / 50.0, "unlikely for a room"),
    ],
)
def test_a_wrong_scale_is_one_sentence_that_says_what_to_try(values, says):
    scale = 1.0 if values.dtype == np.float32 else 1000.0
    (note,) = doubts(values, scale, stated=False)
    assert says in note
    assert "\n" not in note


def test_a_scale_that_a_person_gave_settles_what_the_steps_mean_but_not_a_median_of_no_room():
    assert doubts(5 * MM, 1000.0, stated=True) == ()
    assert doubts(rotated(MM), 8000.0, stated=True) == ()
    assert "unlikely for a room" in doubts(MM, 20.0, stated=True)[0]


def test_rotated_bits_are_told_where_some_depth_is_beyond_eight_metres():
    mm = MM.copy()
    mm[0, :20] = 9001
    np.testing.assert_array_equal(unrotated(rotated(mm)), mm)
    assert "rotated bits" in doubts(rotated(mm), 1000.0, stated=False)[0]


def test_values_that_stand_for_nothing_are_said_with_their_share():
    values = MM.copy()
    values[:3] = NO_VALUE
    assert doubts(values, 1000.0, stated=False) == (
        "10.0% of the depth values are 65535, which is read as unknown",
    )


@pytest.mark.parametrize("scene", ["living-room", "office"])
def test_the_demo_scenes_raise_no_doubt(scene):
    assert load_demo(scene).notes == ()


def test_a_background_at_a_large_distance_is_a_doubt():
    """65504 is the largest number of half precision, which renderers store where nothing is."""
    values = np.full((10, 10), 2.0, np.float32)
    values[:2] = 65504.0
    (note,) = doubts(values, 1.0, stated=False)
    assert note.startswith("20.0% of the depth values are farther than 66 m, up to 6.55e+04 m;")
    assert not doubts(np.where(values > 66.0, np.float32(0.0), values), 1.0, stated=False)


def test_a_background_beyond_all_distances_opens_with_0_in_its_place(tmp_path):
    """Blender stores 1e10 there."""
    values = np.full((10, 10), 2.0, np.float32)
    values[:2] = 1e10
    np.save(tmp_path / "depth.npy", values)
    with pytest.raises(InputError, match=r"20% are beyond 1000 km, as where nothing was seen.*try 0 where"):
        read_depth(tmp_path / "depth.npy")
    np.save(tmp_path / "depth.npy", np.where(values > 1e6, 0.0, values))
    assert read_depth(tmp_path / "depth.npy").valid.mean() == 0.8
