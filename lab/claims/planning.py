"""D12 and D13: the gain that a planned camera promises, compared with its real gain (SPEC 12)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from lab.between_cameras.rigs import room_seeds
from lab.claims.claim import Claim, Outcome, bootstrap_ci95, mean_curve
from lab.claims.exhibits import Chart, plain_curve
from lab.planning.judging import SUGGESTIONS, Row, judged_room
from lab.planning.measures import choice_good, measures, promise_kept
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.types import FloatArray

FIRST_ROOM, ROOMS = 60, 20
"""The judged rooms of the split ``test``: earlier rooms set the promise's constants, or showed its faults."""
FEW_ROOMS = 3
"""Number of rooms that are judged by default; each takes some minutes."""
STEPS = 5
"""Number of steps of the promise in the chart."""
RESAMPLES = 200


def few_rooms(folder: Path, scheduler: str | None) -> Generator[Progress, None, list[Row]]:
    """Judge ten suggestions in each of a few rooms."""
    return (yield from _rooms(FEW_ROOMS, folder, scheduler))


def all_rooms(folder: Path, scheduler: str | None) -> Generator[Progress, None, list[Row]]:
    """Judge ten suggestions in each of twenty rooms."""
    return (yield from _rooms(ROOMS, folder, scheduler))


def _rooms(count: int, folder: Path, scheduler: str | None) -> Generator[Progress, None, list[Row]]:
    seeds = room_seeds("test", FIRST_ROOM + count)[FIRST_ROOM:]
    found = yield from iterate_trials("D12, D13, planned cameras", judged_room, seeds, folder, scheduler)
    return [row for rows in found for row in rows]


def judge_promise(rows: Sequence[Row]) -> Outcome:
    """Return D12's numbers and verdict."""
    names = ("rank_correlation", "mean_absolute_error_points", "inside_interval")
    return _outcome(rows, names, promise_kept(measures(rows)), promise_chart(rows))


def judge_choice(rows: Sequence[Row]) -> Outcome:
    """Return D13's numbers and verdict."""
    names = ("best_real_points", "others_real_points", "share_of_search")
    return _outcome(rows, names, choice_good(measures(rows)), ranking_chart(rows))


def _outcome(rows: Sequence[Row], names: Sequence[str], verdict: tuple[bool, str], picture: Chart) -> Outcome:
    room = np.array([row["room"] for row in rows])
    rooms = [[rows[int(k)] for k in np.flatnonzero(room == one)] for one in np.unique(room)]
    every = np.arange(float(len(rooms)))
    ci95 = {
        name: bootstrap_ci95(every, resamples=RESAMPLES, statistic=partial(_drawn, rooms, name))
        for name in names
    }
    holds, why = verdict
    return Outcome(measures(rows), ci95, holds, why, (picture,))


def _drawn(rooms: Sequence[Sequence[Row]], name: str, picks: FloatArray, axis: int) -> list[float]:
    """Return one of the measures for every draw of rooms; a room that is drawn twice counts as two."""
    draws = [
        [row | {"room": place} for place, one in enumerate(draw) for row in rooms[int(one)]] for draw in picks
    ]
    return [measures(draw)[name] for draw in draws]


def promise_chart(rows: Sequence[Row]) -> Chart:
    """Return a chart of the mean real gain over the mean promise, by fifths of the promise."""
    promised, real = (np.array([float(row[name]) for row in rows]) for name in ("promised", "real"))
    steps = np.array_split(np.argsort(promised, kind="stable"), STEPS)
    most = float(promised.max())
    return Chart(
        "Real gain against promise",
        "mean promise, points",
        "mean real gain, points",
        (
            plain_curve("equal", (0.0, most), (0.0, most)),
            mean_curve(
                "suggestions, by fifths",
                [promised[step].mean() for step in steps],
                [real[step] for step in steps],
            ),
        ),
        "Points: hundredths of the present cameras' rays.",
    )


def ranking_chart(rows: Sequence[Row]) -> Chart:
    """Return a chart of promise and real gain down the planner's ranking."""
    rank = np.array([int(row["rank"]) for row in rows])
    places = np.unique(rank)
    curves = [
        mean_curve(
            label, places, [np.array([float(row[name]) for row in rows])[rank == one] for one in places]
        )
        for label, name in (("promised", "promised"), ("real", "real"))
    ]
    return Chart(
        "Gain down the ranking",
        f"place among {SUGGESTIONS} suggestions (0: the planner's choice)",
        "gain, points",
        tuple(curves),
        "Points: hundredths of the present cameras' rays.",
    )


D12 = Claim(
    id="D12",
    claim="A planned camera gives what its plan promises",
    thesis="ours beyond the thesis, which places no cameras",
    tolerance=(
        "ten suggestions a room: rank correlation of promised and real gain at least .85, mean error at most "
        "1 point of rays, at least 90 % of real gains in their 95 % interval"
    ),
    experiment=judge_promise,
    prepare=few_rooms,
    prepare_full=all_rooms,
)
D13 = Claim(
    id="D13",
    claim="The camera that the plan chooses is the one to buy",
    thesis="ours beyond the thesis, which places no cameras",
    tolerance=(
        "its real gain above the mean of nine other suggestions in every room, and at least 95 % of what an "
        "exhaustive search over up to 500 places finds"
    ),
    experiment=judge_choice,
    prepare=few_rooms,
    prepare_full=all_rooms,
)
