"""The coarse likeness: medians of blocks, blended only along a surface."""

import numpy as np
import pytest

from pipeline.delivery import coarse


def again(depth: np.ndarray) -> np.ndarray:
    return coarse.read_depth(coarse.write_depth(depth), depth.shape)


def test_between_two_surfaces_it_puts_nothing():
    depth = np.full((64, 64), 1000, np.uint16)
    depth[:, 30:] = 2000
    assert set(np.unique(again(depth))) == {1000, 2000}


def test_where_most_of_a_block_has_no_depth_it_has_none():
    depth = np.full((32, 32), 1500, np.uint16)
    depth[:8, :8] = 0
    depth[0, :8] = 1400
    depth[8:16, :3] = 0
    expected = np.full((32, 32), 1500)
    expected[:8, :8] = 0
    np.testing.assert_array_equal(again(depth), expected)


@pytest.mark.parametrize("shape", [(1, 1), (8, 8), (9, 17), (61, 83)])
def test_a_slanted_plane_comes_back_between_its_blocks_centres(shape):
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    depth = (2000 + 4 * rows + 3 * columns).astype(np.uint16)
    error = np.abs(again(depth).astype(int) - depth)
    # A median is near the block's middle; beyond the outermost centres the plane is not continued.
    assert error[4:-11, 4:-11].max(initial=0) <= 4
    assert error.max() <= 7 * (4 + 3)


def test_one_odd_value_in_a_block_does_not_matter():
    depth = np.full((24, 24), 3000, np.uint16)
    depth[::8, ::8] = 60000
    np.testing.assert_array_equal(again(depth), 3000)


def test_it_fits_an_image_of_any_size():
    rgb = np.full((45, 67, 3), (200, 30, 90), np.uint8)
    small = coarse.read_color(coarse.write_color(rgb), (45, 67))
    assert small.shape == rgb.shape
    assert np.abs(small.astype(int) - rgb).max() <= 6
