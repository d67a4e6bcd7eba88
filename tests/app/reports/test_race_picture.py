"""Where the lanes of a race are in the picture: each within its window, none behind a card."""

from itertools import product

import numpy as np
import pytest

from app.screens.fuse.draw import FOOT, HEAD, MARGIN, height_m, in_window

ROOM_M = np.array(list(product((-2.1, 2.1), (-1.3, 1.3), (-2.5, 2.5))))
"""Corners of a room, deep enough that what is near looks much larger than what is far."""


@pytest.mark.parametrize("count", [1, 2, 4])
@pytest.mark.parametrize("aspect", [0.6, 1.3, 2.4])
def test_every_lane_is_seen_whole_and_as_large_as_that_allows(count, aspect):
    band = (HEAD, FOOT)
    picture_m = height_m(ROOM_M, count, aspect, band)
    across, down = in_window(ROOM_M, count, aspect, band, picture_m)
    rooms = [across.min() - MARGIN, 1.0 - MARGIN - across.max(), down.min() - band[0], band[1] - down.max()]
    assert min(rooms) == pytest.approx(0.0, abs=1e-6)
    nearer = in_window(ROOM_M, count, aspect, band, 0.9 * picture_m)
    assert nearer[0].min() < MARGIN or nearer[1].min() < band[0] or nearer[1].max() > band[1]


def test_the_middle_of_a_lane_is_in_the_middle_of_its_window():
    points_m = np.array([[0.0, 0.0, 0.0], [-0.5, 0.25, 0.0]])  # the other is to the left and higher
    across, down = in_window(points_m, 4, 1.5, (0.2, 0.6), 10.0)
    np.testing.assert_allclose(across, [0.5, 0.5 - 0.5 / (10.0 * 1.5 / 4)])
    np.testing.assert_allclose(down, [0.4, 0.4 - 0.25 / 10.0])
