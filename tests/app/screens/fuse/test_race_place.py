"""A race in the address is the one that was set up, and nothing beyond what the sliders can set."""

from dataclasses import replace

import pytest

from app.screens.fuse.place import FIRST, moment_of, moment_text, race_of, race_text
from app.screens.fuse.view import Start
from packetmesh.errors import InputError

RACES = [
    FIRST,
    replace(FIRST, mode="inferred", source=0),
    replace(FIRST, rivals=(("icp", "plane"), ("ceicp-a", "point")), direction="both", seed=7),
    replace(FIRST, start=Start((1.0, -2.5, 0.0), (0.0, 30.0, -4.25)), noise_m=0.02, depth_bias=0.15),
]


@pytest.mark.parametrize("race", RACES)
def test_what_is_written_is_read_back(race):
    assert race_of(race_text(race)) == race


def test_only_what_differs_is_in_it():
    assert race_text(FIRST) == ""
    assert race_text(replace(FIRST, seed=3)) == "seed=3"


@pytest.mark.parametrize(
    "text",
    [
        "seed=99",
        "noise_m=5",
        "noise_m=-1",
        "noise_m=nan",
        "rivals=",
        "rivals=icp",
        "rivals=" + ",".join(["icp-point"] * 5),
        "start.turn_deg=1,2",
        "start.shift_cm=1,2,1e9",
        "source=-1",
        "speed=3",
        "seed",
        "mode=corridor noise_m=0.01",
        "mode=square crop_share=0.2",
    ],
)
def test_what_is_beyond_the_sliders_gets_a_sentence(text):
    with pytest.raises(InputError):
        race_of(text)


@pytest.mark.parametrize(
    ("text", "moment"),
    [("", (0.0, False)), ("12", (12.0, False)), ("3.25ms", (3.25, True)), ("end", (None, False))],
)
def test_a_moment_is_an_iteration_a_time_or_the_end(text, moment):
    assert moment_of(text) == moment
    at, in_ms = moment
    assert moment_text("end" if at is None else f"{at:g}", in_ms) == text


@pytest.mark.parametrize("text", ["-1", "12 ms", "nan", "1e9", "9" * 400, "0." + "1" * 400])
def test_what_is_no_moment_of_a_race_gets_a_sentence(text):
    with pytest.raises(InputError, match="such as 12, a time such as 12ms, or end"):
        moment_of(text)
