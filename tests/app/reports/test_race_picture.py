"""Where the lanes of a race are in the picture: each within its share of the width, none behind a card."""

from itertools import product

import numpy as np
import pytest

from app.screens.fuse.draw import FOOT, HEAD, MARGIN, apart, in_picture

ROOM_M = np.array(list(product((-2.1, 2.1), (-1.3, 1.3), (-2.5, 2.5))))
"""Corners of a room, deep enough that what is near looks much larger than what is far."""


@pytest.mark.parametrize("count", [1, 2, 4])
@pytest.mark.parametrize("aspect", [0.6, 1.3, 2.4])
def test_every_lane_is_seen_whole_and_as_large_as_that_allows(count, aspect):
    band = (HEAD, FOOT)
    apart_m = apart(ROOM_M, count, aspect, band)
    across, down = in_picture(ROOM_M, count, aspect, band, apart_m)
    rooms = [across.min() - MARGIN, 1.0 - MARGIN - across.max(), down.min() - band[0], band[1] - down.max()]
    assert min(rooms) == pytest.approx(0.0, abs=1e-3)
    nearer = in_picture(ROOM_M, count, aspect, band, 0.9 * apart_m)
    assert nearer[0].min() < MARGIN or nearer[1].min() < band[0] or nearer[1].max() > band[1]


def test_the_middle_of_a_lane_is_in_the_middle_of_its_share():
    across, down = in_picture(np.zeros((1, 3)), 4, 1.5, (0.2, 0.6), 3.0)
    np.testing.assert_allclose(across, 0.5)
    np.testing.assert_allclose(down, 0.4)
