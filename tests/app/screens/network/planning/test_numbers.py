"""Sentences and bars of a plan, with known numbers."""

import re

import numpy as np

from app.drawing.quantities import STANDS_ON
from app.screens.network.planning.labels import MATERIALS, SENSORS, WHERES
from app.screens.network.planning.numbers import delivery_bars, kept_sentence
from app.screens.network.planning.view import Arrival, PromiseView, TakenView
from pipeline.planning.places import WHERES as PLACES
from pipeline.planning.plan import BY_HAND
from pipeline.planning.sensors import sensor_names
from pipeline.planning.walls import DAMPING_DB
from pipeline.sources import RigFolder


def taken(gain, low, high, real, placed=True, dark=0.0):
    return kept_sentence(TakenView(RigFolder("room"), PromiseView(gain, (low, high), dark), real, placed))


def test_the_labels_are_of_what_the_planner_knows():
    assert tuple(SENSORS) == tuple(sensor_names())
    assert tuple(WHERES) == PLACES
    assert tuple(MATERIALS) == tuple(DAMPING_DB)
    assert set(STANDS_ON) == {*PLACES, BY_HAND}


def test_a_promise_is_beside_what_came_of_it_and_inside_or_outside_its_interval():
    assert "Promised 1.8 (0.0 to 4.0) points, really 2.4" in taken(0.018, 0.0, 0.04, 0.024)
    dark = taken(0.018, 0.0, 0.04, 0.001, dark=0.0152)
    assert "points, 1.5 of them on a dark surface that may stay without depth, really 0.1" in dark
    inside = taken(0.018, 0.0, 0.04, 0.024)
    assert "inside the 95 % interval, 0.6 points from the promise" in inside
    assert "wide, 4.0 points" in inside
    for real in (0.041, -0.01):
        assert "the promise was not kept" in taken(0.018, 0.0, 0.04, real)
    assert "did not find the new camera's pose" in taken(0.05, 0.04, 0.06, 0.05, placed=False)


def test_bars_are_as_long_as_the_times_and_share_one_scale():
    bars = delivery_bars([Arrival(1.0, 2.0, 3.0), Arrival(0.5, 0.5, 1.0), Arrival(np.inf, np.inf, 9.0)], 4.0)
    widths = [float(width) for width in re.findall(r"width: ([\d.]+)%", bars)]
    assert np.allclose(np.array(widths) * 4.2 / 100.0, [1.0, 1.0, 0.5, 0.0, 0.0, 0.0], atol=0.01)
    assert "deadline, 4 s" in bars
    assert bars.count("left: 95.2%") == 3
    assert "its image does not arrive" in bars
    assert "deadline" not in delivery_bars([Arrival(1.0, 2.0, 3.0)], None)
