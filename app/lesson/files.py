"""Lessons: markdown files whose sections set a screen's controls and explain what it shows.

A lesson begins with a ``# title`` and lines ``screen: name``, ``scene: name`` and ``language: code``, of
which a teacher's own lesson needs the first. Then come sections. A section is a ``## title``, lines ``set:
name = value``, lines ``open: folder or tab``, lines ``see: control or number``, and its text. What a section
does not set has its default, so that each stop can be shown alone. The folders and tabs that it names are
opened; they, the controls and the numbers are framed, and the page scrolls to the first control or number,
else to the first folder. A text may have emphasis, lists and web links; tags and images in it are shown as
plain text. ``{name}`` is replaced by a number that the screen has computed. ``{{, and was {3:name}}}`` gives
the number at the third stop, and is left out for users who have not been there and where the number does not
exist; ``{{yours is {own}||you have none}}`` has a second wording for them.
After its text a section may ask a question::

    ask: What does it cost?
    choices:
    - [ ] Nothing. | Why somebody may think so, and why it is wrong.
    - [x] Time.
    - [ ] Energy. | The reason for this choice.
    reveal: The explanation that is shown after a guess.

If the right choice depends on the scene, each choice has a reason and names the computed word that makes it
right: ``- [more=plane] The plane. | Why it is wrong in other scenes.``

``NAME.de.md`` next to ``NAME.md`` is the lesson in German: the same sections, questions and fields, without
the lines ``screen``, ``scene``, ``language``, ``set``, ``open`` and ``see``, which only ``NAME.md`` has.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from app.window.teaching import ENGLISH

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LESSONS = Path(__file__).resolve().parents[2] / "assets" / "lessons"
NUMBER = r"(\d+(?:\.\d+)?)"
CHOICES = 3
"""Number of choices in every question; the keys are 1, 2 and 3."""
FIELD = re.compile(r"\{(?:(\d+):)?([a-z_0-9]+)\}")
OTHERWISE = "||"
"""Between the two wordings of a clause: the second is for readers without the numbers of the first."""
CLAUSE = re.compile(r"\{\{((?:[^{}]|\{[^{}]*\})*)\}\}")
SCENE = "scene"
"""Key of ``Numbers`` whose value identifies the scene; texts cannot use it."""
Numbers: TypeAlias = Mapping[str, str]
"""Texts that replace the fields of a lesson's text, by field name; empty while they are computed."""
Value = TypeVar("Value")
Look = TypeVar("Look", bound="DataclassInstance")
"""State of a screen: a frozen record of everything that a stop may set."""
Setting: TypeAlias = Callable[[Look, str], Look]
"""Returns the look after a line ``set: name = text``; the message of its ValueError says what to try."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One of the answers to a question."""

    text: str
    """Markdown."""
    reason: str = ""
    """Why the choice is wrong; empty for the right one."""
    when: tuple[str, str] | None = None
    """A number's name and the value that makes this choice right; None if no number decides."""


@dataclass(frozen=True, slots=True)
class Question:
    """The question of a stop."""

    text: str
    """Markdown."""
    choices: tuple[Choice, ...]
    reveal: str
    """Markdown, shown after a guess."""


def settled(question: Question, numbers: Numbers) -> Question | None:
    """Return the question with the right choice for the scene shown; None while it is not known."""
    if all(choice.when is None for choice in question.choices):
        return question
    rights = [choice.when is not None and choice.when in numbers.items() for choice in question.choices]
    if not any(rights):
        return None
    choices = (
        replace(choice, reason="" if right else choice.reason)
        for choice, right in zip(question.choices, rights, strict=True)
    )
    return replace(question, choices=tuple(choices))


@dataclass(frozen=True, slots=True)
class Stop(Generic[Look]):
    """One section of a lesson."""

    title: str
    text: str
    """Markdown."""
    look: Look
    opens: tuple[str, ...] = ()
    """Titles of the folders and tabs to open."""
    sees: tuple[str, ...] = ()
    """Names of the controls and numbers to point out."""
    question: Question | None = None

    @property
    def texts(self) -> Iterator[str]:
        """All texts of the stop in markdown: title, text, question, choices with reasons, explanation."""
        yield from (self.title, self.text)
        if self.question is not None:
            yield self.question.text
            for choice in self.question.choices:
                yield from (choice.text, choice.reason)
            yield self.question.reveal


@dataclass(frozen=True, slots=True)
class Lesson(Generic[Look]):
    """A lesson: a sequence of stops on one screen."""

    title: str
    stops: tuple[Stop[Look], ...]
    default: Look
    """The default of everything that a section does not set."""
    name: str = ""
    """Name of the file without its suffix."""
    scene: str = ""
    """Demo scene with which it begins; empty for the scene that is shown."""
    language: str = ENGLISH
    """Code of the language of its texts."""
    translations: Mapping[str, Lesson[Look]] = field(default_factory=dict)
    """The lesson in other languages, by their codes."""

    def in_language(self, language: str) -> Lesson[Look]:
        """Return the lesson in a language, or as it was written if it is not translated."""
        return self.translations.get(language, self)


@dataclass(frozen=True, eq=False, slots=True)
class Kind(Generic[Look]):
    """The settings and numbers that the lessons of a screen can use."""

    name: str
    """Name of the screen in a lesson's file."""
    settings: Mapping[str, Setting[Look]]
    """Settings that a section can make, by their names in the file."""
    default: Look
    """The default of everything that a section does not set."""
    numbers: tuple[str, ...] = ()
    """Names of the fields that the texts may use."""
    statement: Callable[[Numbers], str] = lambda numbers: ""
    """Returns a sentence on what the picture shows, from its numbers, for screen readers."""
    words: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)
    """The three possible values of each number that decides a question, by the number's name."""


def screen_of(kind: str) -> str:
    """Return the screen of a kind of lessons, as an address names it: walks are on the Fuse screen."""
    return "fuse" if kind == "walk" else kind


def sets(key: str, read: Callable[[str], Any]) -> Callable[[Look, str], Look]:
    """Return a setting that reads the text with ``read`` and stores the value in the look's field ``key``."""
    return lambda look, text: replace(look, **{key: read(text)})


def choice(options: Mapping[str, Value]) -> Callable[[str], Value]:
    """Return a function from the name of an option to its value; it raises ValueError for other names."""

    def read(text: str) -> Value:
        if text not in options:
            raise ValueError(f"try one of {', '.join(options)}")
        return options[text]

    return read


def quantity(
    unit: str, most: float, per_unit: float = 1.0, above_zero: bool = False
) -> Callable[[str], float]:
    """Return a function from a text such as '2 cm' to its number divided by ``per_unit``.

    It raises ValueError for a text of another form or a number out of range.

    Args:
        unit: unit in the text, such as cm.
        most: largest number in the text.
        per_unit: units of the text in one unit of the result: 100 for cm to metres.
        above_zero: whether 0 is refused.
    """

    def read(text: str) -> float:
        found = re.fullmatch(rf"{NUMBER} ?{unit}", text)
        if found is None or float(found[1]) > most or (above_zero and float(found[1]) == 0.0):
            raise ValueError(f"try {'more than ' if above_zero else ''}0 to {most:g} {unit}")
        return float(found[1]) / per_unit

    return read


def short(label: str) -> str:
    """Return a label up to the bracket, comma or colon at which its explanation begins."""
    return re.split(r" \(|[,:]", label)[0]
