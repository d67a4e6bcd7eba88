"""The sentences on how far intervals hold, beside the record that they are from."""

import json
from pathlib import Path

import pytest

from pipeline.measuring.values import HELD, HELD_IN_SHORT

RECORD = Path(__file__).parents[3] / "docs" / "results" / "bench_measuring.json"


@pytest.fixture(scope="module")
def runs():
    return json.loads(RECORD.read_text())["numbers"]["measuring"]["runs"]


@pytest.mark.parametrize("sentence", [HELD, HELD_IN_SHORT])
def test_what_is_hardly_judged_is_said_with_its_numbers(runs, sentence):
    (boxes,) = (run for run in runs if run["kind"] == "box")
    held = round(boxes["coverage"] * boxes["measures"])
    assert f"only {boxes['measures']} sides" in sentence
    assert f"({held} held)" in sentence
    assert f"{sum(run['measures'] for run in runs if run['kind'] == 'hole')} holes (all held)" in sentence
    (guessed,) = (run for run in runs if run["kind"] == "distance" and run["guessed"])
    assert f"{guessed['error_over_raw']:.1f} times" in sentence


def test_the_short_range_is_that_of_lengths_and_angles(runs):
    kinds = ("distance", "point-plane", "angle", "corner")
    shares = [100.0 * run["coverage"] for run in runs if run["kind"] in kinds]
    assert f"{min(shares):.0f} to {max(shares):.0f} %" in HELD_IN_SHORT
