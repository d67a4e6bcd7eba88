"""The table of docs/results.md about tiles that another camera of the rig shows."""

from __future__ import annotations

from lab.between_cameras.tables import DEMO_ROOMS, ranged
from lab.results.markdown import Cell, Row, table


def between_cameras(numbers: Row) -> str:
    """Return a table for each kind of rooms."""
    entries = numbers["rows"]
    parts = [
        "Rigs of three cameras, coding `exact`. Each method leaves out tiles of a camera that another one "
        "shows; *ours* is that of `deliver --leave-out-seen`, without the network. Its limits were chosen on "
        "validation rooms, like those of RPRR, in which a sender predicts its tiles from what other cameras "
        "have sent. *To the nodes*: bytes that nodes receive for the method. Differences of the F-score, in "
        "points, are to the same rig with all tiles sent; in brackets the 95 % interval over rigs, then the "
        "worst rig. *At the true poses* the clouds are merged at these poses; *by the chain* the clouds of "
        "what was sent are registered from the believed poses."
    ]
    for kind in dict.fromkeys(entry["rooms"] for entry in entries):
        some = [entry for entry in entries if entry["rooms"] == kind]
        held_out = "" if kind == DEMO_ROOMS else "held-out "
        parts += [f"**{some[0]['rigs']} {held_out}{kind}**", _table(some)]
    return "\n\n".join(parts)


def _table(entries: list[Row]) -> str:
    header = (
        *("believed poses", "method", "bytes saved, %", "to the nodes, kB"),
        *("F at 5 cm at the true poses", "F at 1 cm at the true poses", "F at 5 cm by the chain"),
        "cameras found off by, cm",
    )
    return table(header, [_row(entry) for entry in entries])


def _row(entry: Row) -> list[Cell]:
    start: list[Cell] = [entry["poses"], entry["method"]]
    shown = ("placed_f_score_5cm", "placed_f_score_1cm", "chain_f_score_5cm")
    if "levels" in entry:
        levels = entry["levels"]
        scores = [f"{levels[name]:.2f} %" if name in levels else None for name in shown]
        return [*start, f"of {entry['whole_kb']:.0f} kB", None, *scores, entry["found_cm"]]
    gained = entry["gained"]
    scores = [
        f"{ranged(gained[name][:3])}, {gained[name][3]:+.2f}" if name in gained else None for name in shown
    ]
    saved = ranged(entry["saved"]["bytes"], signed=False)
    return [*start, saved, entry["to_nodes_kb"], *scores, entry["found_cm"]]
