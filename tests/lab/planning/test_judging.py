"""Promises of suggested cameras against what came of them."""

import xml.etree.ElementTree as ElementTree
from dataclasses import asdict, replace

import numpy as np
import pytest

from lab.planning.judging import Suggested, ranked
from lab.planning.measures import measures
from lab.results.planning import PICTURE, pictures, planning
from pipeline.planning.plan import Candidates

ONE = Suggested(7, 0, "walls", 4.0, 2.0, 6.0, 3.0, True, 0.5, 0.9, 1.0)


def rows(*changes):
    return [asdict(replace(ONE, **change)) for change in changes]


def test_the_measures_are_those_of_a_worked_example():
    suggestions = rows(
        {},  # promised 4, real 3
        {"rank": 1, "promised": 2.0, "low": 1.0, "high": 3.0, "real": 0.0},
        {"room": 8, "promised": 1.0, "low": 0.0, "high": 2.0, "real": 2.0, "searched": 0.6},
        {"room": 8, "rank": 1, "promised": 0.5, "low": 0.0, "high": 1.5, "real": 2.5, "placed": False},
    )
    found = measures(suggestions)
    assert found["rooms"] == 2
    assert found["mean_absolute_error_points"] == pytest.approx((1 + 2 + 1 + 2) / 4)
    assert found["mean_error_points"] == pytest.approx((1 + 2 - 1 - 2) / 4)
    assert found["inside_interval"] == 0.5
    assert found["placed"] == 0.75
    assert found["rooms_best_above"] == 1
    assert found["best_real_points"] == 2.5
    assert found["share_of_search"] == pytest.approx((0.9 + 0.6) / 2)
    assert found["rank_correlation_in_room"] == pytest.approx(0.0), "one room agrees, one is reversed"
    assert -1.0 <= found["rank_correlation"] <= 1.0


def test_the_picture_has_real_above_promised_and_colours_what_is_outside_its_interval():
    kept, missed = rows({}, {"rank": 1, "promised": 8.0, "low": 7.0, "high": 9.0, "real": -1.0})
    drawn = ElementTree.fromstring(pictures({"gains": [kept, missed]})[PICTURE])
    circles = [one.attrib for one in drawn.iter() if one.tag.endswith("circle")]
    far, near = circles[:2]
    assert float(near["cx"]) < float(far["cx"])
    assert float(near["cy"]) < float(far["cy"])
    assert near["fill"] == near["stroke"] != far["stroke"]
    assert far["fill"] == "none"


def test_the_page_shows_goal_beside_value():
    text = planning(measures(rows({}, {"rank": 1, "promised": 1.0, "real": 1.0})))
    assert "rendered rooms" in text
    assert "| .85" in text
    assert "Claim D12 does not hold: of 2 suggestions in 1 rooms" in text


def test_only_candidates_that_can_be_registered_are_ranked():
    chance = np.array([[0.1, 0.1], [0.9, 0.9], [0.5, 0.4]], np.float32)
    judged = Candidates((), chance, np.array([0.5, 0.1, 0.5]), np.array([True, False, True]))
    assert ranked(judged).tolist() == [2, 0]
