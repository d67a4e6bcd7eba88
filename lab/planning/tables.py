"""How promises and outcomes compare, over all rooms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import spearmanr

from lab.planning.judging import Row
from pipeline.types import FloatArray


def lines(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the measures of ``measures``, one a line."""
    for name, value in measures(rows).items():
        yield f"{name}: {value:.3f}"


def measures(rows: Sequence[Row]) -> dict[str, float]:
    """Return rank correlations, errors in points of rays, and shares, of suggestions in several rooms."""
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
        "rank correlation, all suggestions": float(spearmanr(promised, real)[0]),
        "rank correlation within a room, mean": float(np.mean(by_room)),
        "mean absolute error, points": float(np.abs(promised - real).mean()),
        "mean error, points": float((promised - real).mean()),
        "real gain inside the 95 % interval": float(inside.mean()),
        "placed by registration": float(_column(rows, "placed").mean()),
        "best suggestion, mean real gain, points": float(best.mean()),
        "other suggestions, mean real gain, points": float(others.mean()),
        "rooms where the best is above the mean of the others": float((best > others).sum()),
        "best suggestion's share of the exhaustive search's best": float(searched.sum() / most.sum()),
    }


def _column(rows: Sequence[Row], name: str) -> FloatArray:
    return np.array([float(row[name]) for row in rows])
