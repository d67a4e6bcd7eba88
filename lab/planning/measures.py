"""How promises and outcomes compare, over all rooms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import spearmanr

from lab.planning.judging import Row
from pipeline.types import FloatArray


def measures(rows: Sequence[Row]) -> dict[str, float]:
    """Return how the promises of suggestions in several rooms compare with what came of them.

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


def _column(rows: Sequence[Row], name: str) -> FloatArray:
    return np.array([float(row[name]) for row in rows])
