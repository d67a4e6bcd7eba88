"""Judgement of a room's measures by their true values."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from lab.measuring.clicks import Click, clicks
from lab.measuring.rooms import measured_room
from packetmesh.errors import InputError
from pipeline.measuring.marks import mark_on_ray
from pipeline.measuring.measures import Measure, angle_of_planes, distance, point_to_plane
from pipeline.measuring.planes import Plane, plane_at
from pipeline.measuring.surface import MeasuredSurface

LENGTHS = 30
"""Lengths of each kind in a room: both ends measured, and at least one guessed."""
PLANES = 12
"""Heights over a plane, and angles of planes, in a room."""
SHORTEST_M = 0.1
MOST_CLICKS = 3000
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class RoomTask:
    """A room that is to be judged."""

    seed: int


def judged_room(task: RoomTask) -> list[Row] | None:
    """Return a row for every measure of a room; None if the room cannot be reconstructed."""
    room = measured_room(task.seed)
    if room is None:
        return None
    rng = np.random.default_rng([task.seed, 29])
    found = list(islice(clicks(room, rng), MOST_CLICKS))
    measured = [click for click in found if not click.mark.guessed]
    guessed = [click for click in found if click.mark.guessed]
    rows = [
        {"room": task.seed} | row
        for firsts in (measured, guessed)
        for row in _lengths(room.surface, firsts, found if firsts is guessed else measured)
    ]
    flat = [click for click in measured if click.flat][: 6 * PLANES]
    rows += [{"room": task.seed} | row for row in _with_planes(room.surface, measured, flat)]
    return rows


def _lengths(surface: MeasuredSurface, firsts: Sequence[Click], seconds: Sequence[Click]) -> list[Row]:
    """Return the rows of lengths from some clicks to others, every click at most once on either side."""
    rows: list[Row] = []
    for a, b in zip(firsts, reversed(seconds), strict=False):
        true_m = float(np.linalg.norm(a.true_m - b.true_m))
        if len(rows) == LENGTHS:
            break
        if true_m < SHORTEST_M or np.linalg.norm(a.mark.point_m - b.mark.point_m) < SHORTEST_M:
            continue
        raw = None
        if a.raw_m is not None and b.raw_m is not None:
            raw = float(np.linalg.norm(a.raw_m - b.raw_m)) - true_m
        started = time.perf_counter()
        for one in (a, b):  # what two clicks cost: the rays, then the interval
            mark_on_ray(surface, one.mark.point_m + 0.01 * one.mark.normal, -one.mark.normal)
        measure = distance(surface, a.mark, b.mark)
        elapsed_s = time.perf_counter() - started
        rows.append(_row(measure, true_m, elapsed_s) | {"raw_error": raw})
    return rows


def _with_planes(surface: MeasuredSurface, ends: Sequence[Click], flat: Sequence[Click]) -> list[Row]:
    """Return the rows of heights of clicks over planes, and of angles of two planes."""
    rows: list[Row] = []
    previous: tuple[Click, Plane] | None = None
    for click, end in zip(flat, reversed(ends), strict=False):
        if len(rows) >= 2 * PLANES:
            break
        started = time.perf_counter()
        try:
            plane = plane_at(surface, click.mark.point_m)
        except InputError:
            continue
        grown_s = time.perf_counter() - started
        height_m = abs(float((end.true_m - click.true_m) @ click.true_normal))
        if height_m >= SHORTEST_M:
            rows.append(_row(point_to_plane(surface, end.mark, plane), height_m, grown_s))
        if previous is not None:
            before, other = previous
            cosine = float(np.clip(click.true_normal @ before.true_normal, -1.0, 1.0))
            angle_deg = 180.0 - float(np.degrees(np.arccos(cosine)))
            if 5.0 < angle_deg < 175.0:
                rows.append(_row(angle_of_planes(surface, plane, other), angle_deg, grown_s))
        previous = click, plane
    return rows


def _row(measure: Measure, true: float, elapsed_s: float) -> Row:
    one = measure.values[0]
    low, high = one.ci95
    return {
        "kind": measure.kind,
        "guessed": one.guessed,
        "value": one.value,
        "true": true,
        "low": low,
        "high": high,
        "covered": bool(low <= true <= high),
        "elapsed_s": elapsed_s,
    }


def summaries(rows: Sequence[Row]) -> list[Row]:
    """Return coverage, errors and times of every kind of measure, measured and guessed apart.

    The interval of a coverage resamples rooms, whose measures err together.
    """
    groups: dict[tuple[str, bool], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["kind"], row["guessed"]), []).append(row)
    return [_summary(kind, guessed, some) for (kind, guessed), some in sorted(groups.items())]


def _summary(kind: str, guessed: bool, rows: Sequence[Row]) -> Row:
    errors = np.array([abs(row["value"] - row["true"]) for row in rows])
    both = [row for row in rows if row.get("raw_error") is not None]
    ratio = None
    if both:
        ours, raw = (float(np.median([abs(of(row)) for row in both])) for of in (_error, _raw_error))
        ratio = ours / raw
    return {
        "kind": kind,
        "guessed": guessed,
        "measures": len(rows),
        "rooms": len({row["room"] for row in rows}),
        "coverage": float(np.mean([row["covered"] for row in rows])),
        "coverage_ci95": _by_rooms(rows),
        "median_error": float(np.median(errors)),
        "p95_error": float(np.percentile(errors, 95.0)),
        "median_half_width": float(np.median([0.5 * (row["high"] - row["low"]) for row in rows])),
        "error_over_raw": ratio,
        "median_s": float(np.median([row["elapsed_s"] for row in rows])),
        "p95_s": float(np.percentile([row["elapsed_s"] for row in rows], 95.0)),
    }


def _error(row: Row) -> float:
    return float(row["value"] - row["true"])


def _raw_error(row: Row) -> float:
    return float(row["raw_error"])


def _by_rooms(rows: Sequence[Row]) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of the coverage over whole rooms."""
    rooms: dict[int, list[bool]] = {}
    for row in rows:
        rooms.setdefault(row["room"], []).append(row["covered"])
    counts = np.array([(sum(some), len(some)) for some in rooms.values()], float)
    rng = np.random.default_rng(0)
    drawn = counts[rng.integers(0, len(counts), (2000, len(counts)))].sum(axis=1)
    low, high = np.percentile(drawn[:, 0] / drawn[:, 1], (2.5, 97.5))
    return float(low), float(high)
