"""Errors and interval coverage of the measures in a room, by their true values."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from lab.measuring.clicks import Click, clicks
from lab.measuring.rooms import measured_room
from lab.measuring.things import true_boxes, true_holes
from packetmesh.errors import InputError
from pipeline.measuring.marks import mark_on_ray
from pipeline.measuring.measures import (
    Measure,
    Value,
    angle,
    angle_of_planes,
    are_parallel,
    distance,
    plane_to_plane,
    point_to_plane,
)
from pipeline.measuring.planes import Plane, plane_at
from pipeline.measuring.surface import MeasuredSurface
from pipeline.types import FloatArray

LENGTHS = 30
"""Most lengths of each of two kinds in a room: with both ends measured, and with at least one guessed."""
PLANES = 12
"""Most heights over a plane, angles of two planes, and gaps of two planes in a room, of each."""
CORNERS = 12
"""Most angles of three points in a room."""
PARALLEL_DEG = 0.5
"""Two planes whose true angle is smaller count as parallel, with a true distance."""
UNITS = {"angle": ("°", 1.0), "corner": ("°", 1.0), "hole": (" cm²", 1e4)}
"""Displayed unit of a kind of measure, and the factor to it from the unit of the value (degrees, m^2). The
other kinds are in metres and are displayed in mm."""
SHORTEST_M = 0.1
MOST_CLICKS = 3000
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class RoomTask:
    """A room to judge, by its seed."""

    seed: int


def judged_room(task: RoomTask) -> list[Row] | None:
    """Return a row for every measure of a room; None if ``measured_room`` returns none."""
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
    flat = [click for click in measured if click.true_normal is not None][: 6 * PLANES]
    others = [
        *_with_planes(room.surface, measured, flat),
        *_corners(room.surface, measured),
        *(
            _row(value, "box", true_m, elapsed_s)
            for measure, sides_m, elapsed_s in true_boxes(room)
            for value, true_m in zip(measure.values, sides_m, strict=True)
        ),
        *(
            _row(measure.values[0], "hole", area_m2, elapsed_s)
            for measure, (area_m2,), elapsed_s in true_holes(room)
        ),
    ]
    return rows + [{"room": task.seed} | row for row in others]


def _lengths(surface: MeasuredSurface, firsts: Sequence[Click], seconds: Sequence[Click]) -> list[Row]:
    """Return the rows of lengths from some clicks to others; each starts and ends at most one."""
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
        for one in (a, b):  # time of two clicks: casting their rays, then the interval
            mark_on_ray(surface, one.mark.point_m + 0.01 * one.mark.normal, -one.mark.normal)
        measure = distance(surface, a.mark, b.mark)
        elapsed_s = time.perf_counter() - started
        rows.append(_row(measure.values[0], measure.kind, true_m, elapsed_s) | {"raw_error": raw})
    return rows


def _with_planes(surface: MeasuredSurface, ends: Sequence[Click], flat: Sequence[Click]) -> list[Row]:
    """Return the rows of heights of clicks over planes, and of angles and gaps of two planes.

    Their time is that of growing one plane.
    """
    kinds: dict[str, list[Row]] = {"point-plane": [], "angle": [], "plane-plane": []}
    before: list[tuple[Click, Plane]] = []

    def add(measure: Measure, true: float, elapsed_s: float) -> None:
        if len(kinds[measure.kind]) < PLANES:
            kinds[measure.kind].append(_row(measure.values[0], measure.kind, true, elapsed_s))

    for click, end in zip(flat, reversed(ends), strict=False):
        started = time.perf_counter()
        try:
            plane = plane_at(surface, click.mark.point_m)
        except InputError:
            continue
        grown_s = time.perf_counter() - started
        height_m = abs(float((end.true_m - click.true_m) @ _normal(click)))
        if height_m >= SHORTEST_M:
            add(point_to_plane(surface, end.mark, plane), height_m, grown_s)
        if before:
            angle_deg = 180.0 - _angle_deg(_normal(click), _normal(before[-1][0]))
            if 5.0 < angle_deg < 175.0:
                add(angle_of_planes(surface, plane, before[-1][1]), angle_deg, grown_s)
        for earlier, other in before:
            gap_m = abs(float((earlier.true_m - click.true_m) @ _normal(click)))
            apart_deg = _angle_deg(_normal(click), _normal(earlier))
            parallel = min(apart_deg, 180.0 - apart_deg) < PARALLEL_DEG and are_parallel(plane, other)
            if parallel and gap_m >= SHORTEST_M:
                add(plane_to_plane(surface, plane, other), gap_m, grown_s)
                break
        before.append((click, plane))
    return [row for rows in kinds.values() for row in rows]


def _corners(surface: MeasuredSurface, found: Sequence[Click]) -> list[Row]:
    """Return the rows of angles of three clicks; each click is in at most one angle."""
    rows: list[Row] = []
    for a, corner, b in zip(found[::3], found[1::3], found[2::3], strict=False):
        sides_m = [a.true_m - corner.true_m, b.true_m - corner.true_m]
        if len(rows) == CORNERS:
            break
        if min(np.linalg.norm(side_m) for side_m in sides_m) < SHORTEST_M:
            continue
        started = time.perf_counter()
        measure = angle(surface, a.mark, corner.mark, b.mark)
        elapsed_s = time.perf_counter() - started
        rows.append(_row(measure.values[0], "corner", _angle_deg(*sides_m), elapsed_s))
    return rows


def _normal(click: Click) -> FloatArray:
    assert click.true_normal is not None
    return click.true_normal


def _angle_deg(one: FloatArray, other: FloatArray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other)), one @ other)))


def _row(value: Value, kind: str, true: float, elapsed_s: float) -> Row:
    low, high = value.ci95
    return {
        "kind": kind,
        "guessed": value.guessed,
        "value": value.value,
        "true": true,
        "low": low,
        "high": high,
        "covered": bool(low <= true <= high),
        "elapsed_s": elapsed_s,
    }


def summaries(rows: Sequence[Row]) -> list[Row]:
    """Return coverage, errors and times of every kind of measure, separately for measured and guessed ones.

    The interval of a coverage resamples whole rooms, because the errors in a room are correlated.
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
    """Return the 95 % bootstrap interval of the coverage, which resamples whole rooms."""
    rooms: dict[int, list[bool]] = {}
    for row in rows:
        rooms.setdefault(row["room"], []).append(row["covered"])
    counts = np.array([(sum(some), len(some)) for some in rooms.values()], float)
    rng = np.random.default_rng(0)
    drawn = counts[rng.integers(0, len(counts), (2000, len(counts)))].sum(axis=1)
    low, high = np.percentile(drawn[:, 0] / drawn[:, 1], (2.5, 97.5))
    return float(low), float(high)
