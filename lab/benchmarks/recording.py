"""A camera that walks through held-out rooms, followed by PacketMesh and by other programs (SPEC 10.5)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from lab.benchmarks.benchmark import Benchmark
from lab.trials import iterate_trials
from lab.walks.held_out import CACHE, WalkTask, held_out_walks
from lab.walks.judging import LOST_SHARE, reference_of
from lab.walks.ours import OURS, OWN, measure_own
from lab.walks.peers import WALK_PEERS, available_walk_peers, measure_peer
from lab.walks.surfaces import F_SCORES, Row
from packetmesh.progress import drain

WALKS, FRAMES, WIDTH_PX = 10, 600, 320
"""Number of walks, frames of each walk (30 a second), and width of the images."""
FAST = 5
"""Step between the frames of a fast walk."""
ERRORS = ("ate_m", "ate_share", "rpe_m", "without_pose", "map_median_m", "without_surface")
"""Values whose largest is the worst."""
MOSTLY_KNOWN = ("ate_m", "ate_share", "rpe_m")
"""Errors that say little if most frames have no pose, and then count as missing."""
GAINS = ("frames_s", *F_SCORES)
"""Values whose smallest is the worst."""
TIMED = (
    "Median (worst). Time is from images in memory to poses and map; reading and the surface are not in it."
)


def benchmark(
    every: int = 1, walks: int = WALKS, frames: int = FRAMES, width_px: int = WIDTH_PX, folder: Path = CACHE
) -> Benchmark:
    """Follow the camera of held-out walks by every program, with each ``every``-th frame.

    Walks and answers that are in the folder are not computed again.
    """
    return compared(held_out_walks(walks, frames, width_px, folder), every, folder)


def compared(paths: Sequence[Path], every: int, folder: Path) -> Benchmark:
    """Follow the camera of some walks by every program; answers in ``folder`` are not computed again.

    Args:
        paths: rendered walks, or recordings whose own poses are taken as the truth.
        every: step between frames.
        folder: folder of the answers.

    Raises:
        InputError: a path is no usable recording, or has no poses.
    """
    for path in paths:
        reference_of(path)
    rows = _answers(tuple(OWN), measure_own, paths, every, folder)
    rows += _answers(available_walk_peers(), measure_peer, paths, every, folder)
    groups = summary(rows)
    notes = [_line(group) for group in groups]
    missing = [name for name in WALK_PEERS if name not in available_walk_peers()]
    if missing:
        notes.append(f"Not installed, so not compared: {', '.join(missing)}")
    seconds = {name: float(np.median([row["elapsed_s"] for row in some])) for name, some in _by_program(rows)}
    memory = {group["program"]: group["peak_memory_bytes"] for group in groups}
    ours_s, ours_bytes = seconds.pop(OURS), memory.pop(OURS)
    errors_m = {group["program"]: group["ate_m"] for group in groups if group["ate_m"] is not None}
    return Benchmark(ours_s, seconds, ours_bytes, memory, errors_m, tuple(groups), (*notes, TIMED))


def summary(rows: Iterable[Row]) -> list[Row]:
    """Return counts, and median and worst value of each measure, per program.

    A missing value counts as worse than all others; a median or worst value that is missing is None. The
    errors ``MOSTLY_KNOWN`` count as missing on a walk most of whose frames have no pose, and all measures of
    the map are missing for programs without a map.
    """
    groups = []
    for program, some in _by_program(rows):
        group: Row = {
            "program": program,
            "every": some[0]["every"],
            "walks": len(some),
            "lost": sum(row["lost"] for row in some),
            "crashed": sum(row.get("crashed", False) for row in some),
            "peak_memory_bytes": max(row["peak_memory_bytes"] for row in some),
        }
        for name in (*ERRORS, *GAINS):
            values = [None if name in MOSTLY_KNOWN and _hardly_any_pose(row) else row[name] for row in some]
            group[name], group[f"worst_{name}"] = _median_and_worst(values, name in GAINS)
        groups.append(group)
    return groups


def _answers(
    programs: Sequence[str],
    measure: Callable[[WalkTask], Row],
    walks: Sequence[Path],
    every: int,
    folder: Path,
) -> list[Row]:
    """Return every program's rows, computed one after the other so that times can be compared.

    The answers on a walk depend on its files, and not on other walks.
    """
    rows: list[Row] = []
    for walk in walks:
        tasks = [WalkTask(name, walk, every) for name in programs]
        stored = folder / "answers"
        rows += drain(iterate_trials("recordings", measure, tasks, stored, processes=1, data=(walk,)))
    return rows


def _by_program(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    """Return rows by program, in the order of appearance."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row["program"], []).append(row)
    return list(groups.items())


def _hardly_any_pose(row: Row) -> bool:
    return bool(row["without_pose"] > LOST_SHARE * row["frames"])


def _median_and_worst(
    values: Sequence[float | None], more_is_better: bool
) -> tuple[float | None, float | None]:
    sign = -1.0 if more_is_better else 1.0
    costs = np.array([np.inf if value is None else sign * value for value in values])
    median, worst = (sign * float(cost) for cost in (np.median(costs), costs.max()))
    return median if np.isfinite(median) else None, worst if np.isfinite(worst) else None


def _line(group: Row) -> str:
    parts = [
        f"{group['lost']} of {group['walks']} walks lost{_crashes(group)}",
        f"ATE {_both(group, 'ate_m', 100, 'cm')}",
        f"{_both(group, 'ate_share', 100, '%')} of the path",
        f"RPE {_both(group, 'rpe_m', 100, 'cm')}",
        f"{_both(group, 'without_pose', 1, 'frames')} without a pose",
        f"{_both(group, 'frames_s', 1, 'frames/s')}",
        f"{group['peak_memory_bytes'] / 1e6:.0f} MB",
    ]
    if group["map_median_m"] is not None:
        parts += [
            f"map {_both(group, 'map_median_m', 1000, 'mm')} off",
            f"F-score at 2 cm {_both(group, 'f_2cm', 100, '%')}, at 5 cm {_both(group, 'f_5cm', 100, '%')}",
            f"{_both(group, 'without_surface', 100, '%')} of rays without a surface",
        ]
    return f"{group['program']}: {', '.join(parts)}"


def _crashes(group: Row) -> str:
    return f", {group['crashed']} by a crash" if group["crashed"] else ""


def _both(group: Row, name: str, factor: float, unit: str) -> str:
    """Return median and worst of a measure, for example "1.2 (3.4) cm"."""
    median, worst = (
        "–" if value is None else f"{factor * value:.3g}" for value in (group[name], group[f"worst_{name}"])
    )
    return f"{median} ({worst}) {unit}"
