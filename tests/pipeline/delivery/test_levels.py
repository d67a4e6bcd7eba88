"""Depth as levels in tiles: exact for any image, right up to a cut, and small on the scenes that ship."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from packetmesh.errors import InputError
from pipeline.delivery import levels, rvl
from pipeline.delivery.coding import areas_of
from pipeline.delivery.tile_model import _activity, _at, _context, _mask_slot, _predict
from pipeline.delivery.tiled import TILE
from tests.pipeline.delivery.pictures import IMAGES, noise_images, smooth_images

ODD = [
    np.zeros((40, 50), np.uint16),
    np.full((33, 65), 65_535, np.uint16),
    np.ones((1, 1), np.uint16),
    np.arange(1, 1 + 256 * 256, dtype=np.uint32).astype(np.uint16).reshape(256, 256),
    np.arange(65_536).astype(np.uint16).reshape(512, 128),
    np.where(np.indices((64, 64)).sum(axis=0) % 2, 65_535, 1).astype(np.uint16),
    np.random.default_rng(0).permutation(65_536).astype(np.uint16).reshape(256, 256),
]


def decoded(coded, shape):
    """The image, from its header and tiles."""
    found, result = levels.read_header(coded.header), np.zeros(shape, np.uint16)
    for area, stream in zip(areas_of(shape, TILE), coded.tiles, strict=True):
        if stream:
            tile = levels.decode_tile(np.frombuffer(stream, np.uint8), found, result[area].shape)
            result[area] = tile.reshape(result[area].shape)
    return result


def encoded(depth):
    return levels.encode(depth, areas_of(depth.shape, TILE))


@pytest.mark.parametrize("depth", ODD, ids=range(len(ODD)))
def test_odd_images_come_back_to_the_bit(depth):
    np.testing.assert_array_equal(decoded(encoded(depth), depth.shape), depth)


@settings(max_examples=40)
@given(IMAGES)
def test_any_image_comes_back_to_the_bit(images):
    np.testing.assert_array_equal(decoded(encoded(images.depth), images.depth.shape), images.depth)


@settings(max_examples=40)
@given(IMAGES.filter(lambda images: images.depth.any()), st.data())
def test_a_cut_tile_gives_its_first_pixels_and_more_bytes_no_fewer(images, data):
    coded = encoded(images.depth)
    found = levels.read_header(coded.header)
    place = data.draw(st.sampled_from([place for place, tile in enumerate(coded.tiles) if tile]))
    area = areas_of(images.depth.shape, TILE)[place]
    sent, stream = images.depth[area], np.frombuffer(coded.tiles[place], np.uint8)
    cut = data.draw(st.integers(0, stream.size))
    counts = []
    for size in (cut, stream.size):
        values = levels.decode_tile(stream[:size], found, sent.shape)
        np.testing.assert_array_equal(values, sent.ravel()[: values.size])
        counts.append(values.size)
    assert counts[0] <= counts[1] == sent.size


@given(st.binary(min_size=1, max_size=80))
def test_any_bytes_are_read_or_refused(junk):
    coded = encoded(smooth_images(40, 40, seed=1).depth)
    found = levels.read_header(coded.header)
    with suppress(InputError):
        assert levels.decode_tile(np.frombuffer(junk, np.uint8), found, (32, 32)).size <= 32 * 32


def test_a_level_beyond_the_list_is_refused():
    many, few = (encoded(smooth_images(32, 32, seed).depth) for seed in (1, 2))
    listed = levels.read_header(few.header)
    short = levels.Levels(listed.table, listed.values[:3])
    with pytest.raises(InputError, match="no tile of depths"):
        levels.decode_tile(np.frombuffer(many.tiles[0], np.uint8), short, (32, 32))


def test_another_version_is_named_and_what_is_no_header_refused():
    header = encoded(smooth_images(40, 40, seed=1).depth).header
    with pytest.raises(InputError, match=r"version 2 of its tables, and this program has version 1"):
        levels.read_header(bytes([2]) + header[1:])
    with pytest.raises(InputError, match="version 0"):
        levels.read_header(bytes([0]) + header[1:])
    with pytest.raises(InputError, match="version 2"):
        levels.read_header(bytes([2, 9]))  # which may have more tables, and another form
    for junk in (b"", header[:3], header[:1] + b"\x07" + header[2:], header[:6]):
        with pytest.raises(InputError, match="no list of"):
            levels.read_header(junk)


@pytest.mark.parametrize(
    ("rows", "prediction", "activity"),
    [
        # Corner, above and right, then left: a plane goes on.
        ([[5, 7, 9], [4, 0, 0]], 6, 4),
        ([[5, 5, 5], [9, 0, 0]], 9, 4),  # an edge between the rows: the larger of left and above
        ([[9, 5, 5], [6, 0, 0]], 5, 5),  # the corner is above both: the smaller
        ([[0, 4, 4], [9, 0, 0]], 6, 6),  # no corner: the mean, rounded down
        ([[3, 0, 4], [0, 0, 0]], 3, 10),  # corner before right
        ([[0, 0, 4], [0, 0, 0]], 4, 10),
        ([[0, 0, 0], [0, 0, 0]], 2, 10),  # the last one measured
    ],
)
def test_predictions_worked_out_by_hand(rows, prediction, activity):
    assert _predict(np.array(rows, np.int32), 1, 1, 2) == (prediction, activity)


def test_without_a_measured_pixel_there_is_no_prediction():
    assert _predict(np.zeros((2, 3), np.int32), 1, 1, 0)[0] == 0


def test_classes_of_activity_grow_to_nine():
    classes = [_activity(size) for size in range(200)]
    assert classes == sorted(classes)
    assert classes[:6] == [0, 1, 2, 3, 4, 4]
    assert set(classes) == set(range(10))


def test_mask_slots_are_the_neighbours_as_a_number():
    tile = np.array([[0, 0, 1, 0], [0, 1, 0, 1], [1, 1, 0, 0]], np.int32)
    assert _mask_slot(tile, 2, 2) == 1 + 4 + 8 + 16 + 32  # left, corner, right, far left, far above
    assert _mask_slot(tile, 2, 1) == 1 + 2 + 16  # beyond the tile the near one counts for the far one
    assert _mask_slot(tile, 0, 0) == 0


def test_contexts_differ_by_mean_and_trend():
    flat = np.array([[5, 5, 5, 5], [5, 5, 0, 0]], np.int32)
    rising = np.array([[5, 5, 5, 5], [4, 5, 0, 0]], np.int32)
    above = np.array([[5, 5, 9, 9], [5, 5, 0, 0]], np.int32)
    numbers = {_context(tile, 1, 2, 5, 0) for tile in (flat, rising, above)}
    assert len(numbers) == 3
    assert _at(flat, 1, -1) == _at(flat, -1, 0) == _at(flat, 0, 4) == 0


def test_noise_of_any_size_reaches_most_contexts_and_none_beyond():
    rng = np.random.default_rng(0)
    found = set()
    for spread in (1, 2, 4, 8, 16, 40, 120):
        for _ in range(200):
            tile = 500 + rng.integers(-spread, spread + 1, (2, 4)).astype(np.int32)
            tile[rng.random((2, 4)) < 0.1] = 0
            prediction, activity = _predict(tile, 1, 2, 500)
            found.add(_context(tile, 1, 2, prediction, activity))
    assert min(found) >= 0
    assert max(found) < 11 * 7 * 3
    assert len(found) > 150


def test_the_table_is_chosen_though_the_left_column_is_empty():
    """Of an image 512 pixels wide every sixteenth tile lies in one column."""
    rng = np.random.default_rng(2)
    depth = (
        1000 + np.add.outer(3 * np.arange(128), np.arange(512)) + rng.integers(-9, 10, (128, 512))
    ).astype(np.uint16)
    whole = encoded(depth)
    depth[:, :32] = 0
    assert encoded(depth).header[1] == whole.header[1] == 1


@pytest.mark.parametrize("scene", ["living-room", "office", "workshop", "box-on-table"])
def test_a_depth_image_of_few_levels_takes_three_tenths_of_rvl(scene):
    from pipeline.delivery.sink import images_of
    from pipeline.io.demos import load_demo

    for frame in load_demo(scene).frames:
        depth = images_of(frame).depth
        coded = encoded(depth)
        size = len(coded.header) + sum(map(len, coded.tiles))
        assert size < 0.3 * len(rvl.encode(depth))


def test_noise_takes_little_more_than_its_bits():
    depth = noise_images(64, 64, seed=1).depth
    coded = encoded(depth)
    size = len(coded.header) + sum(map(len, coded.tiles))
    assert size < 1.2 * (64 * 64 / 8 + 2 * np.count_nonzero(depth))
