"""Registration problems in the lists of a public benchmark, solved by our method and the peers.

The format is that of Fontana et al., "A benchmark for point clouds registration algorithms" (arXiv
2003.12841): a folder with clouds that are already aligned, and lists ``*_local.txt`` and ``*_global.txt``
whose lines name a source, a target and the motion by which the source is moved before it is registered back.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lab.trials import iterate_trials
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress
from pipeline.config import RegistrationConfig
from pipeline.io.clouds import read_cloud, write_cloud
from pipeline.kernels.geometry import apply
from pipeline.pairs.found import find_place, settled_answer
from pipeline.pairs.register import DEFAULT_METHOD, Pair, prepared_pair
from pipeline.registration.peers import available_peers, run_peer
from pipeline.types import FloatArray, PointCloud

LISTS = ("*_local.txt", "*_global.txt")
COLUMNS = ("id", "source", "target", "overlap", *(f"t{k}" for k in range(1, 13)))
OURS = "ceicp-a"
PEERS = ("open3d-plane", "open3d-gicp", "small-gicp", "small-gicp-staged")
SOLVED = 0.05
"""A problem is solved if its error is less than this share of the points' distances to the centroid."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One line of a list."""

    list_name: str
    id: str
    source: str
    """Path of the source cloud."""
    target: str
    """Path of the target cloud."""
    overlap: float
    """Overlap of the clouds, 0 to 1; NaN if unknown."""
    motion: tuple[float, ...]
    """(12,) the first three rows of the matrix that moves the source away."""

    @property
    def T_moved(self) -> FloatArray:
        """(4, 4) matrix of the motion."""
        return np.vstack([np.reshape(self.motion, (3, 4)), [0.0, 0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True)
class MethodAnswer:
    """Pose of one method; None, like its time, if it has none."""

    method: str
    T_target_source: FloatArray | None
    """(4, 4)."""
    elapsed_s: float | None
    reason: str
    """Why it stopped, or why there is no pose."""


def scaled_displacement(T_left: FloatArray, points_m: FloatArray) -> float:
    """Return the benchmark's error: the mean over points of displacement over distance to the centroid.

    Args:
        T_left: (4, 4) the remaining motion: identity if the problem is solved.
        points_m: (N, 3) the source at its true pose.

    Source: Fontana et al. 2020, eq. 3.
    """
    arms_m = np.linalg.norm(points_m - points_m.mean(axis=0), axis=1)
    apart_m = np.linalg.norm(apply(T_left, points_m) - points_m, axis=1)
    away = arms_m > 0.0
    return float(np.mean(apart_m[away] / arms_m[away]))


def read_problems(folder: Path) -> list[Problem]:
    """Return the problems of all lists below a folder; the clouds are in the folder of their list.

    Raises:
        InputError: no list, or an invalid line; the sentence names file and line.
    """
    paths = sorted(path for pattern in LISTS for path in folder.rglob(pattern))
    if not paths:
        raise InputError(f"{folder} holds no list of problems; try a folder with files like stairs_local.txt")
    return [problem for path in paths for problem in _list(path)]


def _list(path: Path) -> Iterator[Problem]:
    """Yield the problems of one list."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    header = lines[0].split() if lines else []
    missing = [column for column in COLUMNS if column not in header]
    if missing:
        raise InputError(f"{path}: the first line has no column '{missing[0]}'; try {' '.join(COLUMNS)}")
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        row = dict(zip(header, line.split(), strict=False))
        try:
            numbers = [float(row[column]) for column in COLUMNS[3:]]
        except (KeyError, ValueError):
            raise InputError(f"{path}, line {number}: not a problem; try {len(header)} values") from None
        overlap, motion = numbers[0], tuple(numbers[1:])
        source, target = (str(path.parent / row[column]) for column in ("source", "target"))
        yield Problem(path.stem, row["id"], source, target, overlap, motion)


def iterate_problems(
    folder: Path, store: Path, scheduler: str | None = None
) -> Generator[Progress, None, list[dict[str, Any]]]:
    """Solve every problem below ``folder``; those whose rows are in ``store`` are not solved again.

    Returns:
        A row for each problem and method: list, id, overlap, gate, error before and after, seconds, reason.

    Raises:
        InputError: no lists, or lists that cannot be read.
    """
    problems = read_problems(folder)
    files = [Path(path) for path in sorted({path for one in problems for path in (one.source, one.target)})]
    answers = yield from iterate_trials("problems", solve, problems, store, processes=1, data=files)
    return [row for rows in answers for row in rows]


def solve(problem: Problem) -> list[dict[str, Any]]:
    """Solve one problem by our method and by the installed peers; return a row for each.

    All start at the identity; ours, like `packetmesh register`, also searches for other start poses and for
    the gate. The peers get the gate that it found, the default one if it found none; the search counts in our
    time only. Without an answer, error and seconds are None.
    """
    source, target = read_cloud(problem.source), read_cloud(problem.target)
    moved = source.transformed(problem.T_moved)
    known = {"list": problem.list_name, "id": problem.id, "overlap": problem.overlap}
    known["error_before"] = scaled_displacement(problem.T_moved, source.points_m)
    ours, pair, gate_m = _own_answer(moved, target)
    peers = [_peer_answer(name, pair, gate_m) for name in PEERS if name in available_peers()]
    return [
        known
        | {
            "method": one.method,
            "gate_m": gate_m,
            "error": None
            if one.T_target_source is None
            else scaled_displacement(one.T_target_source @ problem.T_moved, source.points_m),
            "elapsed_s": one.elapsed_s,
            "reason": one.reason,
        }
        for one in (ours, *peers)
    ]


def _own_answer(source: PointCloud, target: PointCloud) -> tuple[MethodAnswer, Pair, float]:
    """Return our answer, the pair that the peers get, and their gate in metres.

    The pair is prepared as for our method, or not at all if our method cannot use the clouds.
    """
    config = RegistrationConfig(seed=0)
    pair, gate_m = Pair(source, target, np.eye(4)), config.gate_m
    started = time.perf_counter()
    try:
        pair = prepared_pair(source, target, config, metres_per_unit=(1.0, 1.0))
        place = find_place(pair, config, None)
        gate_m = place.config.gate_m
        found = settled_answer(DEFAULT_METHOD, place)
    except PacketMeshError as error:
        return MethodAnswer(OURS, None, None, str(error)), pair, gate_m
    T = found.T_target_source
    elapsed_s = None if T is None else time.perf_counter() - started
    return MethodAnswer(OURS, T, elapsed_s, found.stop_reason), pair, gate_m


def _peer_answer(name: str, pair: Pair, gate_m: float) -> MethodAnswer:
    """Return the answer of a peer that starts at the identity."""
    try:
        found = run_peer(name, pair.source, pair.target, gate_m)
    except PacketMeshError as error:
        return MethodAnswer(name, None, None, str(error))
    return MethodAnswer(name, found.T_target_source, found.elapsed_s, found.stop_reason)


def summary(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return, per list and method: problems, median and upper quartile of the error, share solved, seconds.

    A row without an error counts as not solved, with the error before the registration.
    """
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["list"], row["method"]), []).append(row)
    result = []
    for (name, method), some in groups.items():
        errors = np.array([row["error_before"] if row["error"] is None else row["error"] for row in some])
        seconds = [row["elapsed_s"] for row in some if row["elapsed_s"] is not None]
        result.append(
            {
                "list": name,
                "method": method,
                "problems": len(some),
                "median_error": float(np.median(errors)),
                "upper_quartile_error": float(np.quantile(errors, 0.75)),
                "solved_share": float(np.mean(errors < SOLVED)),
                "median_s": float(np.median(seconds)) if seconds else None,
            }
        )
    return result


