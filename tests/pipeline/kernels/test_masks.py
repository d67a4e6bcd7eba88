"""Pixels that have arrived, and colours for those that have not."""

import numpy as np

from pipeline.kernels.masks import near, nearest_colors


def test_known_pixels_keep_their_colour_and_others_take_that_of_the_nearest():
    rgb = np.zeros((5, 9, 3), np.uint8)
    rgb[2, 1], rgb[2, 7] = (200, 10, 10), (10, 10, 200)
    known = np.zeros((5, 9), bool)
    known[2, 1] = known[2, 7] = True
    filled = nearest_colors(rgb, known)
    assert (filled[:, :4] == (200, 10, 10)).all()
    assert (filled[:, 5:] == (10, 10, 200)).all()


def test_nothing_known_stays_black():
    rgb = np.zeros((4, 4, 3), np.uint8)
    assert not nearest_colors(rgb, np.zeros((4, 4), bool)).any()


def test_all_known_is_unchanged():
    rgb = np.random.default_rng(0).integers(0, 255, (6, 7, 3), np.uint8)
    assert np.array_equal(nearest_colors(rgb, np.ones((6, 7), bool)), rgb)


def test_near_grows_a_disc():
    known = np.zeros((41, 41), bool)
    known[20, 20] = True
    grown = near(known, 8.0)
    rows, columns = np.nonzero(grown)
    assert np.hypot(rows - 20, columns - 20).max() <= 8.5
    assert abs(grown.sum() - np.pi * 64) < 20
