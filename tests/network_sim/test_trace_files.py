"""Traces that are written and read back."""

from __future__ import annotations

import csv
import json
import os
import resource
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from network_sim.config import PRESETS, Keep, SchemeConfig
from network_sim.conservation import check
from network_sim.metrics import metrics
from network_sim.trace import Events, NetworkTrace
from network_sim.trace_files import read_events, read_trace, write_trace
from packetmesh.errors import InputError
from tests.network_sim.by_hand import random_run, small_run, trace_of

FILES = ("trace.csv", "trace.json", "trace.ndjson")


def assert_equal_events(one: Events, other: Events) -> None:
    for left, right in zip(one.columns(), other.columns(), strict=True):
        assert left.dtype == right.dtype
        np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize("keep", ["all", "images", "counters"])
def test_a_trace_comes_back_as_it_was(keep: Keep, tmp_path: Path) -> None:
    for trace in (trace_of(small_run, keep), trace_of(random_run(8), keep, warmup_s=1 / 3)):
        write_trace(trace, tmp_path)
        again = read_trace(tmp_path)
        assert_equal_events(trace.events, again.events)
        assert_equal_events(trace.events, read_events(tmp_path / "trace.csv"))
        np.testing.assert_equal(asdict(again.counters), asdict(trace.counters))
        assert again.positions_m is not None
        np.testing.assert_array_equal(again.positions_m, trace.positions_m)
        for name in ("names", "roles", "config", "horizon_ns"):
            assert getattr(again, name) == getattr(trace, name)
        assert metrics(again) == metrics(trace)
        check(again)


@pytest.mark.parametrize("preset", PRESETS)
def test_every_config_comes_back(preset: str, tmp_path: Path) -> None:
    config = replace(PRESETS[preset], scheme=SchemeConfig("greedy", k=3))
    trace = replace(trace_of(small_run), config=config, positions_m=None)
    write_trace(trace, tmp_path)
    again = read_trace(tmp_path)
    assert again.config == config
    assert again.positions_m is None


def test_what_was_read_is_written_to_the_same_bytes(tmp_path: Path) -> None:
    write_trace(trace_of(random_run(9)), tmp_path / "one")
    write_trace(read_trace(tmp_path / "one"), tmp_path / "other")
    for name in FILES:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()


def test_a_line_says_what_happened_in_words(tmp_path: Path) -> None:
    trace = trace_of(small_run)
    write_trace(trace, tmp_path)
    lines = [json.loads(line) for line in (tmp_path / "trace.ndjson").read_text().splitlines()]
    with (tmp_path / "trace.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(lines) == len(rows) == len(trace.events)
    loss = next(line for line in lines if line["kind"] == "LOSS")
    assert loss == {
        "t_ns": 72_000_000_000,
        "duration_ns": 0,
        "packet": 1,
        "image": 1,
        "first_byte": 0,
        "size_bytes": 500,
        "node": 0,
        "peer": 2,
        "kind": "LOSS",
        "cause": "COLLISION",
        "packet_kind": "IMAGE",
    }
    assert rows[lines.index(loss)] == {name: str(value) for name, value in loss.items()}


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file" / "runs", Path("/proc/runs")):
        with pytest.raises(InputError, match=r"cannot be written \(.*\); try another folder for the output"):
            write_trace(trace_of(small_run), folder)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_may_not_be_written_is_one_sentence(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match=r"cannot be written \(Permission denied\)"):
        write_trace(trace_of(small_run), tmp_path)


def test_a_full_disk_is_one_sentence_and_leaves_what_was_there(tmp_path: Path) -> None:
    write_trace(trace_of(small_run), tmp_path)
    before = {name: (tmp_path / name).read_bytes() for name in FILES}
    large = trace_of(random_run(10))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with pytest.raises(InputError, match=r"to .* \(File too large\); try another folder"):
            write_trace(large, tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def spoil(folder: Path, name: str, old: str, new: str) -> None:
    path = folder / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("trace.ndjson", '"LOSS"', '"LOST"'),
        ("trace.ndjson", '"t_ns": 10000000000', '"t_ns": "soon"'),
        ("trace.ndjson", '"node": 0', '"node": 70000'),
        ("trace.ndjson", '"image"', '"picture"'),
        ("trace.ndjson", "{", ""),
        ("trace.json", '"counters"', '"sums"'),
        ("trace.json", '"created"', '"made"'),
        ("trace.json", "{", "["),
        ("trace.json", '"radio.model": "two-ray"', '"radio.model": "three-ray"'),
    ],
)
def test_a_spoilt_file_is_one_sentence(name: str, old: str, new: str, tmp_path: Path) -> None:
    write_trace(trace_of(small_run), tmp_path)
    spoil(tmp_path, name, old, new)
    with pytest.raises(InputError) as caught:
        read_trace(tmp_path)
    assert "; try " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_trace_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"trace\.json cannot be read .*; try the folder"):
        read_trace(tmp_path)


def test_columns_of_a_table_that_is_not_a_trace(tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_text("t_ns,kind\n1,AIR\n")
    with pytest.raises(InputError, match="'duration_ns' is missing"):
        read_events(tmp_path / "trace.csv")


def test_an_empty_log_is_read(tmp_path: Path) -> None:
    trace: NetworkTrace = trace_of(lambda recorder: None)
    write_trace(trace, tmp_path)
    assert len(read_trace(tmp_path).events) == 0
