"""How promises and outcomes compare, over all rooms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import spearmanr

from lab.planning.judging import Row
from pipeline.types import FloatArray


def measures(rows: Sequence[Row]) -> dict[str, float]:
    """Return how the promises of suggestions in several rooms compare with their real gains.

    Points are per cent of the present cameras' rays. ``rank_correlation`` is Spearman's over all suggestions,
    ``share_of_search`` what the best suggestions measure in the exhaustive search over its best, summed over
    rooms.
    """
    room, rank = _column(rows, "room"), _column(rows, "rank")
    promised, real = _column(rows, "promised"), _column(rows, "real")
    inside = (real >= _column(rows, "low")) & (real <= _column(rows, "high"))
    rooms = np.unique(room)
    by_room = [spearmanr(promised[room == one], real[room == one])[0] for one in rooms]
    best = np.array([real[(room == one) & (rank == 0)][0] for one in rooms])
    others = np.array([real[(room == one) & (rank > 0)].mean() for one in rooms])
    searched, most = _column(rows, "searched")[rank == 0], _column(rows, "best_searched")[rank == 0]
    return {
        "rooms": float(len(rooms)),
        "suggestions": float(len(rows)),
        "rank_correlation": float(spearmanr(promised, real)[0]),
        "rank_correlation_in_room": float(np.mean(by_room)),
        "mean_absolute_error_points": float(np.abs(promised - real).mean()),
        "mean_error_points": float((promised - real).mean()),
        "inside_interval": float(inside.mean()),
        "placed": float(_column(rows, "placed").mean()),
        "best_real_points": float(best.mean()),
        "others_real_points": float(others.mean()),
        "rooms_best_above": float((best > others).sum()),
        "share_of_search": float(searched.sum() / most.sum()),
    }


def promise_kept(found: Mapping[str, float]) -> tuple[bool, str]:
    """Return whether promises are kept (claim D12), by ``measures``, and a sentence that says why."""
    holds = (
        found["rank_correlation"] >= 0.85
        and found["mean_absolute_error_points"] <= 1.0
        and found["inside_interval"] >= 0.9
    )
    return holds, (
        f"of {found['suggestions']:.0f} suggestions in {found['rooms']:.0f} rooms, promise and real gain "
        f"have a rank correlation of {found['rank_correlation']:.2f} and are "
        f"{found['mean_absolute_error_points']:.2f} points apart in the mean; "
        f"{found['inside_interval']:.1%} of the real gains are in their interval"
    )


def choice_good(found: Mapping[str, float]) -> tuple[bool, str]:
    """Return whether the planner's choice is good (claim D13), by ``measures``, and a sentence why."""
    holds = found["rooms_best_above"] == found["rooms"] and found["share_of_search"] >= 0.95
    return holds, (
        f"the choice gives {found['best_real_points']:.2f} points in the mean and the others "
        f"{found['others_real_points']:.2f}; it is above their mean in {found['rooms_best_above']:.0f} of "
        f"{found['rooms']:.0f} rooms and has {found['share_of_search']:.1%} of the best that a search finds"
    )


def _column(rows: Sequence[Row], name: str) -> FloatArray:
    return np.array([float(row[name]) for row in rows])
