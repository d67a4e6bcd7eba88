"""Which step every lane shows, by iteration and by time, and the curves below."""

from dataclasses import replace

import numpy as np
import pytest

from app.dock.dock import COUNT_NS
from app.screens.fuse.clock import RaceClock
from app.screens.fuse.player import error_lane
from app.screens.fuse.view import REACH_M
from tests.app.screens.fuse.test_numbers import lane

MS = 1_000_000


def racer(errors_m, times_s):
    """A lane with an error and a time for each of its steps."""
    bare = lane("ICP point", None)
    steps = tuple(
        replace(bare.steps[0], point_error_m=error_m, time_s=time_s)
        for error_m, time_s in zip(errors_m, times_s, strict=True)
    )
    return replace(bare, steps=steps)


SHORT = racer([0.08, 0.07, 0.06], [0.0, 0.012, 0.014])
LONG = racer([0.08, 0.04, 0.02, 0.01, 0.002], [0.0, 0.005, 0.010, 0.020, 0.033])


def test_by_iteration_a_lane_that_ended_stays_at_its_end():
    clock = RaceClock.of([SHORT, LONG], in_ms=False)
    assert clock.end_ns == 4 * COUNT_NS
    assert [clock.rows(place * COUNT_NS) for place in range(5)] == [(0, 0), (1, 1), (2, 2), (2, 3), (2, 4)]
    assert clock.rows(2 * COUNT_NS - 1) == (1, 1)


def test_by_time_a_lane_shows_what_it_has_reached():
    clock = RaceClock.of([SHORT, LONG], in_ms=True)
    assert [clock.rows(ms * MS) for ms in (0, 11, 13, 14, 33)] == [(0, 0), (0, 2), (1, 2), (2, 2), (2, 4)]
    assert clock.stops_ns.tolist() == [ms * MS for ms in (0, 5, 10, 12, 14, 20, 33)]


@pytest.mark.parametrize(("in_ms", "unit_ns"), [(False, COUNT_NS), (True, MS)])
def test_a_place_in_a_lesson_counts_iterations_or_milliseconds(in_ms, unit_ns):
    clock = RaceClock.of([SHORT, LONG], in_ms)
    assert clock.at(3) == 3 * unit_ns
    assert clock.at(None) == clock.end_ns
    np.testing.assert_allclose(clock.shown(np.array([2 * unit_ns])), 2.0)


def test_the_curves_tell_the_distance_at_the_clock_and_hide_what_is_to_come():
    clock = RaceClock.of([SHORT, LONG], in_ms=False)
    curves = error_lane("truth", [SHORT, LONG], clock)
    assert curves.veil == 1.0
    said = [label.text for label in curves.labels(3 * COUNT_NS)]
    assert said == ["from the truth", "① 6.00 cm", "② 1.00 cm"]


def test_a_curve_begins_where_the_distance_is_within_reach():
    clock = RaceClock.of([SHORT], in_ms=False)
    gaps_m = (REACH_M, 0.3, 0.1)
    steps = [
        replace(step, point_error_m=None, gap_m=gap_m)
        for step, gap_m in zip(SHORT.steps, gaps_m, strict=True)
    ]
    curves = error_lane("cloud", [replace(SHORT, steps=tuple(steps))], clock)
    said = [curves.labels(row * COUNT_NS)[1].text for row in range(3)]
    assert said == ["① –", "① 30.00 cm", "① 10.00 cm"]
    assert curves.ticks[0].text == "40 cm"
    np.testing.assert_allclose(replace(SHORT, steps=tuple(steps)).offs_cm, [np.nan, 30.0, 10.0])
