"""Tiles and layers on the scenes that ship: what they cost and what losses leave of them."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.delivery import CODINGS, levels, pictures
from pipeline.delivery.coding import Images, areas_of
from pipeline.delivery.tiled import TILE, _sealed
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


@pytest.mark.parametrize("name", ["tiles", "layered", "exact"])
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


@pytest.mark.parametrize("name", ["tiles", "layered", "exact"])
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


@pytest.mark.parametrize("name", ["tiles", "layered", "exact"])
def test_damaged_bytes_of_whole_tiles_cost_these_tiles(name, room):
    """Packets carry a check of their own; this is for what gets past it."""
    coding = CODINGS[name]
    data = np.frombuffer(coding.encode(room, 108), np.uint8)
    everything = np.ones(data.size, bool)
    whole = coding.decode(data, everything, room.depth.shape, 108)
    for place in (108 * 200 + 50, 108 * 400 + 3, data.size - 108 * 200):
        damaged = data.copy()
        damaged[place : place + 4] ^= 0b01011010
        result = coding.decode(damaged, everything, room.depth.shape, 108)
        gone = (room.depth > 0) & (result.depth == 0)
        assert len({(row // 32, column // 32) for row, column in np.argwhere(gone)}) <= 2
        np.testing.assert_array_equal(result.depth[~gone], room.depth[~gone])
        other = np.argwhere((result.rgb != whole.rgb).any(axis=2)) // coding.colors.side_px
        assert len(np.unique(other, axis=0)) <= 2
        assert gone.any() or len(other)


def test_a_tile_in_another_s_place_is_lost(room):
    """Two equal tiles differ in their seals only."""
    coding = CODINGS["tiles"]
    plain = np.zeros_like(room.depth)
    plain[:32, :32] = plain[:32, 32:64] = room.depth[200:232, 300:332]
    data = coding.encode(Images(room.rgb, plain), 108)
    tiles = levels.encode(plain, areas_of(plain.shape, TILE)).tiles
    first, second = (_sealed(tiles[index], index) for index in (0, 1))
    assert first[:-1] == second[:-1]
    assert first != second
    assert data.count(first) == data.count(second) == 1
    swapped = np.frombuffer(data.replace(first, second), np.uint8)
    result = coding.decode(swapped, np.ones(swapped.size, bool), plain.shape, 108)
    assert not result.depth[:32, :32].any()
    np.testing.assert_array_equal(result.depth[:32, 32:64], plain[:32, 32:64])


@pytest.mark.parametrize("name", ["tiles", "exact"])
def test_a_damaged_protected_part_gives_nothing(name, room):
    coding = CODINGS[name]
    data = np.frombuffer(coding.encode(room, 108), np.uint8)
    everything = np.ones(data.size, bool)
    for packet in range(8):
        damaged = data.copy()
        damaged[108 * packet + 60] ^= 4
        result = coding.decode(damaged, everything, room.depth.shape, 108)
        for image in (result.depth, result.coarse, result.rgb, result.rgb_known):
            assert not image.any()


def test_pieces_of_avif_are_the_image_without_what_all_share():
    """The header is the same for all images of one size, and a file with it is what Pillow writes."""
    for seed, shape in enumerate([(1, 1), (5, 3), (31, 64), (64, 64)]):
        rgb = smooth_images(*shape, seed).rgb
        frame = pictures.write_av1(rgb)
        assert pictures._with_av1_header(frame, shape, pictures.AV1_QUALITY) == pictures._write_avif(
            rgb, pictures.AV1_QUALITY
        )
        assert np.abs(pictures.read_av1(frame, shape).astype(int) - rgb).mean() < 4
    with pytest.raises(InputError, match="no AVIF picture"):
        pictures.read_av1(b"nothing of the kind", (64, 64))
