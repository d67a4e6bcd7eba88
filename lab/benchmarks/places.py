"""Views placed without a start pose: how often right, how often wrong but sure, and how fast."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from lab.benchmarks.benchmark import Benchmark
from lab.places.judging import PlacesTask, wilson
from lab.places.ours import OURS, OURS_GEOMETRY, solve_own
from lab.places.pairs import CACHE, HELD_OUT, bench_pairs, mixed_pairs
from lab.places.peers import PLACE_PEERS, available_place_peers, solve_peer
from lab.trials import iterate_trials
from packetmesh.progress import drain

PER_OVERLAP = 75
"""Held-out pairs of each overlap."""
MIXED, LOOKED_AT = 2200, 200
"""Held-out pairs of any overlap, for the verdict, and how many of the first of them are left out, because
they were used to choose a threshold of the search."""
OWN = (OURS, OURS_GEOMETRY)
DIFFERENT = "different rooms"
NOTHING = "no overlap"
BIN = 0.1
"""Width of the bins of overlap of the mixed pairs."""
Row = dict[str, Any]


def benchmark(per_overlap: int = PER_OVERLAP) -> Benchmark:
    """Place pairs of four overlaps by every program, ``per_overlap`` of each.

    Pairs and answers that are in ``runs/places`` are not computed again.
    """
    pairs = list(bench_pairs(per_overlap))
    rows = _answers(OWN, solve_own, pairs)
    rows += _answers(available_place_peers(), solve_peer, pairs)
    seconds = {name: _median_s(some) for name, some in grouped(rows, "program").items()}
    missing = [name for name in PLACE_PEERS if name not in seconds]
    groups = by_overlap(rows)
    notes = [_line(group) for group in groups]
    if missing:
        notes.append(f"Not installed, so not compared: {', '.join(missing)}")
    ours_s = seconds.pop(OURS)
    return Benchmark(ours_s, seconds, None, runs=tuple(groups), notes=tuple(notes))


def verdicts(count: int = MIXED) -> Benchmark:
    """Place pairs of any overlap, or of different rooms, by ours, and compare its verdict with the truth.

    All cores work, because these times are not compared with those of other programs.
    """
    rows = _answers(OWN, solve_own, list(mixed_pairs(HELD_OUT, count))[LOOKED_AT:], processes=None)
    seconds = {name: _median_s(some) for name, some in grouped(rows, "program").items()}
    groups = by_verdict(rows)
    notes = tuple(
        f"{group['program']}, {group['overlap']}: {group['right']} of {group['pairs']} right, "
        f"{group['sure']} sure, {group['sure_wrong']} of these wrong"
        for group in groups
    )
    ours_s = seconds.pop(OURS)
    return Benchmark(ours_s, seconds, None, runs=tuple(groups), notes=notes)


def by_overlap(rows: Iterable[Row]) -> list[Row]:
    """Return counts, recall with its interval and median seconds, per program and wanted overlap."""
    return [
        {"program": program, "overlap": overlap} | _counts(some)
        for program, own in grouped(rows, "program").items()
        for overlap, some in grouped(own, "overlap").items()
    ]


def by_verdict(rows: Iterable[Row]) -> list[Row]:
    """Return counts per program: for all pairs, different rooms, no overlap, and each bin of overlap."""
    groups = []
    for program, own in grouped(rows, "program").items():
        bins: dict[str, list[Row]] = {"all": own, DIFFERENT: [], NOTHING: []}
        for row in sorted(own, key=lambda row: float(row["overlap_share"])):
            bins.setdefault(_bin(row), []).append(row)
        groups += [{"program": program, "overlap": name} | _counts(some) for name, some in bins.items()]
    return groups


def grouped(rows: Iterable[Row], key: str) -> dict[Any, list[Row]]:
    """Group rows by the value of a column; groups are in the order of their first rows."""
    groups: dict[Any, list[Row]] = {}
    for row in rows:
        groups.setdefault(row[key], []).append(row)
    return groups


def _answers(
    programs: Sequence[str],
    solve: Callable[[PlacesTask], Row],
    pairs: Sequence[tuple[int, float | None]],
    processes: int | None = 1,
) -> list[Row]:
    """Return every program's rows on held-out pairs, computed in ``processes`` processes.

    With one, times can be compared; None takes one process per core.
    """
    tasks = [PlacesTask(name, HELD_OUT, index, overlap) for index, overlap in pairs for name in programs]
    return drain(iterate_trials("places", solve, tasks, CACHE / "answers", processes=processes))


def _bin(row: Row) -> str:
    if row["overlap"] is None:
        return DIFFERENT
    if row["overlap"] == 0.0:
        return NOTHING
    low = BIN * int(row["overlap_share"] / BIN)
    return f"{100.0 * low:.0f} to {100.0 * (low + BIN):.0f} %"


def _counts(rows: Sequence[Row]) -> Row:
    right = sum(row["right"] for row in rows)
    judged = rows[0]["verdict"] is not None if rows else False
    sure = [row for row in rows if row["verdict"] == "sure"]
    low, high = wilson(right, len(rows))
    return {
        "pairs": len(rows),
        "right": right,
        "recall_ci95": (low, high),
        "sure": len(sure) if judged else None,
        "sure_wrong": sum(not row["right"] for row in sure) if judged else None,
        "median_s": _median_s(rows) if rows else None,
    }


def _median_s(rows: Sequence[Row]) -> float:
    return float(np.median([row["elapsed_s"] for row in rows]))


def _line(group: Row) -> str:
    low, high = group["recall_ci95"]
    sure = "" if group["sure"] is None else f", {group['sure_wrong']} wrong of {group['sure']} sure"
    return (
        f"{group['program']}, {100.0 * group['overlap']:.0f} % overlap: {group['right']} of {group['pairs']} "
        f"right ({100.0 * low:.0f} to {100.0 * high:.0f} %){sure}, {group['median_s']:.2f} s"
    )
