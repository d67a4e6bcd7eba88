"""Writing a trace to ``trace.ndjson`` and ``trace.csv`` (a line per event) and ``trace.json`` (all else).

Event kinds and causes are written as names, all other columns as whole numbers; times are in nanoseconds.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np

from network_sim.trace.counters import Counters
from network_sim.trace.ledger import Outcomes
from network_sim.trace.log import COLUMNS, Events, NetworkTrace
from network_sim.types import Cause, EventKind, PacketKind
from packetmesh.errors import InputError
from packetmesh.files import atomic_path, remedy
from packetmesh.settings import settings

_ENUMS: dict[str, type[IntEnum]] = {"kind": EventKind, "cause": Cause, "packet_kind": PacketKind}
_NAMES = tuple(name for name, _ in COLUMNS)
_NDJSON = "{" + ", ".join(f'"{n}": "%s"' if n in _ENUMS else f'"{n}": %d' for n in _NAMES) + "}\n"
_CSV = ",".join("%s" if n in _ENUMS else "%d" for n in _NAMES) + "\n"
_SUMS = ("count", "size_bytes", "duration_ns", "until_end_ns")
_BLOCK = 65536


def write_trace(trace: NetworkTrace, folder: Path) -> None:
    """Write the three files of a trace to a folder, all or none.

    Raises:
        InputError: the folder cannot be created or written, or the disk is full.
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
                f"The trace cannot be written to {folder} ({error.strerror}); {remedy(error)}"
            ) from None


def _write(trace: NetworkTrace, ndjson: Path, table: Path, rest: Path) -> None:
    with ndjson.open("w") as lines, table.open("w") as rows:
        rows.write(",".join(_NAMES) + "\n")
        for block in _blocks(trace.events):
            lines.writelines(_NDJSON % row for row in block)
            rows.writelines(_CSV % row for row in block)
    rest.write_text(json.dumps(_record(trace)) + "\n")


def _blocks(events: Events) -> Iterator[list[tuple[Any, ...]]]:
    """Yield the events as tuples in blocks: as text, all events would need many times their memory."""
    for start in range(0, len(events), _BLOCK):
        part = events.rows(start, start + _BLOCK)
        columns = {name: part[name].tolist() for name in _NAMES}
        for name, enum in _ENUMS.items():
            names = [member.name for member in enum]
            columns[name] = [names[number] for number in columns[name]]
        yield list(zip(*columns.values(), strict=True))


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
    """Return the counters without their zeros: most combinations of kind and cause never occur."""
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
