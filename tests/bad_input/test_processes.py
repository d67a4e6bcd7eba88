"""A few of the cases through a real command, in a process that may take no more than 2 GB."""

import resource
import subprocess
import sys

import pytest

from tests.bad_input.cases import cases
from tests.bad_input.samples import make_beside

CHOSEN = (
    "little.ply: 1000000000000 points",
    "a.npz: a bomb",
    "color.png: 30,000 x 30,000",
    "config.json: objects 10000 deep",
    "a.onnx: 100 GB at once",
    "a.mcap: 5 tenths of it",
)
MOST_BYTES = 2 << 30


def smaller():
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))


@pytest.mark.timeout(240)
@pytest.mark.parametrize(
    "case", [case for case in cases() if case.name in CHOSEN], ids=lambda case: case.name
)
def test_a_command_says_one_sentence_and_leaves_nothing(case, tmp_path):
    make_beside(tmp_path)
    path = tmp_path / case.sample.name
    path.write_bytes(case.data())
    before = sorted(tmp_path.rglob("*"))
    words = [
        word.replace("FILE", str(path)).replace("DIR", str(tmp_path)).replace("OUT", str(tmp_path / "out"))
        for word in case.sample.command.split()
    ]
    done = subprocess.run(
        [sys.executable, "-m", "app.cli", *words], capture_output=True, text=True, preexec_fn=smaller
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert path.name in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


def test_all_that_are_chosen_are_in_the_table():
    assert len(CHOSEN) == sum(case.name in CHOSEN for case in cases())
