"""Lessons: markdown files whose sections set a screen's controls and say what to look at.

A lesson is a ``# title`` and sections. A section is a ``## title``, lines ``set: name = value``, lines
``open: folder`` and its text. What a section does not set is at its default, so that every stop can be shown
by itself; the folders that it speaks of are unfolded. Behind the text a section asks::

    ask: What does it cost?
    choices:
    - [ ] Nothing. | Why somebody may think so, and why it is not so.
    - [x] Time.
    - [ ] Energy. | The reason here, too.
    reveal: What there is to know, which is shown when a person has guessed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
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
SKIP, SKIPPED = "Skip", -1
CHOICES = 3
"""Of every question; they are the keys 1, 2 and 3."""
GUESS = f"Take a guess: 1, 2 or 3. Or press **{SKIP}**."
FIRST = "**Guess before you go on: 1, 2 or 3.** A wrong guess costs nothing. Or press **Skip**."
VOTING = f"The class votes: 1, 2 or 3. A guess of the teacher's, or **{SKIP}**, shows the answer."
BAR = 12
"""Blocks of a bar that holds all votes."""
KEYS = (
    "<span><b>→</b> or <b>space</b> next, <b>←</b> back, <b>1 2 3</b> guess, <b>S</b> skip. "
    "Click the dock, and the keys are the dock's.</span>"
    "<span>The keys are the dock's now; <b>Esc</b> gives them back to the lesson.</span>"
)
"""What the page says of the keys: while they are the lesson's, and while they are the dock's."""
PARTS = ("ask", "choices", "reveal")
Value = TypeVar("Value")
Look = TypeVar("Look", bound="DataclassInstance")
"""What a screen is to show: a frozen record of all that a stop may set."""
Setting: TypeAlias = Callable[[Look, str], Look]
"""Changes a look as the text behind ``set: name =`` says; a ValueError says what to try instead."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One of the answers that can be guessed."""

    text: str
    """Markdown."""
    reason: str = ""
    """Why it is wrong; empty for the one that is right."""


@dataclass(frozen=True, slots=True)
class Question:
    """What a stop asks before it tells."""

    text: str
    """Markdown."""
    choices: tuple[Choice, ...]
    reveal: str
    """Markdown, shown after a guess."""


@dataclass(frozen=True, slots=True)
class Stop(Generic[Look]):
    """One section of a lesson."""

    title: str
    text: str
    """Markdown."""
    look: Look
    opens: tuple[str, ...] = ()
    """Titles of the folders that it speaks of."""
    question: Question | None = None


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
        InputError: the file cannot be read, has no title or no section, sets what it cannot, or asks without
            choices or an answer.
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
    told = "\n".join(line for line in lines if not line.startswith(("set:", "open:")))
    text, *parts = re.split(rf"^({'|'.join(PARTS)}):", told, flags=re.MULTILINE)
    opens = tuple(line[5:].strip() for line in lines if line.startswith("open:"))
    where = f"The lesson {file}, section '{title.strip()}',"
    if not text.strip():
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
    return Stop(title.strip(), text.strip(), look, opens, _question(parts, where) if parts else None)


