"""The list of measures as text for the page's address.

``distance~edge~1234_-567_890~1300_-500_880~.Table~t2000``: kind, snap, clicked points in millimetres, then
if needed ``nPART`` (index of the clicked surface), ``.NAME`` and ``tTRUE`` (true length by which all lengths
are scaled, tenths of a millimetre). ``~~`` separates measures.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING
from urllib.parse import quote_plus

from app.compute.measures import Place, Scale, Taken, Tape
from app.measuring.kinds import KINDS, SNAPS, steps_of
from packetmesh.errors import InputError

if TYPE_CHECKING:
    from pipeline.measuring.marks import Snap
    from pipeline.measuring.measures import Kind

LONGEST_NAME = 40
MOST_LETTERS = 2000
"""Most letters of a list in an address, which has the lists of three screens; a page's whole address has at
most 7,168, and servers take 8,192."""
EXAMPLE = "distance~surface~100_200_300~400_500_600"
_POINT = re.compile(r"(-?\d{1,7})_(-?\d{1,7})_(-?\d{1,7})")
_KINDS: Mapping[str, Kind] = {kind: kind for kind in KINDS.values()}
_SNAPS: Mapping[str, Snap] = {snap: snap for snap in SNAPS.values()}
_PART, _TRUE = re.compile(r"n(\d{1,3})"), re.compile(r"t([1-9]\d{0,7})")


def text_of(tape: Tape) -> str:
    """Return the list as text; empty without a measure."""
    return "~~".join(_text(taken, tape.scale) for taken in tape.taken)


def fits(tape: Tape) -> bool:
    """Whether an address has room for the list."""
    return len(quote_plus(text_of(tape))) <= MOST_LETTERS


def name_of(text: str) -> str:
    """Return a typed name without ``~`` and extra spaces, cut to ``LONGEST_NAME`` letters."""
    return re.sub(r"\s+", " ", text.replace("~", "-")).strip()[:LONGEST_NAME]


def tape_of(text: str) -> Tape:
    """Return the list in an address.

    Raises:
        InputError: the text is no list of measures.
    """
    taken, scale = list[Taken](), None
    for part in text.split("~~") if text else ():
        one, true_m = _taken(part)
        taken.append(one)
        if true_m is not None:
            scale = Scale(one.unnamed, true_m)
    tape = Tape(tuple(taken), scale)
    if not fits(tape):
        raise InputError(f"The address has more than {MOST_LETTERS} letters of measures; leave some out")
    return tape


def _text(taken: Taken, scale: Scale | None) -> str:
    points = ["_".join(str(round(1000.0 * value)) for value in point_m) for point_m in taken.points_m]
    words = [taken.kind, taken.snap, *points]
    words += [f"n{taken.part}"] if taken.part else []
    words += [f".{taken.name}"] if taken.name else []
    words += [f"t{round(1e4 * scale.true_m)}"] if scale is not None and scale.by == taken.unnamed else []
    return "~".join(words)


def _taken(text: str) -> tuple[Taken, float | None]:
    """Return one measure, and its true length if all lengths are scaled by it."""
    wrong = InputError(f"The address has the measures {text[:60]}; try measures such as {EXAMPLE}")
    first, second, *words = [*text.split("~"), ""]
    kind, snap = _KINDS.get(first), _SNAPS.get(second)
    if kind is None or snap is None:
        raise wrong
    points, part, name, true_m = list[Place](), 0, "", None
    for word in filter(None, words):
        if found := _POINT.fullmatch(word):
            x_m, y_m, z_m = (int(value) / 1000.0 for value in found.groups())
            points.append((x_m, y_m, z_m))
        elif found := _PART.fullmatch(word):
            part = int(found[1])
        elif found := _TRUE.fullmatch(word):
            true_m = int(found[1]) / 1e4
        elif word.startswith("."):
            name = name_of(word[1:])
        else:
            raise wrong
    if len(points) != len(steps_of(kind, snap)):
        raise wrong
    return Taken(kind, snap, tuple(points), part, name), true_m
