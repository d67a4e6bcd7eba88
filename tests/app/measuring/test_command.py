"""The commands of a list of measures: each gives the number of the list."""

import json
import shlex

import pytest

from app.compute.measures import Clicked, MeasureRequest, Tape
from app.measuring.address import tape_of
from app.measuring.command import measure_commands
from app.measuring.work import answer
from pipeline.measuring.surface import MEASURING, write_measured
from tests.app import commands
from tests.pipeline.measuring.scenes import box_on_table, measured


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("distance~surface~-200_-100_0~100_100_150", 0),
        ("distance~vertex~0_0_150~300_0_150", 0),
        ("point-plane~edge~0_50_150~-200_-100_0", 0),
        ("plane-plane~surface~100_100_150~-200_-100_0", 0),
        ("angle~surface~-200_-100_0~100_-100_0~-200_300_0", 2),
        ("angle~plane~100_100_150~0_100_70", 0),
        ("box~surface~100_100_150", 2),
        ("box~plane~100_100_150~0_100_70~100_0_70", 2),
    ],
)
def test_a_command_prints_the_number_of_the_list(capsys, tmp_path, text, row):
    """``row``: place of its last number among those that the command prints."""
    surface = measured(box_on_table(), scale_sd=0.002)
    write_measured(tmp_path / MEASURING, surface)
    tape = tape_of(text)
    ((_, made),) = answer([surface], MeasureRequest(tape.taken, Clicked("distance", "surface"))).made
    line = measure_commands(tape, str(tmp_path))
    code, out, err = commands.run(capsys, *shlex.split(line)[1:], "--json")
    assert (code, err) == (0, "")
    one = made.quantities[-1]
    found = json.loads(out)[row]
    assert found["value"] == pytest.approx(one.value, rel=1e-9)
    assert found["ci95"] == pytest.approx([one.low, one.high], rel=1e-9)


def test_each_measure_has_a_line_and_a_hole_its_option():
    tape = tape_of("hole~surface~100_100_0~~distance~surface~0_0_0~1000_0_0")
    first, second = measure_commands(tape, "runs/x").splitlines()
    assert first == "packetmesh measure runs/x --hole 0.100,0.100,0.000"
    assert second == "packetmesh measure runs/x --points 0.000,0.000,0.000 1.000,0.000,0.000"
    assert measure_commands(Tape(), "runs/x") == ""
