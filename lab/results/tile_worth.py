"""The tables of docs/results.md about the order in which the sink requests depth tiles."""

from __future__ import annotations

from lab.between_cameras.tables import DEMO_ROOMS, ranged
from lab.results.markdown import Cell, Row, percent, table

NAMES = {"own": "the coding's own", "worth": "by worth (`--order worth`)", "random": "random"}


def tile_worth(numbers: Row) -> str:
    """Return a table for each kind of rooms and each share of the F-score."""
    parts = [
        "Rigs of three cameras, coding `exact`, given poses off by some centimetres and degrees. The surface "
        "is that of the whole chain at 5 cm, from the base layers, their colours and the first depth tiles "
        "of each node; its F-score is measured at a few shares of the depth and interpolated between them. "
        "The coding `layered` begins with the same base layers and depth tiles in the same order, so these "
        "numbers hold for it until its colour begins. *kB*: bytes of all nodes' images, base layers "
        "included, until the surface has that share of the F-score; *of own*: these bytes as a share of "
        "those in the coding's own order, rig by rig. Seconds and joules of the nodes are those of the "
        "network model until the sink has as many bytes; lost packets are sent again; five seeds, losses in "
        "bursts of eight packets. *With colour*: rigs that need colour images, too; they count with all "
        "their bytes. In the order by worth, times include the wait for the sink's request and the second in "
        "which the sink computes it. In brackets the 95 % interval over rigs.",
        *(_first(entry) for entry in numbers["first"]),
    ]
    entries = numbers["rows"]
    for kind in dict.fromkeys(entry["rooms"] for entry in entries):
        for target in sorted({entry["target"] for entry in entries}):
            some = [entry for entry in entries if (entry["rooms"], entry["target"]) == (kind, target)]
            held_out = "" if kind == DEMO_ROOMS else "held-out "
            parts += [f"**{held_out}{kind}, until {percent(target)} of the F-score**", _table(some)]
    return "\n\n".join(parts)


def _first(entry: Row) -> str:
    held_out = "" if entry["rooms"] == DEMO_ROOMS else "held-out "
    shares = [100.0 * value for value in entry["of_lossless"]]
    return (
        f"With the base layers and {percent(entry['share'])} of the depth, {held_out}{entry['rooms']} have "
        f"{ranged(shares, signed=False)} % of the F-score, the worst rig {100.0 * entry['least']:.1f} % "
        f"(order: {NAMES[entry['order']]})."
    )


def _table(entries: list[Row]) -> str:
    header = ("network", "packets lost", "order", "rigs", "kB", "of own", "seconds", "joules")
    ordered = sorted(entries, key=lambda entry: (entry["network"], entry["loss"]))
    return table(header, [_row(entry) for entry in ordered])


def _row(entry: Row) -> list[Cell]:
    of_own = [100.0 * value for value in entry["of_own"]] if "of_own" in entry else None
    return [
        entry["network"],
        percent(entry["loss"]),
        NAMES[entry["order"]],
        f"{entry['rigs']}, {entry['colour_too']} with colour" if entry["colour_too"] else entry["rigs"],
        ranged(entry["image_bytes"], signed=False),
        None if of_own is None else f"{ranged(of_own, signed=False)} %",
        *(ranged(entry[name], signed=False) if name in entry else None for name in ("seconds", "joules")),
    ]
