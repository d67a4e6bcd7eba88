"""Lessons: markdown files whose sections set the race's controls and say what to look at.

A lesson is a ``# title`` and sections. A section is a ``## title``, lines ``set: name = value`` and its
text. What a section does not set is at its default, so that every stop can be shown by itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from app.jobs.records import Race, Rival, Start
from app.racewords import DIRECTIONS, MODES, MOST_LANES, RIVALS, STARTS
from pipeline.errors import InputError

LESSONS = Path(__file__).resolve().parents[1] / "assets" / "lessons"
SHIPPED = LESSONS / "icp-against-ceicp.md"
START = (3.0, 6.0)
"""Start error of a section that names none: degrees, centimetres."""
_NUMBER = r"(\d+(?:\.\d+)?)"
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Stop:
    """One section of a lesson."""

    title: str
    text: str
    """Markdown."""
    race: Race = field(default_factory=lambda: Race(start=Start.towards(*START, seed=0)))
    """Without the nodes, which stay those that are chosen."""
    in_ms: bool = False
    """Whether the curves run over time instead of iterations."""
    place: int | None = 0
    """Iteration, or milliseconds, to show; None is the end."""
    lane: int = 0
    """Whose pairs the histogram shows."""


@dataclass(frozen=True, slots=True)
class Lesson:
    """A way through the race in stops."""

    title: str
    stops: tuple[Stop, ...]


def read_lesson(path: Path) -> Lesson:
    """The lesson in a markdown file.

    Raises:
        InputError: the file cannot be read, has no title or no section, or sets what it cannot.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"The lesson {path.name} cannot be read as text: {error}.") from None
    title = re.search(r"^# (.+)$", text, re.MULTILINE)
    head, *sections = re.split(r"^## ", text, flags=re.MULTILINE)
    if title is None or title.start() > len(head):
        raise InputError(f"The lesson {path.name} has no title; begin it with a line '# title'.")
    if not sections:
        raise InputError(f"The lesson {path.name} has no sections; begin each with a line '## title'.")
    return Lesson(title[1].strip(), tuple(_stop(section, path.name) for section in sections))


def _stop(section: str, file: str) -> Stop:
    title, *lines = section.splitlines()
    stop = Stop(title.strip(), "\n".join(x for x in lines if not x.startswith("set:")).strip())
    if not stop.text:
        raise InputError(f"The lesson {file}, section '{stop.title}', has no text.")
    for line in lines:
        if line.startswith("set:"):
            name, _, value = (part.strip() for part in line[4:].partition("="))
            try:
                stop = _set(stop, name, value)
            except ValueError as error:
                raise InputError(
                    f"The lesson {file}, section '{stop.title}', cannot set {name} = {value}: {error}."
                ) from None
    return stop


def _set(stop: Stop, name: str, value: str) -> Stop:
    if name in _RACE:
        key, read = _RACE[name]
        return replace(stop, race=replace(stop.race, **{key: read(value)}))
    if name in _SHOWN:
        key, read = _SHOWN[name]
        return replace(stop, **{key: read(value)})
    raise ValueError(f"try one of {', '.join((*_RACE, *_SHOWN))}")


def _choice(options: dict[str, Value]) -> Callable[[str], Value]:
    def read(text: str) -> Value:
        if text not in options:
            raise ValueError(f"try one of {', '.join(options)}")
        return options[text]

    return read


def _quantity(unit: str, per_unit: float, most: float) -> Callable[[str], float]:
    """Reads '2 cm' with unit cm; ``per_unit`` units make one of the stored unit."""

    def read(text: str) -> float:
        found = re.fullmatch(rf"{_NUMBER} ?{unit}", text)
        if found is None or float(found[1]) > most:
            raise ValueError(f"try 0 to {most:g} {unit}")
        return float(found[1]) / per_unit

    return read


def _methods(text: str) -> tuple[Rival, ...]:
    names = {name.lower().replace(",", ""): rival for name, rival in RIVALS.items()}
    rivals = tuple(_choice(names)(part.strip().lower()) for part in text.split(","))
    if len(rivals) > MOST_LANES:
        raise ValueError(f"at most {MOST_LANES} methods race")
    return rivals


def _start(text: str) -> Start:
    names = {name.partition(" (")[0]: error for name, error in STARTS.items()}
    found = re.fullmatch(rf"{_NUMBER} deg {_NUMBER} cm", text)
    if found is not None:
        return Start.towards(float(found[1]), float(found[2]), seed=0)
    if text not in names:
        raise ValueError(f"try one of {', '.join(names)} or such as '10 deg 20 cm'")
    return Start.towards(*names[text], seed=0)


def _place(text: str) -> int | None:
    if text in ("start", "end"):
        return 0 if text == "start" else None
    if not text.isdigit():
        raise ValueError("try start, end or the number of an iteration")
    return int(text)


_RACE: dict[str, tuple[str, Callable[[str], Any]]] = {
    "mode": ("mode", _choice(MODES)),
    "methods": ("rivals", _methods),
    "pairs": ("direction", _choice(DIRECTIONS)),
    "start": ("start", _start),
    "noise": ("noise_m", _quantity("cm", 100.0, 10.0)),
    "outliers": ("outlier_share", _quantity("%", 100.0, 60.0)),
    "holes": ("hole_share", _quantity("%", 100.0, 80.0)),
    "cut off": ("crop_share", _quantity("%", 100.0, 80.0)),
    "depth bias": ("depth_bias", _quantity("%", 100.0, 15.0)),
}
_SHOWN: dict[str, tuple[str, Callable[[str], Any]]] = {
    "axis": ("in_ms", _choice({"iterations": False, "milliseconds": True})),
    "position": ("place", _place),
    "lane": ("lane", _choice({str(index + 1): index for index in range(MOST_LANES)})),
}
