"""The trace as files: ``trace.ndjson`` and ``trace.csv`` with a line per event, ``trace.json`` with the rest.

Kinds and causes are words in the files; all other columns are whole numbers, times in nanoseconds.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from dataclasses import fields
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from network_sim.config import NetworkConfig
from network_sim.counters import Counters
from network_sim.ledger import Delays, Outcomes
from network_sim.trace import COLUMNS, Events, NetworkTrace
from network_sim.types import Cause, EventKind, PacketKind
from packetmesh.errors import InputError
from packetmesh.files import atomic_path
from packetmesh.settings import settings, with_settings

_WORDS: dict[str, type[IntEnum]] = {"kind": EventKind, "cause": Cause, "packet_kind": PacketKind}
_NAMES = tuple(name for name, _ in COLUMNS)
_NDJSON = "{" + ", ".join(f'"{n}": "%s"' if n in _WORDS else f'"{n}": %d' for n in _NAMES) + "}\n"
_CSV = ",".join("%s" if n in _WORDS else "%d" for n in _NAMES) + "\n"
_SUMS = ("count", "size_bytes", "duration_ns", "until_end_ns")
_BLOCK = 65536


def write_trace(trace: NetworkTrace, folder: Path) -> None:
    """Writes the three files, all or none.

    Raises:
        InputError: the folder cannot be made or written, or is full.
    """
    with (
        atomic_path(folder / "trace.ndjson") as ndjson,
        atomic_path(folder / "trace.csv") as table,
        atomic_path(folder / "trace.json") as rest,
    ):
        try:
            _write(trace, ndjson, table, rest)
        except OSError as error:
            raise InputError(
                f"The trace cannot be written to {folder} ({error.strerror}); try another folder"
            ) from None


def _write(trace: NetworkTrace, ndjson: Path, table: Path, rest: Path) -> None:
    with ndjson.open("w") as lines, table.open("w") as rows:
        rows.write(",".join(_NAMES) + "\n")
        for block in _blocks(trace.events):
            lines.writelines(_NDJSON % row for row in block)
            rows.writelines(_CSV % row for row in block)
    rest.write_text(json.dumps(_record(trace)) + "\n")


def read_trace(folder: Path) -> NetworkTrace:
    """The trace that was written to this folder.

    Raises:
        InputError: a file is missing or is not what ``write_trace`` wrote.
    """
    path = folder / "trace.json"
    try:
        record = json.loads(path.read_text())
        positions_m = record["positions_m"]
        values = [f"{key}={value}" for key, value in record["settings"].items()]
        return NetworkTrace(
            events=read_events(folder / "trace.ndjson"),
            counters=_counters(record["counters"]),
            names=tuple(record["names"]),
            roles=tuple(record["roles"]),
            positions_m=None if positions_m is None else np.array(positions_m, float).reshape(-1, 2),
            config=with_settings(NetworkConfig(), values),
            horizon_ns=int(record["horizon_ns"]),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise _unreadable(path, error) from None


def read_events(path: Path) -> Events:
    """The events of a ``trace.ndjson`` or ``trace.csv``.

    Raises:
        InputError: the file is missing or is not what ``write_trace`` wrote.
    """
    try:
        with path.open(newline="") as file:
            rows = csv.DictReader(file) if path.suffix == ".csv" else (json.loads(line) for line in file)
            values: dict[str, list[Any]] = {name: [] for name in _NAMES}
            for row in rows:
                for name, column in values.items():
                    column.append(row[name])
        return Events(*(_column(name, dtype, values[name]) for name, dtype in COLUMNS))
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise _unreadable(path, error) from None


def _unreadable(path: Path, error: Exception) -> InputError:
    reason = f"{error} is missing in it" if isinstance(error, KeyError) else error
    return InputError(f"The trace {path} cannot be read ({reason}); try the folder of a finished simulation")


def _blocks(events: Events) -> Iterator[list[tuple[Any, ...]]]:
    """The events as tuples, not all at once: text needs many times their memory."""
    for start in range(0, len(events), _BLOCK):
        part = events.rows(start, start + _BLOCK)
        columns = [_words(name, part[name]) if name in _WORDS else part[name].tolist() for name in _NAMES]
        yield list(zip(*columns, strict=True))


def _words(name: str, column: NDArray[np.int8]) -> list[str]:
    words = [word.name for word in _WORDS[name]]
    return [words[number] for number in column.tolist()]


def _column(name: str, dtype: str, values: list[Any]) -> NDArray[Any]:
    if name in _WORDS:
        numbers = {word.name: int(word) for word in _WORDS[name]}
        return np.array([numbers[value] for value in values], dtype)
    return np.array([int(value) for value in values], dtype)


def _record(trace: NetworkTrace) -> dict[str, Any]:
    return {
        "names": trace.names,
        "roles": trace.roles,
        "positions_m": None if trace.positions_m is None else trace.positions_m.tolist(),
        "horizon_ns": trace.horizon_ns,
        "settings": settings(trace.config),
        "counters": _counters_record(trace.counters),
    }


def _counters_record(counters: Counters) -> dict[str, Any]:
    """Only what is not zero: most combinations of kind and cause never happen."""
    places = np.argwhere(counters.count)
    at = tuple(places.T)
    record: dict[str, Any] = {field.name: getattr(counters, field.name) for field in fields(Counters)}
    record |= {name: getattr(counters, name)[at].tolist() for name in _SUMS}
    record |= {name: getattr(counters, name).tolist() for name in ("states_ns", "edges_ns")}
    record |= {name: _outcomes_record(getattr(counters, name)) for name in ("packets", "images")}
    return record | {"places": places.tolist(), "shape": counters.count.shape}


def _outcomes_record(outcomes: Outcomes) -> dict[str, Any]:
    delays = outcomes.delays
    bins = np.flatnonzero(delays.histogram)
    return {
        "created": outcomes.created,
        "arrived": outcomes.arrived,
        "count": delays.count,
        "total_s": delays.total_s,
        "squares_s2": delays.squares_s2,
        "bins": bins.tolist(),
        "histogram": delays.histogram[bins].tolist(),
        "width": len(delays.histogram),
    }


def _counters(record: dict[str, Any]) -> Counters:
    at = tuple(np.array(record.pop("places"), np.int64).reshape(-1, 4).T)
    shape = record.pop("shape")
    for name in _SUMS:
        sums = np.zeros(shape, np.int64)
        sums[at] = record[name]
        record[name] = sums
    for name in ("states_ns", "edges_ns"):
        record[name] = np.array(record[name], np.int64)
    for name in ("packets", "images"):
        record[name] = _outcomes(record[name])
    return Counters(**{**record, "faults": tuple(record["faults"])})


def _outcomes(record: dict[str, Any]) -> Outcomes:
    histogram = np.zeros(record["width"], np.int64)
    histogram[record["bins"]] = record["histogram"]
    delays = Delays(record["count"], record["total_s"], record["squares_s2"], histogram)
    return Outcomes(record["created"], record["arrived"], delays)