def _question(parts: list[str], where: str) -> Question:
    """What the parts, each after its name, ask."""
    asked, choices, reveal = (
        (part.strip() for part in parts[1::2]) if tuple(parts[::2]) == PARTS else ("",) * 3
    )
    if not (asked and choices and reveal):
        raise InputError(
            f"{where} must ask with 'ask:', 'choices:' and 'reveal:', in this order, each with text."
        )
    _, *items = re.split(r"^- \[([ x])\] ", choices, flags=re.MULTILINE)
    marks, texts = items[::2], [" ".join(item.split()) for item in items[1::2]]
    if len(texts) != CHOICES or marks.count("x") != 1:
        raise InputError(
            f"{where} needs {CHOICES} choices: '- [x] choice' once, else '- [ ] choice | why it is wrong'."
        )
    found = tuple(Choice(*(part.strip() for part in text.partition(" | ")[::2])) for text in texts)
    for mark, one in zip(marks, found, strict=True):
        if (mark == "x") == bool(one.reason):
            fault = "is right but has a reason why not" if one.reason else "has no reason why it is wrong"
            raise InputError(f"{where} choice '{one.text}' {fault}; a reason stands behind ' | '.")
    return Question(asked, found, reveal)


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
        self._guesses: dict[int, int] = {}
        self._votes: dict[int, dict[int, int]] = {}
        """By stop and voter."""
        self._lecture = ui.lecture
        with ui.gui.add_folder(f"Lesson: {lesson.title}", expand_by_default=False):
            self._stop = ui.gui.add_dropdown(
                "Stop",
                [OFF, *self._names],
                hint="Shows what to look at and sets the controls below; change them as you like.",
            )
            ui.when_changed(self._stop, self._picked)
            self._large = ui.gui.add_checkbox(
                "Large",
                ui.lecture is not None,
                hint="Shows the text large over the picture, for a room to read.",
            )
            ui.when_changed(self._large, self._point_out)
            self._text = ui.gui.add_markdown(BEGIN)
            guesses = {str(index + 1): partial(self._take, index) for index in range(CHOICES)}
            self._guess = ui.buttons(
                "Your guess",
                {**guesses, SKIP: partial(self._take, SKIPPED)},
                "Which answer do you expect? You are told why it is right or not.",
                visible=False,
            )
            ui.buttons(
                "Go",
                {"Back": lambda: self._go(-1), "Next": lambda: self._go(1)},
                "To the stop before or after.",
            )
            self._mark = ui.gui.add_html("")
        self._marked = 0

    def _go(self, count: int) -> None:
        index = self._index() + count
        if count > 0 and self._waits():
            self._write(FIRST)
        elif 0 <= index < len(self._names):
            self._stop.value = self._names[index]
            self._picked()

    def place(self) -> str:
        """The number of the stop, for the address; empty without one."""
        return "" if self._index() < 0 else str(self._index() + 1)

    def take(self, place: str) -> None:
        """Go to the stop of that number, or to none.

        Raises:
            InputError: there is no such stop.
        """
        numbers = ["", *(str(number) for number in range(1, len(self._names) + 1))]
        if place not in numbers:
            raise InputError(f"The address has stop {place[:9]}; this lesson has 1 to {len(self._names)}")
        self._stop.value = (OFF, *self._names)[numbers.index(place)]
        self._picked()

    def _index(self) -> int:
        return -1 if self._stop.value == OFF else self._names.index(self._stop.value)

    def _waits(self) -> bool:
        """Whether the stop has asked and nobody has guessed."""
        index = self._index()
        return index >= 0 and self._lesson.stops[index].question is not None and index not in self._guesses

    def _picked(self) -> None:
        index = self._index()
        if index < 0:
            self._guesses.clear()
            self._votes.clear()
            self._text.content, self._guess.visible = BEGIN, False
            self._poll()
            self._point_out()
            return
        stop = self._lesson.stops[index]
        self._write(self._asking())
        self._poll()
        self._on_stop(stop.look)
        self._point_out()

    def _point_out(self) -> None:
        """Have the page give the keys to the stop, unfold what it speaks of and show it large or not."""
        index = self._index()
        self._marked += 1
        if index < 0:
            self._mark.content = ""
            return
        titles = json.dumps(self._lesson.stops[index].opens)
        folders = json.dumps([f"Lesson: {self._lesson.title}", *self._lesson.stops[index].opens])
        script = f"window.packetmesh?.unfold({folders}); window.packetmeshLesson?.at(this, {titles})"
        large = "data-large" if self._large.value else ""
        self._mark.content = (
            f"<div class='packetmesh-lesson' {large}>{KEYS}{running(script, self._marked)}</div>"
        )

    def _take(self, guess: int) -> None:
        """Answer a guess; the first one counts."""
        if self._waits():
            self._guesses[self._index()] = guess
            self._write(self._asking())
            self._poll()

    def _voted(self, voter: int, vote: int) -> None:
        """Count a vote of the class; the last one of each counts, until the answer is shown."""
        if self._waits():
            self._votes.setdefault(self._index(), {})[voter] = vote - 1
            self._write(self._asking())

    def _poll(self) -> None:
        """Have the class vote while the stop waits for an answer."""
        if self._lecture is not None:
            self._lecture.poll(self._voted if self._waits() else None)

    def _asking(self) -> str:
        return GUESS if self._lecture is None else VOTING

    def _write(self, waiting: str) -> None:
        """Show the stop; ``waiting`` stands where the answer will be."""
        index = self._index()
        stop = self._lesson.stops[index]
        lines = [f"**{stop.title}** ({index + 1} of {len(self._names)})", stop.text]
        if stop.question is not None:
            asked = with_votes(stop.question, self._votes.get(index, {}).values())
            lines += [f"**{stop.question.text}**", *told(asked, self._guesses.get(index), waiting)]
        self._text.content = "\n\n".join(lines)
        self._guess.visible = self._waits()


def with_votes(question: Question, votes: Collection[int]) -> Question:
    """The question with a bar and a count behind each choice, once anybody has voted.

    Args:
        question: what is asked.
        votes: indices of choices.
    """
    if not votes:
        return question
    counts = [sum(vote == index for vote in votes) for index in range(CHOICES)]
    bars = ("█" * round(BAR * count / len(votes)) for count in counts)
    choices = (
        replace(choice, text=f"{choice.text} {bar} **{count}**".replace("  ", " "))
        for choice, bar, count in zip(question.choices, bars, counts, strict=True)
    )
    return replace(question, choices=tuple(choices))


def told(question: Question, guess: int | None, waiting: str) -> list[str]:
    """Paragraphs of markdown: the choices, and the answer to a guess, or ``waiting`` before there is one.

    Args:
        question: what is asked.
        guess: index of a choice, ``SKIPPED``, or None while nobody has guessed.
        waiting: what to say until then.
    """
    if guess is None:
        return [*(f"{i}. {choice.text}" for i, choice in enumerate(question.choices, 1)), waiting]
    marks = ["" if choice.reason else "✓ " for choice in question.choices]
    answer = ""
    if guess != SKIPPED:
        reason = question.choices[guess].reason
        marks[guess] = "✗ " if reason else "✓ "
        answer = f"**Not quite, and many think so.** {reason} " if reason else "**Right.** "
    listed = zip(marks, question.choices, strict=True)
    choices = (f"{i}. {mark}{choice.text}" for i, (mark, choice) in enumerate(listed, 1))
    return [*choices, answer + question.reveal]
