"""Names over the cameras of a delivery: none covers another one."""

from itertools import combinations

import numpy as np
import pytest

from app.screens.network.name_lifts import LETTER_PX, LINE_PX, lifts


@pytest.mark.parametrize("seed", range(5))
def test_no_name_covers_another_and_those_with_room_stay(seed):
    rng = np.random.default_rng(seed)
    at_px = rng.uniform(0.0, (300.0, 120.0), (7, 2))
    letters = rng.integers(4, 26, 7)
    up_px = lifts(at_px, letters, fixed=0)
    assert (up_px >= 0.0).all()
    placed = at_px + np.column_stack([np.zeros(7), up_px])
    for one, other in combinations(range(7), 2):
        across, up = np.abs(placed[one] - placed[other])
        assert across >= 0.5 * LETTER_PX * (letters[one] + letters[other]) or up >= LINE_PX - 1e-9


def test_the_first_stay_and_the_others_make_room():
    at_px = np.array([[0.0, 0.0], [5.0, 4.0], [900.0, 4.0]])
    np.testing.assert_allclose(lifts(at_px, np.array([10, 10, 10]), fixed=1), [LINE_PX - 4.0, 0.0])
