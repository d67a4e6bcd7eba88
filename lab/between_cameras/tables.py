"""Tables of bytes saved and of what they cost the mesh."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence

import numpy as np

from lab.between_cameras.trials import ALL_TILES, Row
from lab.claims.delivery.statistics import Estimate, estimate, mean_terms

SHARES = {"bytes saved": "bytes", "depth bytes saved": "depth_bytes", "tiles": "tiles"}
MESHES = {"placed": "at the true poses", "chain": "by the chain"}
MEASURES = {"f_score_5cm": "F at 5 cm", "f_score_1cm": "F at 1 cm"}


def lines(rows: Sequence[Row]) -> Iterator[str]:
    """Yield a table of rows' means over rigs: shares saved, %, and points of F-score gained by the masks.

    Each difference is that of a rig with itself, all tiles being sent; its 95 % interval is over rigs.
    """
    kinds = {"demo rooms": lambda name: not name.startswith("room-")}
    kinds["random rooms"] = lambda name: name.startswith("room-")
    for title, of_kind in kinds.items():
        some = [row for row in rows if of_kind(str(row["rig"]))]
        if not some:
            continue
        yield f"{len({row['rig'] for row in some})} {title}"
        for poses in dict.fromkeys(str(row["poses"]) for row in some):
            yield f"  believed poses: {poses}"
            whole = {row["rig"]: row for row in some if (row["poses"], row["method"]) == (poses, ALL_TILES)}
            yield f"    {ALL_TILES}: " + "; ".join(_levels(whole.values()))
            for method in dict.fromkeys(str(row["method"]) for row in some):
                chosen = [row for row in some if (row["poses"], row["method"]) == (poses, method)]
                if chosen and method != ALL_TILES:
                    yield f"    {method}: " + "; ".join([*_saved(chosen), *_gained(chosen, whole)])


def _levels(rows: Collection[Row]) -> Iterator[str]:
    yield f"{np.mean([_number(row, 'whole_bytes') for row in rows]) / 1e3:.0f} kB a rig"
    for way, measure in _measured(rows):
        values = [100.0 * _number(row, f"{way}_{measure}") for row in rows]
        yield f"{MEASURES[measure]} {MESHES[way]} {np.mean(values):.2f} %"
    yield _cameras(rows)


def _saved(rows: Collection[Row]) -> Iterator[str]:
    for title, name in SHARES.items():
        yield f"{title} {_ranged(mean(100.0 * _number(row, name) for row in rows), signed=False)} %"
    yield f"{np.mean([_number(row, 'told_bytes') for row in rows]) / 1e3:.2f} kB to nodes"


def _gained(rows: Collection[Row], whole: dict[str | float, Row]) -> Iterator[str]:
    for way, measure in _measured(rows):
        name = f"{way}_{measure}"
        gains = [100.0 * (_number(row, name) - _number(whole[row["rig"]], name)) for row in rows]
        yield f"{MEASURES[measure]} {MESHES[way]} {_ranged(mean(gains))}, worst {min(gains):+.2f}"
    yield _cameras(rows)


def _measured(rows: Collection[Row]) -> list[tuple[str, str]]:
    """Return the meshes and measures that the rows have."""
    return [(way, name) for way in MESHES for name in MEASURES if any(f"{way}_{name}" in row for row in rows)]


def _cameras(rows: Collection[Row]) -> str:
    believed, found = (
        100.0 * np.mean([_number(row, name) for row in rows])
        for name in ("believed_error_m", "camera_error_m")
    )
    return f"cameras believed {believed:.2f} cm off, found {found:.2f} cm off"


def mean(values: Iterable[float]) -> Estimate:
    """Return the mean of one value a rig, with its 95 % interval over rigs."""
    return estimate([mean_terms([value]) for value in values])


def _ranged(found: Estimate, signed: bool = True) -> str:
    value, (low, high) = found
    sign = "+" if signed else ""
    return f"{value:{sign}.2f} ({low:{sign}.2f} to {high:{sign}.2f})"


def _number(row: Row, name: str) -> float:
    """Return a number of a row; 0 without one: no mesh has an F-score of 0."""
    return float(row.get(name) or 0.0)
