"""Tiles and layers on the scenes that ship: what they cost and what losses leave of them."""

import numpy as np
import pytest

from pipeline.delivery import CODINGS
from pipeline.delivery.coding import Images
from pipeline.io.demos import DEMO_SCENES, load_demo
from tests.pipeline.delivery.losses import bursts
from tests.pipeline.delivery.pictures import received, smooth_images


def images_of(frame) -> Images:
    return Images(
        np.ascontiguousarray(frame.rgb),
        np.rint(np.nan_to_num(frame.depth.z_m, nan=0.0) * 1000).astype(np.uint16),
    )


@pytest.fixture(scope="module")
def room() -> Images:
    return images_of(load_demo("living-room").frames[0])


@pytest.mark.parametrize("scene", DEMO_SCENES)
@pytest.mark.parametrize("packet_bytes", [108, 1464])
def test_layers_take_little_more_than_tiles_and_these_much_less_than_whole_files(scene, packet_bytes):
    images = images_of(load_demo(scene).frames[0])
    whole, tiles, layered = (
        len(CODINGS[name].encode(images, packet_bytes)) for name in ("jpeg", "tiles", "layered")
    )
    assert tiles <= 0.75 * whole
    assert layered <= 1.12 * tiles


@pytest.mark.parametrize("packet_bytes", [108, 1464])
def test_a_tenth_lost_in_bursts_leaves_nearly_everything_known_at_least_coarsely(room, packet_bytes):
    coding = CODINGS["layered"]
    data = coding.encode(room, packet_bytes)
    measured = room.depth > 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        result = received(coding, room, packet_bytes, lambda count, rng=rng: ~bursts(count, 0.1, rng), data)
        assert result.rgb_known.all()
        assert ((result.depth > 0) | (result.coarse > 0))[measured].mean() > 0.985
        assert (result.depth > 0)[measured].mean() > 0.6


def test_a_transfer_that_stops_early_leaves_a_coarse_image_of_everything(room):
    """A twentieth of the frame: a depth that is mostly within a hundredth, and a colour everywhere."""
    result = received(CODINGS["layered"], room, 108, lambda count: np.arange(count) < count / 20)
    both = (room.depth > 0) & (result.coarse > 0)
    assert both.sum() > 0.9 * (room.depth > 0).sum()
    error = np.abs(result.coarse[both].astype(float) - room.depth[both]) / room.depth[both]
    assert np.median(error) < 0.01
    assert np.quantile(error, 0.95) < 0.05
    assert result.rgb_known.all()
    assert np.abs(result.rgb.astype(int) - room.rgb).mean() < 12


@pytest.mark.parametrize("name", ["tiles", "layered"])
def test_a_lost_packet_leaves_all_but_the_tiles_in_it(name, room):
    """Beyond the directory and base any packet can go: two tiles at most, even if it lies across a border."""
    coding = CODINGS[name]
    data = coding.encode(room, 108)
    for lost in (0, 1, 500, 501, 1000, 2000):
        result = received(coding, room, 108, lambda count, lost=lost: np.arange(count) != lost, data)
        gone = (room.depth > 0) & (result.depth == 0)
        tiles = {(row // 32, column // 32) for row, column in np.argwhere(gone)}
        assert len(tiles) <= 2
        np.testing.assert_array_equal(result.depth[~gone], room.depth[~gone])


def test_tiles_that_follow_each_other_are_no_neighbours_in_the_image(room):
    result = received(CODINGS["tiles"], room, 108, lambda count: np.abs(np.arange(count) - 300) > 15)
    gone = np.argwhere((room.depth > 0) & (result.depth == 0)) // 32
    tiles = np.unique(gone, axis=0)
    assert len(tiles) > 5
    apart = np.abs(tiles[:, None] - tiles).max(axis=2)
    assert apart[~np.eye(len(tiles), dtype=bool)].min() > 1


@pytest.mark.parametrize("name", ["tiles", "layered"])
def test_every_color_tile_is_the_one_sent_or_the_base(name, room):
    coding = CODINGS[name]
    data = coding.encode(room, 108)
    whole = received(coding, room, 108, lambda count: np.ones(count, bool), data)
    stopped = received(coding, room, 108, lambda count: np.arange(count) < count / 20, data)
    lost = np.random.default_rng(4)
    result = received(coding, room, 108, lambda count: lost.random(count) >= 0.1, data)
    fell_back = 0
    for row, column in np.ndindex(15, 20):
        tile = np.s_[32 * row : 32 * row + 32, 32 * column : 32 * column + 32]
        if not np.array_equal(result.rgb[tile], whole.rgb[tile]):
            np.testing.assert_array_equal(result.rgb[tile], stopped.rgb[tile])
            fell_back += 1
    assert 30 < fell_back < 200


def test_what_has_arrived_replaces_the_base_holes_included():
    images = smooth_images(96, 96, seed=5, hole_share=0.5)
    result = received(CODINGS["layered"], images, 108, lambda count: np.arange(count) != count // 3)
    np.testing.assert_array_equal(result.coarse[result.depth > 0], 0)
    whole = received(CODINGS["layered"], images, 108, lambda count: np.ones(count, bool))
    assert not whole.coarse.any()
