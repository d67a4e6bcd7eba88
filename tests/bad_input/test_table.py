"""The table, case by case: one sentence from the reader and from the command, and nothing else."""

import dataclasses
import warnings
import zlib

import numpy as np
import pytest

from app.cli import main
from packetmesh.errors import MOST_LETTERS, PacketMeshError
from packetmesh.memory import at_most_further
from pipeline.types import PointCloud
from tests.bad_input.cases import cases
from tests.bad_input.samples import make_beside, samples

pytestmark = [
    pytest.mark.timeout(60),
    pytest.mark.filterwarnings("ignore"),  # of decoders, on what is damaged
]
MOST_BYTES = 2 << 30
LEAST_CASES = 1300
EVERY = 4
"""Of so many cases one goes through the command, too."""


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bad")
    make_beside(folder)
    return folder


@pytest.fixture(autouse=True)
def _impatient(monkeypatch):
    monkeypatch.setattr("pipeline.depth.sessions.MOST_SECONDS", 1.0)


def everything_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def numbers_of(value):
    """What was read, as arrays."""
    if dataclasses.is_dataclass(value):
        return [
            part for field in dataclasses.fields(value) for part in numbers_of(getattr(value, field.name))
        ]
    if isinstance(value, dict | tuple | list):
        items = value.values() if isinstance(value, dict) else value
        return [part for item in items for part in numbers_of(item)]
    return [] if value is None or isinstance(value, str) else [np.asarray(value)]


def same(one, other):
    """Whether two readings are of the same numbers."""
    pairs = list(zip(numbers_of(one), numbers_of(other), strict=False))
    return len(numbers_of(one)) == len(numbers_of(other)) and all(
        a.dtype.kind in "OU" or (a.shape == b.shape and np.array_equal(a, b, equal_nan=True))
        for a, b in pairs
    )


def read(sample, data, path):
    """What the reader makes of data, or its sentence."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    with warnings.catch_warnings(), at_most_further(MOST_BYTES):
        warnings.simplefilter("ignore")
        try:
            return sample.read(path), None
        except PacketMeshError as error:
            return None, str(error)


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.name)
def test_a_bad_file_is_one_sentence_and_leaves_nothing(case, beside, capsys):
    path = beside / case.sample.name
    value, said = read(case.sample, case.data(), path)
    if said is None:
        whole, _ = read(case.sample, case.sample.data, path)
        assert same(value, whole) or case.may_open
        if case.cut and isinstance(value, PointCloud):
            whole_lines = len(value) - 1
            np.testing.assert_array_equal(value.points_m[:whole_lines], whole.points_m[:whole_lines])
        path.unlink()
        return
    assert said == " ".join(said.splitlines())
    assert len(said) <= MOST_LETTERS + 3
    assert path.name in said
    if case.sample.command and zlib.crc32(case.name.encode()) % EVERY == 0:
        check_command(case, path, beside, capsys)
    path.unlink()


def check_command(case, path, beside, capsys):
    """The command says the same, and writes nothing."""
    before = everything_in(beside)
    places = {"FILE": str(path), "DIR": str(beside), "OUT": str(beside / "out")}
    words = [
        places.get(word) or word.replace("DIR", places["DIR"]).replace("OUT", places["OUT"])
        for word in case.sample.command.split()
    ]
    with at_most_further(MOST_BYTES), pytest.raises(SystemExit) as stop:
        main(words)
    out, err = capsys.readouterr()
    assert stop.value.code == 1
    assert out == ""
    assert err.splitlines()[-1].startswith("packetmesh: ")
    assert "Traceback" not in err
    assert everything_in(beside) == before


@pytest.mark.parametrize("sample", samples(), ids=lambda sample: sample.name)
def test_the_good_file_opens(sample, tmp_path):
    make_beside(tmp_path)
    _, said = read(sample, sample.data, tmp_path / sample.name)
    assert said is None


def test_the_table_is_as_long_as_the_documentation_says():
    assert len(cases()) >= LEAST_CASES
