"""Tables of bytes saved and of what they cost the mesh."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from lab.between_cameras.trials import ALL_TILES, Row
from lab.claims.delivery.statistics import Estimate, estimate, mean_terms

SHARES = {"bytes saved": "bytes", "depth bytes saved": "depth_bytes", "tiles": "tiles"}
MESHES = {"placed": "at the true poses", "chain": "by the chain"}
MEASURES = {"f_score_5cm": "F at 5 cm", "f_score_1cm": "F at 1 cm"}
DEMO_ROOMS, RANDOM_ROOMS = "demo rooms", "random rooms"


def measures(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the means over rigs of each kind of rooms, believed poses and method.

    ``saved`` are shares of what all tiles take, in per cent; ``gained`` are points of F-score, each the
    difference of a rig with itself, all tiles being sent, with the worst rig's last; both with the limits of
    the 95 % interval over rigs. ``levels`` are the F-scores in per cent.
    """
    entries = []
    for kind, some in _by_kind(rows).items():
        for poses, method in dict.fromkeys((str(row["poses"]), str(row["method"])) for row in some):
            whole = {row["rig"]: row for row in some if (row["poses"], row["method"]) == (poses, ALL_TILES)}
            chosen = [row for row in some if (row["poses"], row["method"]) == (poses, method)]
            entries.append(
                {"rooms": kind, "rigs": len(chosen), "poses": poses, "method": method}
                | _measured_of(chosen, {} if method == ALL_TILES else whole)
            )
    return {"rows": entries}


def lines(rows: Sequence[Row]) -> Iterator[str]:
    """Yield a table of ``measures`` as text."""
    found = measures(rows)["rows"]
    for kind in dict.fromkeys(entry["rooms"] for entry in found):
        of_kind = [entry for entry in found if entry["rooms"] == kind]
        yield f"{of_kind[0]['rigs']} {kind}"
        for poses in dict.fromkeys(entry["poses"] for entry in of_kind):
            yield f"  believed poses: {poses}"
            for entry in of_kind:
                if entry["poses"] == poses:
                    yield f"    {entry['method']}: " + "; ".join(_parts(entry))


def _by_kind(rows: Sequence[Row]) -> dict[str, list[Row]]:
    kinds: dict[str, list[Row]] = {}
    for kind, random in ((DEMO_ROOMS, False), (RANDOM_ROOMS, True)):
        some = [row for row in rows if str(row["rig"]).startswith("room-") == random]
        if some:
            kinds[kind] = some
    return kinds


def _measured_of(rows: Collection[Row], whole: dict[str | float, Row]) -> dict[str, Any]:
    """Return the means of one method's rows; ``whole`` are those of the same rigs with all tiles, if any."""
    found: dict[str, Any] = {
        "whole_kb": float(np.mean([_number(row, "whole_bytes") for row in rows]) / 1e3),
        "to_nodes_kb": float(np.mean([_number(row, "told_bytes") for row in rows]) / 1e3),
        "believed_cm": float(100.0 * np.mean([_number(row, "believed_error_m") for row in rows])),
        "found_cm": float(100.0 * np.mean([_number(row, "camera_error_m") for row in rows])),
    }
    names = [f"{way}_{name}" for way in MESHES for name in MEASURES]
    names = [name for name in names if any(name in row for row in rows)]
    if not whole:
        levels = {name: float(100.0 * np.mean([_number(row, name) for row in rows])) for name in names}
        return found | {"levels": levels}
    saved = {
        name: _limits(mean(100.0 * _number(row, name) for row in rows))
        for name in ("bytes", "depth_bytes", "tiles")
    }
    gained = {}
    for name in names:
        gains = [100.0 * (_number(row, name) - _number(whole[row["rig"]], name)) for row in rows]
        gained[name] = [*_limits(mean(gains)), min(gains)]
    return found | {"saved": saved, "gained": gained}


def _parts(entry: dict[str, Any]) -> Iterator[str]:
    """Yield the numbers of one method in words."""
    if "levels" in entry:
        yield f"{entry['whole_kb']:.0f} kB a rig"
        for name, value in entry["levels"].items():
            yield f"{titled(name)} {value:.2f} %"
    else:
        for title, name in SHARES.items():
            yield f"{title} {ranged(entry['saved'][name], signed=False)} %"
        yield f"{entry['to_nodes_kb']:.2f} kB to nodes"
        for name, (*limits, worst) in entry["gained"].items():
            yield f"{titled(name)} {ranged(limits)}, worst {worst:+.2f}"
    yield f"cameras believed {entry['believed_cm']:.2f} cm off, found {entry['found_cm']:.2f} cm off"


def titled(name: str) -> str:
    """Return the title of a mesh's measure, by its name in a row."""
    way, _, measure = name.partition("_")
    return f"{MEASURES[measure]} {MESHES[way]}"


def mean(values: Iterable[float]) -> Estimate:
    """Return the mean of one value a rig, with its 95 % interval over rigs."""
    return estimate([mean_terms([value]) for value in values])


def ranged(limits: Sequence[float], signed: bool = True) -> str:
    """Return a mean, and the limits of its interval, as text."""
    sign = "+" if signed else ""
    value, low, high = limits
    return f"{value:{sign}.2f} ({low:{sign}.2f} to {high:{sign}.2f})"


def _limits(found: Estimate) -> list[float]:
    value, (low, high) = found
    return [float(value), float(low), float(high)]


def _number(row: Row, name: str) -> float:
    """Return a number of a row; 0 without one: no mesh has an F-score of 0."""
    return float(row.get(name) or 0.0)