def write_problems(
    folder: Path,
    name: str,
    pairs: Sequence[Pair],
    motions: Sequence[Sequence[FloatArray]],
    overlaps: Sequence[float],
) -> Path:
    """Write a list of problems with its clouds, in the form that ``read_problems`` reads; return its path.

    Args:
        folder: folder for the clouds as PLY and ``NAME_local.txt``.
        name: name of the list.
        pairs: clouds with their ``T_true``, which aligns the source with the target.
        motions: for each pair the (4, 4) motions by which its source is moved.
        overlaps: overlap of each pair, 0 to 1.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lines = [" ".join(COLUMNS)]
    for index, (pair, some, overlap) in enumerate(zip(pairs, motions, overlaps, strict=True)):
        T_true = np.eye(4) if pair.T_true is None else pair.T_true
        files = [f"{name}_{index:02d}_{role}.ply" for role in ("source", "target")]
        for file, cloud in zip(files, (pair.source.transformed(T_true), pair.target), strict=True):
            write_cloud(folder / file, PointCloud(cloud.points_m))
        for turn, T in enumerate(some):
            numbers = " ".join(f"{value!r}" for value in T[:3].ravel().tolist())
            lines.append(f"{name}_{index:02d}_{turn:03d} {files[0]} {files[1]} {overlap:.3f} {numbers}")
    path = folder / f"{name}_local.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
