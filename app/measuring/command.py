"""Command lines of ``packetmesh measure`` that take the measures of a list."""

from __future__ import annotations

from collections.abc import Iterator

from app.compute.measures import Place, Taken, Tape
from app.measuring.kinds import steps_of

OPTIONS = {"point": "--points", "plane": "--planes", "rim": "--hole", "part": "--box"}
"""Options by what a click marks."""


def measure_commands(tape: Tape, run: str) -> str:
    """Return a line for each measure, at the reconstruction's own scale.

    Args:
        tape: measures on the surface after fusion.
        run: folder of the reconstruction.
    """
    return "\n".join(" ".join(["packetmesh", "measure", run, *_words(taken)]) for taken in tape.taken)


def _words(taken: Taken) -> Iterator[str]:
    places = dict[str, list[Place]]()
    for step, place in zip(steps_of(taken.kind, taken.snap), taken.points_m, strict=True):
        places.setdefault(OPTIONS[step.marks], []).append(place)
    for option, found in places.items():
        yield option
        yield from (",".join(f"{value:.3f}" for value in place) for place in found)
    if "--points" in places and taken.snap != "surface":
        yield from ("--snap", taken.snap)
