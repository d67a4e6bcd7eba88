"""What holds for every coding: what it says of an image is true, whatever was lost."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.delivery import CODINGS
from tests.pipeline.delivery.pictures import IMAGES, PACKET_BYTES, received, smooth_images

LOSSLESS_COLOR = {"raw", "raw-color-first", "raw-rows", "raw-tiles", "png", "rvl"}
every_coding = pytest.mark.parametrize("coding", CODINGS.values(), ids=CODINGS.keys())
few = settings(max_examples=25)


def everything(count):
    return np.ones(count, bool)


def nothing(count):
    return np.zeros(count, bool)


@every_coding
@few
@given(images=IMAGES, packet_bytes=PACKET_BYTES)
def test_all_packets_give_the_depth_exactly_and_the_color_everywhere(coding, images, packet_bytes):
    result = received(coding, images, packet_bytes, everything)
    np.testing.assert_array_equal(result.depth, images.depth)
    assert not result.coarse.any()
    assert result.rgb_known.all()
    if coding.name in LOSSLESS_COLOR:
        np.testing.assert_array_equal(result.rgb, images.rgb)


@pytest.mark.parametrize("name", sorted(CODINGS.keys() - LOSSLESS_COLOR))
def test_jpeg_colors_are_near_those_sent(name):
    images = smooth_images(130, 170, seed=3)
    result = received(CODINGS[name], images, 108, everything)
    error = np.abs(result.rgb.astype(int) - images.rgb)
    assert error.mean() < 2
    assert error.max() < 40


@every_coding
@few
@given(images=IMAGES, packet_bytes=PACKET_BYTES)
def test_no_packet_gives_nothing(coding, images, packet_bytes):
    result = received(coding, images, packet_bytes, nothing)
    for image in (result.depth, result.coarse, result.rgb, result.rgb_known):
        assert not image.any()


@every_coding
@few
@given(
    images=IMAGES,
    packet_bytes=PACKET_BYTES,
    shares=st.tuples(st.floats(0, 1), st.floats(0, 1)),
    seed=st.integers(0, 2**32 - 1),
)
def test_what_is_known_is_true_and_more_packets_know_no_less(coding, images, packet_bytes, shares, seed):
    data = coding.encode(images, packet_bytes)

    def with_losses_below(share):
        return lambda count: np.random.default_rng(seed).random(count) >= share

    fewer, more = (
        received(coding, images, packet_bytes, with_losses_below(share), data)
        for share in sorted(shares, reverse=True)
    )
    for result in (fewer, more):
        measured = result.depth > 0
        np.testing.assert_array_equal(result.depth[measured], images.depth[measured])
        assert not result.coarse[measured].any()
        assert not result.rgb[~result.rgb_known].any()
        if coding.name in LOSSLESS_COLOR:
            np.testing.assert_array_equal(result.rgb[result.rgb_known], images.rgb[result.rgb_known])
    assert (more.depth[fewer.depth > 0] > 0).all()
    assert more.rgb_known[fewer.rgb_known].all()
    known = (fewer.depth > 0) | (fewer.coarse > 0)
    assert ((more.depth > 0) | (more.coarse > 0))[known & (images.depth > 0)].all()


@every_coding
@few
@given(images=IMAGES, packet_bytes=PACKET_BYTES)
def test_the_same_images_give_the_same_packets(coding, images, packet_bytes):
    """So that a packet can be sent again."""
    assert coding.encode(images, packet_bytes) == coding.encode(images, packet_bytes)


def test_names_are_keys_and_titles_differ():
    assert all(coding.name == name for name, coding in CODINGS.items())
    assert len({coding.title for coding in CODINGS.values()}) == len(CODINGS)


def test_a_list_of_codings_needs_no_large_library():
    code = "import sys, pipeline.delivery; print({'cv2', 'numba', 'scipy', 'open3d'} & sys.modules.keys())"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"
