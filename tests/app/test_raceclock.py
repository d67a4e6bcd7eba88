"""Which step every lane shows, by iteration and by time."""

import numpy as np
import pytest

from app.screens.fuse.player import MOST_TICKS, RaceClock


def clock(*xs, unit=1, in_ms=False):
    return RaceClock(tuple(np.array(x, dtype=float) for x in xs), unit, in_ms)


def test_by_iteration_a_lane_that_ended_stays_at_its_end():
    race = clock([0, 1, 2], [0, 1, 2, 3, 4])
    assert race.length == 5
    assert [race.rows(place) for place in range(5)] == [(0, 0), (1, 1), (2, 2), (2, 3), (2, 4)]


def test_by_time_a_lane_shows_what_it_has_reached():
    race = clock([0.0, 12.0, 14.0], [0.0, 5.0, 33.0], unit=10, in_ms=True)
    assert race.length == 5
    assert [race.rows(place) for place in range(5)] == [(0, 0), (0, 1), (2, 1), (2, 1), (2, 2)]


@pytest.mark.parametrize("longest_s", [0.004, 0.15, 0.7, 12.0])
def test_the_slider_over_time_has_a_bearable_number_of_places(longest_s):
    class Step:
        def __init__(self, time_s):
            self.time_s = time_s

    class Lane:
        steps = (Step(0.0), Step(longest_s))

    race = RaceClock.of([Lane()], in_ms=True)
    assert 2 <= race.length <= MOST_TICKS + 1
    assert race.rows(race.length - 1) == (1,)


def test_a_lane_without_steps_to_take_has_one_place():
    assert clock([0]).length == 1
