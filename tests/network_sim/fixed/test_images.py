"""Sizes of images are those of the files; books close when nothing is left."""

import cv2
import numpy as np
import pytest
import simpy

from network_sim.fixed.images import Book, Fragments, encoded_bytes, pgm_bytes, ppm_bytes
from network_sim.trace.log import Recorder
from network_sim.types import Cause
from packetmesh.errors import InputError


@pytest.fixture
def color():
    return np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)


@pytest.fixture
def book():
    return Book(simpy.Environment(), Recorder("all", 3), data_bytes=100, header_bytes=8)


def test_the_sizes_of_the_thesis():
    assert ppm_bytes(640, 480) == 921_615
    assert pgm_bytes(640, 480) == 614_417


@pytest.mark.parametrize("suffix", ["ppm", "png"])
def test_a_colour_image_is_as_long_as_its_file(color, suffix, tmp_path):
    file = tmp_path / f"image.{suffix}"
    cv2.imwrite(str(file), color)
    assert encoded_bytes(color, suffix) == file.stat().st_size


@pytest.mark.parametrize("suffix", ["pgm", "png"])
def test_a_depth_image_is_as_long_as_its_file(suffix, tmp_path):
    depth = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64) * 20
    file = tmp_path / f"depth.{suffix}"
    cv2.imwrite(str(file), depth)
    assert encoded_bytes(depth, suffix) == file.stat().st_size


def test_jpeg_is_longer_with_more_quality(color):
    sizes = [encoded_bytes(color, "jpeg", quality) for quality in (10, 50, 95)]
    assert sizes == sorted(set(sizes))


@pytest.mark.parametrize("file_format", ["ppm", "jpeg"])
def test_a_format_that_holds_no_depth_says_so(file_format):
    with pytest.raises(InputError, match=file_format):
        encoded_bytes(np.zeros((4, 4), np.uint16), file_format)


def test_fragments_cover_an_image_without_gap_or_overlap(book):
    image = book.capture(0, 1234)
    packets = [book.fragment(image, index, 0, 2) for index in range(image.count)]
    ends = np.cumsum([packet.byte_count for packet in packets])
    assert [packet.first_byte for packet in packets] == [0, *ends[:-1]]
    assert ends[-1] == 1234
    assert [image.index_of(packet) for packet in packets] == list(range(image.count))
    assert all(packet.size_bytes == packet.byte_count + 8 for packet in packets)
    assert [packet.id for packet in packets] == list(range(image.count))


def test_a_fragment_counts_once():
    fragments = Fragments(3)
    assert [fragments.add(index) for index in (1, 1, 0)] == [True, False, True]
    assert fragments.missing() == [2]
    assert fragments.missing_count == 1


def test_a_book_ends_when_the_last_packet_and_image_have(book):
    image = book.capture(0, 150)
    first, second = (book.fragment(image, index, 0, 2) for index in range(2))
    book.received(first, 2)
    book.close(image, 2)
    assert not book.ended.triggered
    book.dropped(second, 0, Cause.RETRIES)
    assert book.ended.triggered


def test_an_image_that_is_not_sent_again_is_given_up_with_its_last_packet(book):
    image = book.capture(0, 150)
    first, second = (book.fragment(image, index, 0, 2) for index in range(2))
    image.sending_over = True
    book.dropped(first, 0, Cause.CHANNEL)
    assert not image.closed
    book.received(second, 2)
    assert image.closed
