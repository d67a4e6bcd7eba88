"""The order of tiles by what they add to the surface: images of which the right order is known."""

import math

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.delivery.base_points import BaseView
from pipeline.delivery.tiled import own_order
from pipeline.delivery.worth import (
    EDGE_PX,
    LEAST_MISSING_PX,
    added_area_m2,
    order_by_worth,
    order_bytes,
)
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics.pinhole(200.0, 100.0, 63.5, 47.5, 128, 96)
BLOCKS, TILES = (12, 16), (3, 4)
BYTES = np.full(TILES, 200)
OWN = own_order(12)


def view(z_m: np.ndarray) -> BaseView:
    return BaseView(z_m, CAMERA, np.eye(4))


def flat(z_m: float = 2.0) -> np.ndarray:
    return np.full(BLOCKS, z_m)


def test_a_flat_wall_adds_nothing_and_keeps_the_coding_s_order():
    found = order_by_worth(view(flat()), BYTES, OWN)
    assert not found.area_m2.any()
    np.testing.assert_array_equal(found.order, OWN)


def test_a_tile_with_unmeasured_blocks_adds_the_pixels_that_its_bytes_leave_for_them():
    z_m = flat()
    z_m[4:8, 4:6] = np.nan  # half of tile (1, 1): 8 of 16 blocks
    found = added_area_m2(view(z_m), BYTES)
    px_per_byte = 64 * (192 - 8) / (12 * 200)
    beyond_px = 200 * px_per_byte - 64 * 8
    pixel_m2 = 2.0**2 / (200.0 * 100.0)
    assert found[1, 1] == pytest.approx(min(beyond_px, 32 * 8) * pixel_m2)
    small = BYTES.copy()
    small[1, 1] = 10
    assert added_area_m2(view(z_m), small)[1, 1] == pytest.approx(LEAST_MISSING_PX * 8 * pixel_m2)
    assert np.count_nonzero(found) == 1


def test_a_depth_edge_counts_on_both_of_its_sides_and_farther_pixels_are_larger():
    z_m = flat()
    z_m[:, 4:] = 4.0  # the edge is between tile columns 0 and 1
    found = added_area_m2(view(z_m), BYTES)
    pixel_m2 = 1 / (200.0 * 100.0)
    np.testing.assert_allclose(found[:, 0], 4 * EDGE_PX * 2.0**2 * pixel_m2)
    np.testing.assert_allclose(found[:, 1], 4 * EDGE_PX * 4.0**2 * pixel_m2)
    assert not found[:, 2:].any()


def test_of_two_tiles_that_add_as_much_the_shorter_one_is_sent_first():
    z_m, sizes = flat(), BYTES.copy()
    z_m[1, 1] = z_m[5, 1] = np.nan  # one block of the tiles (0, 0) and (1, 0)
    sizes[:2, 0] = 60, 40
    found = order_by_worth(view(z_m), sizes, OWN)
    assert found.area_m2[0, 0] == found.area_m2[1, 0] > 0
    assert found.order[:2].tolist() == [4, 0]


def test_shown_tiles_follow_all_others_and_tiles_without_bytes_are_last():
    z_m, sizes, shown = flat(), BYTES.copy(), np.zeros(TILES, bool)
    z_m[:, 4:] = 4.0
    sizes[2, 1] = 0
    shown[0, 1] = True
    order = order_by_worth(view(z_m), sizes, OWN, shown).order.tolist()
    assert order[0] == 4 + 1  # farther than column 0, not shown, with bytes
    assert set(order[1:4]) == {0, 4, 8}
    assert order[-2:] == [1, 9]
    assert sorted(order) == list(range(12))


def test_without_depth_in_the_base_layer_the_coding_s_order_stays():
    found = order_by_worth(view(np.full(BLOCKS, np.nan)), BYTES, OWN)
    np.testing.assert_array_equal(found.order, OWN)
    assert not found.area_m2.any()


def test_an_order_takes_as_many_bytes_as_there_are_orders():
    assert order_bytes(0) == order_bytes(1) == 0
    for count in (2, 5, 57, 300):
        assert 256 ** (order_bytes(count) - 1) < math.factorial(count) <= 256 ** order_bytes(count)


@pytest.mark.parametrize(
    ("sizes", "own", "shown"),
    [
        (np.ones((2, 4), int), OWN, None),
        (BYTES, OWN[:-1], None),
        (BYTES, OWN, np.zeros((4, 3), bool)),
    ],
)
def test_other_tiles_than_those_of_the_image_are_one_sentence(sizes, own, shown):
    with pytest.raises(InputError, match="tiles"):
        order_by_worth(view(flat()), sizes, own, shown)
