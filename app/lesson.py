"""Lessons: markdown files whose sections set a screen's controls and say what to look at.

A lesson is a ``# title`` and sections. A section is a ``## title``, lines ``set: name = value``, lines
``open: folder`` and its text. What a section does not set is at its default, so that every stop can be shown
by itself; the folders that it speaks of are unfolded.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from app.page import running
from app.ui import Ui
from packetmesh.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LESSONS = Path(__file__).resolve().parents[1] / "assets" / "lessons"
NUMBER = r"(\d+(?:\.\d+)?)"
OFF, BEGIN = "not now", "Choose a stop, or press **Next**."
ANSWER, THINK = "*Answer:*", "*Answer:* think first, then press **Answer**."
Value = TypeVar("Value")
Look = TypeVar("Look", bound="DataclassInstance")
"""What a screen is to show: a frozen record of all that a stop may set."""
Setting: TypeAlias = Callable[[Look, str], Look]
"""Changes a look as the text behind ``set: name =`` says; a ValueError says what to try instead."""


@dataclass(frozen=True, slots=True)
class Stop(Generic[Look]):
    """One section of a lesson."""

    title: str
    text: str
    """Markdown."""
    look: Look
    opens: tuple[str, ...] = ()
    """Titles of the folders that it speaks of."""


@dataclass(frozen=True, slots=True)
class Lesson(Generic[Look]):
    """A way through a screen in stops."""

    title: str
    stops: tuple[Stop[Look], ...]


def read_lesson(path: Path, settings: Mapping[str, Setting[Look]], default: Look) -> Lesson[Look]:
    """The lesson in a markdown file.

    Args:
        path: the file.
        settings: what a section can set, by the names that it uses.
        default: what is shown where a section sets nothing.

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
    stops = (_stop(section, path.name, settings, default) for section in sections)
    return Lesson(title[1].strip(), tuple(stops))


def _stop(section: str, file: str, settings: Mapping[str, Setting[Look]], look: Look) -> Stop[Look]:
    title, *lines = section.splitlines()
    text = "\n".join(line for line in lines if not line.startswith(("set:", "open:"))).strip()
    opens = tuple(line[5:].strip() for line in lines if line.startswith("open:"))
    where = f"The lesson {file}, section '{title.strip()}',"
    if not text:
        raise InputError(f"{where} has no text.")
    for line in lines:
        if line.startswith("set:"):
            name, _, value = (part.strip() for part in line[4:].partition("="))
            try:
                look = choice(settings)(name)(look, value)
            except ValueError as error:
                raise InputError(f"{where} cannot set {name} = {value}: {error}.") from None
    if "" in opens:
        raise InputError(f"{where} opens nothing; name a folder behind 'open:'.")
    return Stop(title.strip(), text, look, opens)


def sets(key: str, read: Callable[[str], Any]) -> Callable[[Look, str], Look]:
    """The setting that puts what ``read`` makes of the text into one field of the look."""
    return lambda look, text: replace(look, **{key: read(text)})


def choice(options: Mapping[str, Value]) -> Callable[[str], Value]:
    """Reads one of the options' names."""

    def read(text: str) -> Value:
        if text not in options:
            raise ValueError(f"try one of {', '.join(options)}")
        return options[text]

    return read


def quantity(
    unit: str, most: float, per_unit: float = 1.0, above_zero: bool = False
) -> Callable[[str], float]:
    """Reads such as '2 cm' with unit cm, up to ``most``; ``per_unit`` units make one of the stored unit."""

    def read(text: str) -> float:
        found = re.fullmatch(rf"{NUMBER} ?{unit}", text)
        if found is None or float(found[1]) > most or (above_zero and float(found[1]) == 0.0):
            raise ValueError(f"try {'more than ' if above_zero else ''}0 to {most:g} {unit}")
        return float(found[1]) / per_unit

    return read


def short(label: str) -> str:
    """What stands on the screen, up to its explanation."""
    return re.split(r" \(|[,:]", label)[0]


class LessonFolder(Generic[Look]):
    """Leads through a lesson stop by stop; every stop sets the screen's controls and asks before it tells."""

    def __init__(self, ui: Ui, lesson: Lesson[Look], on_stop: Callable[[Look], None]) -> None:
        """Add the folder; ``on_stop`` is called with what the stop shows."""
        self._lesson, self._on_stop = lesson, on_stop
        self._names = [f"{i}. {stop.title}" for i, stop in enumerate(lesson.stops, 1)]
        with ui.gui.add_folder(f"Lesson: {lesson.title}", expand_by_default=False):
            self._stop = ui.gui.add_dropdown(
                "Stop",
                [OFF, *self._names],
                hint="Shows what to look at and sets the controls below; change them as you like.",
            )
            ui.when_changed(self._stop, self._picked)
            keys = {"Back": lambda: self._go(-1), "Next": lambda: self._go(1)}
            hint = "To the stop before or after."
            if any(ANSWER in stop.text for stop in lesson.stops):
                keys["Answer"] = self._answer
                hint = "To the stop before or after, or to the answer of this one."
            ui.buttons("Go", keys, hint)
            self._text = ui.gui.add_markdown(BEGIN)
            self._unfolding = ui.gui.add_html("")
        self._unfolded = 0

    def _go(self, count: int) -> None:
        index = self._index() + count
        if 0 <= index < len(self._names):
            self._stop.value = self._names[index]
            self._picked()

    def _index(self) -> int:
        return -1 if self._stop.value == OFF else self._names.index(self._stop.value)

    def _picked(self) -> None:
        index = self._index()
        if index < 0:
            self._text.content = BEGIN
            self._unfold(())
            return
        stop = self._lesson.stops[index]
        asked, answer, _ = stop.text.partition(ANSWER)
        self._write(asked + THINK if answer else asked)
        self._on_stop(stop.look)
        self._unfold(stop.opens)

    def _unfold(self, titles: tuple[str, ...]) -> None:
        """Have the page do what a hand would."""
        self._unfolded += 1
        script = f"window.packetmesh?.unfold({json.dumps(titles)})"
        self._unfolding.content = running(script, self._unfolded) if titles else ""

    def _answer(self) -> None:
        if self._index() >= 0:
            self._write(self._lesson.stops[self._index()].text)

    def _write(self, text: str) -> None:
        index = self._index()
        title = self._lesson.stops[index].title
        self._text.content = f"**{title}** ({index + 1} of {len(self._names)})\n\n{text}"
