"""RVL against the encoder of the paper, a stream worked out by hand, and damage."""

import numpy as np
import pytest

from pipeline.importing.rvl import decode_rvl
from tests.pipeline.importing.bags import encode_rvl


def test_a_stream_worked_out_by_hand():
    # two zeros, three values 5, 6, 4: differences +5, +1, -2 folded to 10, 2, 3; 10 takes two nibbles
    word = 0x2_3_A_1_2_3_00  # 2 | 3 | 10 = 0b1_010 -> 8+2, 1 | 2 | 3
    image = decode_rvl(word.to_bytes(4, "little"), 5, 1)
    np.testing.assert_array_equal(image, [[0, 0, 5, 6, 4]])


@pytest.mark.parametrize("zeros", [0.0, 0.2, 0.9, 1.0])
def test_what_the_papers_encoder_wrote_comes_back(zeros):
    rng = np.random.default_rng(5)
    depth = rng.integers(1, 65535, (24, 31)).astype(np.uint16)
    depth[rng.random(depth.shape) < zeros] = 0
    np.testing.assert_array_equal(decode_rvl(encode_rvl(depth.ravel()), 31, 24), depth)


def test_a_smooth_image_takes_a_third_of_its_bytes():
    depth = (1500 + np.add.outer(np.arange(60), np.arange(80))).astype(np.uint16)
    data = encode_rvl(depth.ravel())
    assert len(data) < depth.nbytes / 3
    np.testing.assert_array_equal(decode_rvl(data, 80, 60), depth)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_data_that_end_too_soon_are_refused(share):
    data = encode_rvl(np.arange(1, 2001, dtype=np.uint16))
    with pytest.raises(ValueError, match="too soon"):
        decode_rvl(data[: int(share * len(data))], 100, 20)


@pytest.mark.parametrize(("width", "height"), [(0, 5), (5, 0), (10**6, 10**6)])
def test_sizes_that_cannot_be_are_refused(width, height):
    with pytest.raises(ValueError, match="pixels"):
        decode_rvl(bytes(40), width, height)


def test_noise_never_reads_or_writes_outside():
    rng = np.random.default_rng(1)
    for _ in range(200):
        try:
            image = decode_rvl(rng.bytes(64), 20, 10)
        except ValueError:
            continue
        assert image.shape == (10, 20)
