"""Tables of the bytes, seconds and joules until a surface is nearly that without losses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from lab.between_cameras.tables import DEMO_ROOMS, RANDOM_ROOMS, mean, ranged
from lab.worth.trials import OWN, Row

COSTS = {"image_bytes": "kB of the images", "seconds": "s", "joules": "J"}
SCALES = {"image_bytes": 1e-3, "seconds": 1.0, "joules": 1.0}


def measures(rows: Sequence[Row]) -> dict[str, Any]:
    """Return means over the rigs of each kind of rooms, with the limits of their 95 % intervals.

    ``rows`` has an entry for each network, loss, target and order: kB of all nodes' images, seconds and
    joules, each the mean of a rig's seeds first, and ``of_own``, the kB as a share of those of the same rig
    in the coding's own order. ``first`` has the F-score with the base layers and the fewest tiles, as a share
    of that without losses.
    """
    entries, first = [], []
    for kind, some in _by_kind(rows).items():
        for order in dict.fromkeys(row["order"] for row in some):
            of_order = [row for row in some if row["order"] == order]
            first.append({"rooms": kind, "order": order} | _first(of_order))
            for network, loss, target in _conditions(of_order):
                entries.append(
                    {"rooms": kind, "network": network, "loss": loss, "target": target, "order": order}
                    | _costs(some, order, network, loss, target)
                )
    return {"rows": entries, "first": first}


def lines(found: dict[str, Any]) -> Iterator[str]:
    """Yield the numbers of ``measures`` as text."""
    for entry in found["first"]:
        yield (
            f"{entry['rooms']}, {entry['order']}: with the base layers and {entry['share']:.1%} of the depth "
            f"{ranged(entry['of_lossless'], signed=False)} of the F-score"
        )
    for entry in found["rows"]:
        costs = "; ".join(
            f"{ranged(entry[name], signed=False)} {title}" for name, title in COSTS.items() if name in entry
        )
        yield (
            f"{entry['rigs']} {entry['rooms']}, {entry['network']}, {entry['loss']:.0%} lost, "
            f"{entry['target']:.0%} of F, {entry['order']}: {costs}"
        )


def _by_kind(rows: Sequence[Row]) -> dict[str, list[Row]]:
    kinds = {
        kind: [row for row in rows if row["rig"].startswith("room-") == random]
        for kind, random in ((DEMO_ROOMS, False), (RANDOM_ROOMS, True))
    }
    return {kind: some for kind, some in kinds.items() if some}


def _conditions(rows: Sequence[Row]) -> list[tuple[str, float, float]]:
    return sorted({(row["network"], row["loss"], row["target"]) for row in rows})


def _first(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the F-score at the lowest level as a share of that without losses, over rigs."""
    by_rig = {row["rig"]: row for row in rows}
    shares = [row["scores"][0][1] / row["f_score"] for row in by_rig.values()]
    return {"share": rows[0]["scores"][0][0], "of_lossless": _limits(shares), "least": min(shares)}


def _costs(rows: Sequence[Row], order: str, network: str, loss: float, target: float) -> dict[str, Any]:
    """Return the costs of one order in one condition, without rigs of which not everything arrived."""
    condition = (network, loss, target)
    here = [row for row in rows if (row["network"], row["loss"], row["target"]) == condition]
    mine = _by_rig([row for row in here if row["order"] == order])
    own = _by_rig([row for row in here if row["order"] == OWN])
    found: dict[str, Any] = {"rigs": len(mine), "colour_too": sum(_needs_all(some) for some in mine.values())}
    for name, scale in SCALES.items():
        values = [_mean_of(some, name) for some in mine.values()]
        known = [scale * value for value in values if value is not None]
        if known:
            found[name] = _limits(known)
    shares = []
    for rig, some in mine.items():
        value, base = _mean_of(some, "image_bytes"), _mean_of(own.get(rig, []), "image_bytes")
        if value is not None and base is not None:
            shares.append(value / base)
    return found | ({"of_own": _limits(shares)} if shares else {})


def _needs_all(rows: Sequence[Row]) -> bool:
    return rows[0]["share"] is None


def _by_rig(rows: Sequence[Row]) -> dict[str, list[Row]]:
    return {
        rig: [row for row in rows if row["rig"] == rig] for rig in dict.fromkeys(row["rig"] for row in rows)
    }


def _mean_of(rows: Sequence[Row], name: str) -> float | None:
    """Return the mean of a value over a rig's seeds; None if it is missing in one of them."""
    values = [row[name] for row in rows]
    return None if not values or None in values else float(np.mean(values))


def _limits(values: Sequence[float]) -> list[float]:
    value, (low, high) = mean(values)
    return [float(value), float(low), float(high)]
