"""Which bytes a pixel hangs on: its own in raw images, all of them in a file."""

import numpy as np
import pytest

from pipeline.delivery import CODINGS
from pipeline.delivery.coding import Images
from pipeline.delivery.raw import tile_after_tile
from tests.pipeline.delivery.pictures import received, smooth_images

RAW = ["raw", "raw-color-first", "raw-rows", "raw-tiles"]


@pytest.mark.parametrize("name", RAW)
def test_a_frame_has_the_bytes_of_its_two_files(name):
    images = Images(np.zeros((480, 640, 3), np.uint8), np.zeros((480, 640), np.uint16))
    assert len(CODINGS[name].encode(images, 108)) == 614_417 + 921_615  # SPEC 6.1


def test_the_files_are_those_that_any_viewer_opens():
    images = Images(np.array([[[1, 2, 3], [4, 5, 6]]], np.uint8), np.array([[0x0102, 0xFFFE]], np.uint16))
    depth, color = b"P5\n2 1\n65535\n\x01\x02\xff\xfe", b"P6\n2 1\n255\n\x01\x02\x03\x04\x05\x06"
    assert CODINGS["raw"].encode(images, 108) == depth + color
    assert CODINGS["raw-color-first"].encode(images, 108) == color + depth


@pytest.mark.parametrize("name", RAW)
@pytest.mark.parametrize("loss", range(0, 100, 7))
def test_a_lost_byte_loses_its_pixel_and_no_other(name, loss):
    images = Images(np.full((4, 5, 3), 7, np.uint8), np.full((4, 5), 300, np.uint16))
    size = len(CODINGS[name].encode(images, 1))
    result = received(CODINGS[name], images, 1, lambda count: np.arange(count) != loss * size // 100)
    known = np.count_nonzero(result.depth) + np.count_nonzero(result.rgb_known)
    assert known in (39, 40)  # 40 where the byte is one of a header


def known_rows(name, share):
    images = Images(np.ones((64, 20, 3), np.uint8), np.ones((64, 20), np.uint16))
    result = received(CODINGS[name], images, 8, lambda count: np.arange(count) < share * count)
    return (result.depth > 0).all(axis=1)


def test_spread_rows_cover_the_image_evenly_when_a_transfer_stops():
    """Depth is two fifths of the bytes: at a fifth of all, half of the rows are there, every second one."""
    gaps = np.diff(np.flatnonzero(known_rows("raw-rows", 0.205)))
    assert gaps.max() <= 2
    assert not known_rows("raw", 0.205)[40:].any()


def test_rows_sent_after_each_other_lie_far_apart():
    images = Images(np.ones((64, 20, 3), np.uint8), np.ones((64, 20), np.uint16))
    header = len(b"P5\n20 64\n65535\n")

    def burst(count):
        return (np.arange(count) < header + 400) | (np.arange(count) >= header + 560)  # four rows of 40 bytes

    lost = np.flatnonzero((received(CODINGS["raw-rows"], images, 1, burst).depth == 0).all(axis=1))
    assert lost.size == 4
    assert np.diff(lost).min() >= 8


def test_a_stop_leaves_whole_tiles():
    images = Images(np.ones((40, 40, 3), np.uint8), np.ones((40, 40), np.uint16))
    header = len(b"P5\n40 40\n65535\n")
    result = received(
        CODINGS["raw-tiles"], images, 1, lambda count: np.arange(count) < header + 2 * (2 * 16 * 16)
    )
    expected = np.zeros((40, 40), bool)
    expected[:16, :32] = True
    np.testing.assert_array_equal(result.depth > 0, expected)


@pytest.mark.parametrize("name", ["png", "jpeg", "rvl"])
def test_each_file_stands_by_itself_and_one_lost_packet_loses_it(name):
    images = smooth_images(60, 80, seed=1)
    coding = CODINGS[name]
    stream = coding.encode(images, 40)
    depth_packets = (4 + int.from_bytes(stream[:4], "big")) // 40

    def without(index):
        return lambda count: np.arange(count) != index % count

    head = received(coding, images, 40, without(0), stream)
    assert not head.depth.any()
    assert head.rgb_known.all()
    middle = received(coding, images, 40, without(depth_packets // 2), stream)
    assert not middle.depth.any()
    assert middle.rgb_known.all()
    tail = received(coding, images, 40, without(-1), stream)
    np.testing.assert_array_equal(tail.depth, images.depth)
    assert not tail.rgb_known.any()


def test_tiles_of_16_pixels_follow_each_other_along_a_row():
    order = tile_after_tile((20, 40))  # two rows of three tiles, the last ones 8 pixels wide or 4 high
    assert order[[0, 16, 256, 512, 640]].tolist() == [0, 40, 16, 32, 16 * 40]
    assert sorted(order) == list(range(800))
