"""Lessons: markdown files whose sections set a screen's controls and say what to look at.

A lesson is a ``# title`` and sections. A section is a ``## title``, lines ``set: name = value``, lines
``open: folder or tab``, lines ``see: control or number`` and its text. What a section does not set is at its
default, so that every stop can be shown by itself; what it speaks of is opened, framed and in view. A text
has emphasis, lists and links to the web; tags and images in it are shown as they are written. Numbers
are not typed: ``{name}`` is computed of what the screen shows. ``{{, and was {3:name}}}`` says what it was at
the third stop, and nothing to those who were not there.
Behind the text a section asks::

    ask: What does it cost?
    choices:
    - [ ] Nothing. | Why somebody may think so, and why it is not so.
    - [x] Time.
    - [ ] Energy. | The reason here, too.
    reveal: What there is to know, which is shown when a person has guessed.

Where the right choice depends on the scene, each has a reason and names what must be computed for it to be
right: ``- [more=plane] The plane. | Why it is wrong where it is.``
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from packetmesh.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LESSONS = Path(__file__).resolve().parents[2] / "assets" / "lessons"
NUMBER = r"(\d+(?:\.\d+)?)"
CHOICES = 3
"""Of every question; they are the keys 1, 2 and 3."""
PARTS = ("ask", "choices", "reveal")
POINTING = ("open:", "see:")
FIELD = re.compile(r"\{(?:(\d+):)?([a-z_0-9]+)\}")
CLAUSE = re.compile(r"\{\{((?:[^{}]|\{[^{}]*\})*)\}\}")
SCENE = "scene"
"""The number by which those of another scene are told apart; not for a text."""
Numbers: TypeAlias = Mapping[str, str]
"""What stands for the fields of a text, by their names; empty while it is computed."""
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
    when: tuple[str, str] | None = None
    """The name of something computed, and what that is where this choice is right; None if it is fixed."""


@dataclass(frozen=True, slots=True)
class Question:
    """What a stop asks before it tells."""

    text: str
    """Markdown."""
    choices: tuple[Choice, ...]
    reveal: str
    """Markdown, shown after a guess."""


def settled(question: Question, numbers: Numbers) -> Question | None:
    """The question with the choice that is right in the scene that is shown; None while that is not known."""
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
    """Titles of the folders and tabs that it speaks of."""
    sees: tuple[str, ...] = ()
    """Names of the controls and numbers that it speaks of."""
    question: Question | None = None


@dataclass(frozen=True, slots=True)
class Lesson(Generic[Look]):
    """A way through a screen in stops."""

    title: str
    stops: tuple[Stop[Look], ...]
    default: Look
    """What is shown where a section sets nothing."""


def read_lesson(
    path: Path, settings: Mapping[str, Setting[Look]], default: Look, numbers: Collection[str] = ()
) -> Lesson[Look]:
    """The lesson in a markdown file.

    Args:
        path: the file.
        settings: what a section can set, by the names that it uses.
        default: what is shown where a section sets nothing.
        numbers: names of the fields that its texts may have.

    Raises:
        InputError: the file cannot be read, has no title or no section, sets what it cannot, has a field that
            nobody computes, or asks without choices or an answer.
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
    for stop, name in FIELD.findall(text):
        if name not in numbers or (stop and not 1 <= int(stop) <= len(sections)):
            raise InputError(
                f"The lesson {path.name} has the field {stop and f'{stop}:'}{name}, no number of its "
                f"screen; try one of {', '.join(numbers) or 'none'}."
            )
    for stop, name in FIELD.findall(CLAUSE.sub("", text)):
        if stop:
            raise InputError(
                f"The lesson {path.name} has the field {stop}:{name} outside of double braces; put all that "
                f"says it inside, for those who were not at stop {stop}."
            )
    stops = tuple(_stop(section, path.name, settings, default) for section in sections)
    asked = [choice for stop in stops if stop.question for choice in stop.question.choices]
    for name in (choice.when[0] for choice in asked if choice.when is not None):
        if name not in numbers:
            raise InputError(
                f"The lesson {path.name} has a choice that is right by {name}, which its screen does not "
                f"compute; try one of {', '.join(numbers) or 'none'}."
            )
    return Lesson(title[1].strip(), stops, default)


def _stop(section: str, file: str, settings: Mapping[str, Setting[Look]], look: Look) -> Stop[Look]:
    title, *lines = section.splitlines()
    told = "\n".join(line for line in lines if not line.startswith(("set:", *POINTING)))
    text, *parts = re.split(rf"^({'|'.join(PARTS)}):", told, flags=re.MULTILINE)
    opens, sees = (tuple(x[len(key) :].strip() for x in lines if x.startswith(key)) for key in POINTING)
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
        raise InputError(f"{where} opens nothing; name a folder or a tab behind 'open:'.")
    if "" in sees:
        raise InputError(f"{where} shows nothing; name a control or a number behind 'see:'.")
    return Stop(title.strip(), text.strip(), look, opens, sees, _question(parts, where) if parts else None)


def _question(parts: list[str], where: str) -> Question:
    """What the parts, each after its name, ask."""
    asked, choices, reveal = (
        (part.strip() for part in parts[1::2]) if tuple(parts[::2]) == PARTS else ("",) * 3
    )
    if not (asked and choices and reveal):
        raise InputError(
            f"{where} must ask with 'ask:', 'choices:' and 'reveal:', in this order, each with text."
        )
    _, *items = re.split(r"^- \[( |x|[a-z_]+=[a-z]+)\] ", choices, flags=re.MULTILINE)
    marks, texts = items[::2], [" ".join(item.split()) for item in items[1::2]]
    whens = [(name, word) if word else None for name, _, word in (mark.partition("=") for mark in marks)]
    computed = [when for when in whens if when is not None]
    of_one = len(set(computed)) == CHOICES and len({name for name, _ in computed}) == 1
    if len(texts) != CHOICES or not (of_one or (not computed and marks.count("x") == 1)):
        raise InputError(
            f"{where} needs {CHOICES} choices: '- [x] choice' once, else '- [ ] choice | why it is wrong'; "
            "or all of them such as '- [name=word] choice | why it is wrong where it is'."
        )
    parted = (text.partition(" | ") for text in texts)
    found = tuple(
        Choice(text.strip(), reason.strip(), when)
        for (text, _, reason), when in zip(parted, whens, strict=True)
    )
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
