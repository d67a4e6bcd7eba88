"""A race in the address is the one that was set up, and nothing beyond what the sliders can set."""

from dataclasses import replace

import pytest

from app.screens.fuse.place import FIRST, race_of, race_text
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
    ],
)
def test_what_is_beyond_the_sliders_gets_a_sentence(text):
    with pytest.raises(InputError):
        race_of(text)
