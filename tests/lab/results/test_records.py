"""Records of results: what they hold, how they are made, and what is refused."""

import json
import re
import socket
import subprocess
from collections import Counter
from dataclasses import asdict
from datetime import date
from itertools import chain

import pytest

from lab.benchmarks import CASES
from lab.claims.registry import CLAIMS
from lab.results import measure, planning
from lab.results.pages import SECTIONS
from lab.results.record import FOLDER, committed_code, new_record, read_records, rounded, write_record
from packetmesh.errors import InputError

COMMITTED = read_records()
LIBRARIES = {"python", "numpy", "scipy", "numba", "opencv-python-headless", "onnxruntime", "simpy", "viser"}


@pytest.mark.parametrize("name", COMMITTED)
def test_a_committed_record_says_what_ran_when_and_where(name):
    record = COMMITTED[name]
    assert name in measure.RECORDS
    assert record.command.split()[0] in {"packetmesh", "python", "make"}
    assert re.fullmatch(r"[0-9a-f]{7,40}", record.commit)
    assert date.fromisoformat(record.date) <= date.today()
    assert set(record.versions) >= LIBRARIES
    assert {"open3d", "open3d-cpu"} & set(record.versions)
    assert re.fullmatch(r"\d+ \S+ cores, \d+ GiB of memory, (no|an NVIDIA) GPU", record.machine)
    assert record.numbers
    written = (FOLDER / f"{name}.json").read_text()
    assert not re.search(r'[ "]/\w', written)  # no path of one machine
    assert socket.gethostname() not in written


def test_every_claim_and_every_benchmark_belongs_to_one_record():
    words = [
        command
        for command in measure.COMMANDS.values()
        if command[0] == "packetmesh" and "--problems" not in command
    ]
    only = {program: [list(w[3:]) for w in words if w[1] == program] for program in ("reproduce", "bench")}
    claims = Counter(claim for (names,) in only["reproduce"] for claim in names.split(","))
    assert claims + Counter([*planning.JUDGES]) == Counter(list(CLAIMS))
    assert Counter(chain(*only["bench"])) == Counter({case.partition(":")[0] for case in CASES})


def test_every_record_has_a_section():
    assert set(SECTIONS) == set(measure.RECORDS)


def test_a_record_is_read_back_as_it_was_written(tmp_path):
    record = new_record(
        "tiny", "packetmesh doctor", "abc1234", {"share": 0.12345678, "list": [1, None, "2 %"]}
    )
    path = write_record(record, tmp_path)
    assert set(json.loads(path.read_text())) == set(asdict(record)) - {"name"}
    assert read_records(tmp_path) == {"tiny": record}
    assert record.numbers["share"] == 0.123457


@pytest.mark.parametrize("content", ["{", "[]", '{"command": "x"}'])
def test_a_file_that_is_no_record_is_named(tmp_path, content):
    (tmp_path / "half.json").write_text(content)
    with pytest.raises(InputError, match=r"half\.json is no record"):
        read_records(tmp_path)


def test_rounding_keeps_six_digits_and_whole_numbers():
    assert rounded({"a": [1234567.8, 1.23456789e-7, 12345678, True, None]}) == {
        "a": [1234570.0, 1.23457e-7, 12345678, True, None]
    }


def test_results_are_recorded_of_committed_code_only(tmp_path):
    def git(*words):
        author = ("-c", "user.name=a", "-c", "user.email=a@b.c")
        done = subprocess.run(
            ["git", *author, *words], cwd=tmp_path, check=True, capture_output=True, text=True
        )
        return done.stdout.strip()

    git("init", "-q")
    code, results = tmp_path / "code.py", tmp_path / "docs" / "results"
    code.write_text("1\n")
    git("add", ".")
    git("commit", "-qm", "first")
    results.mkdir(parents=True)
    (results / "new.json").write_text("{}")
    assert git("rev-parse", "HEAD").startswith(committed_code(tmp_path))
    code.write_text("2\n")
    with pytest.raises(InputError, match=r"code\.py differs from the last commit"):
        committed_code(tmp_path)


def test_a_folder_that_is_no_clone_is_refused(tmp_path):
    with pytest.raises(InputError, match="record results in a clone"):
        committed_code(tmp_path)


def test_a_record_holds_the_verdicts_of_its_command(tmp_path, monkeypatch):
    monkeypatch.setitem(measure.COMMANDS, "minutes", ("packetmesh", "reproduce", "--only", "C29"))
    monkeypatch.setattr(measure, "committed_code", lambda: "abc1234")
    record = measure.measure("minutes", tmp_path)
    assert record.command == f"packetmesh reproduce --only C29 --out {tmp_path / 'minutes'} --json"
    claim = record.numbers["C29"]
    assert claim["verdict"] == "not reproduced"
    assert claim["ours"]["wrong_rows"] == 3
    assert [table["title"] for table in claim["tables"]] == ["Seconds and minutes of Table 4.6"]


def test_an_unknown_record_is_refused():
    with pytest.raises(InputError, match="no record 'nothing'; known are reconstruct"):
        measure.measure("nothing")
