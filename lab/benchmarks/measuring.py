"""Measures in rendered rooms: how often their intervals hold, and how fast."""

from __future__ import annotations

from pathlib import Path

from lab.benchmarks.benchmark import Benchmark
from lab.measuring.judging import UNITS, RoomTask, Row, judged_room, summaries
from lab.measuring.rooms import HELD_OUT
from lab.trials import iterate_trials
from packetmesh.progress import drain
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.inference import SHIPPED_MODEL

ROOMS = 20
FOLDER = Path("runs/measuring")
"""Folder of the stored rows of the rooms; a room that has them is not measured again."""
DATA = (SHIPPED_MODEL, SHIPPED_COMPLETION)
"""The networks, on whose files the rows depend."""
BATCH = 4
"""Rooms in a batch; batches follow until enough rooms have two views with the required overlap."""


def benchmark(rooms: int = ROOMS) -> Benchmark:
    """Measure in the first held-out rooms with two usable views; the time is the median time of a length.

    Args:
        rooms: number of rooms.
    """
    found: list[list[Row]] = []
    first = HELD_OUT
    while len(found) < rooms:
        tasks = [RoomTask(seed) for seed in range(first, first + BATCH)]
        answers = drain(iterate_trials("measuring", judged_room, tasks, FOLDER, processes=1, data=DATA))
        found += [rows for rows in answers if rows is not None]
        first += BATCH
    groups = summaries([row for rows in found[:rooms] for row in rows])
    lengths = next(group for group in groups if group["kind"] == "distance" and not group["guessed"])
    return Benchmark(
        lengths["median_s"],
        {},
        None,
        runs=tuple(groups),
        notes=tuple(_line(group) for group in groups),
    )


def _line(group: Row) -> str:
    """Return the results of one kind of measure as a line of text."""
    low, high = group["coverage_ci95"]
    unit, times = UNITS.get(group["kind"], (" mm", 1000.0))
    ratio = group["error_over_raw"]
    ratio_text = "" if ratio is None else f", {ratio:.2f} x that of single measurements"
    return (
        f"{group['kind']}, {'guessed' if group['guessed'] else 'measured'}: {group['measures']} in "
        f"{group['rooms']} rooms, {100.0 * group['coverage']:.1f} % of the intervals hold "
        f"({100.0 * low:.1f} to {100.0 * high:.1f} %), median error {times * group['median_error']:.2f}{unit}"
        f"{ratio_text}, median half width {times * group['median_half_width']:.2f}{unit}, "
        f"{1000.0 * group['p95_s']:.0f} ms at the 95th percentile"
    )
