"""Bare clouds placed without a start pose: problems in the form of a public benchmark (see ``problems``)."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from lab.benchmarks.benchmark import Benchmark
from lab.benchmarks.problems import SOLVED, Problem, read_problems, scaled_displacement
from lab.places.judging import wilson
from lab.places.ours import OURS_GEOMETRY, place_clouds
from lab.places.pairs import CACHE
from lab.places.peers import PLACE_PEERS, available_place_peers, refined
from lab.trials import iterate_trials
from packetmesh.progress import drain
from pipeline.io.clouds import read_cloud
from pipeline.types import FloatArray, PointCloud

LISTS = Path("runs/problems")
"""Folder that ``lab.benchmarks.problem_lists`` writes; with ``--lidar`` it has a LiDAR pair's list, too."""
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class ListTask:
    """A program and a problem."""

    program: str
    problem: Problem


def benchmark(folder: Path = LISTS) -> Benchmark:
    """Solve every problem below a folder by ours and by all installed peers that need no colour.

    If the folder is missing, it is written, with the list of rooms but without the LiDAR pair.

    Raises:
        InputError: the folder holds no lists.
    """
    if not folder.exists():
        subprocess.run([sys.executable, "-m", "lab.benchmarks.problem_lists", str(folder)], check=True)
    problems = read_problems(folder)
    files = sorted({Path(path) for one in problems for path in (one.source, one.target)})
    peers = [name for name in available_place_peers() if PLACE_PEERS[name].start is not None]
    tasks = [ListTask(name, problem) for problem in problems for name in (OURS_GEOMETRY, *peers)]
    rows = drain(iterate_trials("lists", solve, tasks, CACHE / "answers", processes=1, data=files))
    groups = list(summary(rows))
    median_s = {
        name: float(np.median([row["elapsed_s"] for row in rows if row["program"] == name]))
        for name in (OURS_GEOMETRY, *peers)
    }
    notes = tuple(
        f"{group['list']}: {group['program']} solves {group['right']} of {group['pairs']}" for group in groups
    )
    ours_s = median_s.pop(OURS_GEOMETRY)
    return Benchmark(ours_s, median_s, None, runs=tuple(groups), notes=notes)


def solve(task: ListTask) -> Row:
    """Solve one problem without a start pose; an answer is right if its error is below ``SOLVED``."""
    source, target = (read_cloud(path) for path in (task.problem.source, task.problem.target))
    moved = source.transformed(task.problem.T_moved)
    T, verdict, elapsed_s = _answer(task.program, moved, target)
    left = None if T is None else scaled_displacement(T @ task.problem.T_moved, source.points_m)
    return {
        "program": task.program,
        "list": task.problem.list_name,
        "error": left,
        "right": left is not None and left < SOLVED,
        "verdict": verdict,
        "elapsed_s": elapsed_s,
    }


def summary(rows: list[Row]) -> Iterator[Row]:
    """Yield counts, the interval of the solved share and the median seconds, per list and program."""
    for name, program in dict.fromkeys((row["list"], row["program"]) for row in rows):
        some = [row for row in rows if (row["list"], row["program"]) == (name, program)]
        right = sum(row["right"] for row in some)
        sure = [row for row in some if row["verdict"] == "sure"]
        judged = program == OURS_GEOMETRY
        yield {
            "list": name,
            "program": program,
            "pairs": len(some),
            "right": right,
            "recall_ci95": wilson(right, len(some)),
            "sure": len(sure) if judged else None,
            "sure_wrong": sum(not row["right"] for row in sure) if judged else None,
            "median_s": float(np.median([row["elapsed_s"] for row in some])),
        }


def _answer(
    program: str, source: PointCloud, target: PointCloud
) -> tuple[FloatArray | None, str | None, float]:
    """Return the (4, 4) pose (None if none was found), the verdict (None for a peer), and the seconds."""
    if program == OURS_GEOMETRY:
        found = place_clouds(source, target)
        return found.T_target_source, found.verdict, found.elapsed_s
    peer = PLACE_PEERS[program]
    import_module(peer.module)  # before the clock starts
    assert peer.start is not None
    started = time.perf_counter()
    T = peer.start(source, target)
    if T is not None:
        T = refined(source, target, T)
    return T, None, time.perf_counter() - started
