"""Traces as files: every number of the run stands in them."""

from __future__ import annotations

import csv
import json
import os
import resource
from collections.abc import Iterable, Mapping
from dataclasses import replace
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from network_sim.config import Keep, NetworkConfig, SchemeConfig
from network_sim.presets import PRESETS
from network_sim.trace.files import write_trace
from network_sim.trace.log import COLUMNS
from network_sim.types import Cause, EventKind, PacketKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from tests.network_sim.by_hand import random_run, small_run, trace_of

FILES = ("trace.csv", "trace.json", "trace.ndjson")


def columns_of(rows: Iterable[Mapping[str, Any]]) -> dict[str, list[int]]:
    """The columns of a log from its lines; names of kinds and causes as numbers."""
    enums: dict[str, type[IntEnum]] = {"kind": EventKind, "cause": Cause, "packet_kind": PacketKind}
    lines = list(rows)
    return {
        name: [int(enums[name][line[name]] if name in enums else line[name]) for line in lines]
        for name, _ in COLUMNS
    }


def record_of(folder: Path) -> dict[str, Any]:
    record: dict[str, Any] = json.loads((folder / "trace.json").read_text())
    return record


@pytest.mark.parametrize("keep", ["all", "images", "counters"])
def test_both_logs_hold_every_number_of_every_event(keep: Keep, tmp_path: Path) -> None:
    for trace in (trace_of(small_run, keep), trace_of(random_run(8), keep, warmup_s=1 / 3)):
        write_trace(trace, tmp_path)
        events = {name: getattr(trace.events, name).tolist() for name, _ in COLUMNS}
        with (tmp_path / "trace.ndjson").open() as file:
            assert columns_of(map(json.loads, file)) == events
        with (tmp_path / "trace.csv").open(newline="") as file:
            assert columns_of(csv.DictReader(file)) == events


@pytest.mark.parametrize("keep", ["all", "counters"])
def test_the_record_holds_the_counters_and_what_the_run_was(keep: Keep, tmp_path: Path) -> None:
    trace = trace_of(random_run(8), keep, warmup_s=1 / 3)
    write_trace(trace, tmp_path)
    record = record_of(tmp_path)
    assert (tuple(record["names"]), tuple(record["roles"])) == (trace.names, trace.roles)
    assert record["horizon_ns"] == trace.horizon_ns
    np.testing.assert_array_equal(record["positions_m"], trace.positions_m)
    counters = record["counters"]
    for name in ("count", "size_bytes", "duration_ns", "until_end_ns"):
        sums = np.zeros(counters["shape"], np.int64)
        sums[tuple(np.transpose(counters["places"]))] = counters[name]
        np.testing.assert_array_equal(sums, getattr(trace.counters, name))
    for name in ("states_ns", "edges_ns"):
        np.testing.assert_array_equal(counters[name], getattr(trace.counters, name))
    delays, written = trace.counters.images.delays, counters["images"]
    assert written["arrived"] == sum(written["histogram"]) == delays.count > 0
    assert written["total_s"] == delays.total_s


@pytest.mark.parametrize("preset", PRESETS)
def test_the_settings_of_the_record_give_the_config_back(preset: str, tmp_path: Path) -> None:
    config = replace(PRESETS[preset], scheme=SchemeConfig("greedy", k=3))
    write_trace(replace(trace_of(small_run), config=config, positions_m=None), tmp_path)
    record = record_of(tmp_path)
    settings = [f"{key}={value}" for key, value in record["settings"].items()]
    assert with_settings(NetworkConfig(), settings) == config
    assert record["positions_m"] is None


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
        with pytest.raises(InputError, match=r"cannot be written \(.*\); try another folder"):
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
        with pytest.raises(InputError, match=r"to .* \(File too large\); delete something there"):
            write_trace(large, tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
