"""Lessons: markdown files whose sections set a screen's controls and explain what it shows.

A lesson is a ``# title`` and sections. A section is a ``## title``, lines ``set: name = value``, lines
``open: folder or tab``, lines ``see: control or number``, and its text. What a section does not set has its
default, so that each stop can be shown alone. The folders, controls and numbers that it names are opened,
framed and scrolled into view. A text may have emphasis, lists and web links; tags and images in it are shown
as plain text. Numbers are computed from the screen, not typed: ``{name}``. ``{{, and was {3:name}}}`` gives
the number at the third stop, and is left out for users who have not been there.
After its text a section may ask a question::

    ask: What does it cost?
    choices:
    - [ ] Nothing. | Why somebody may think so, and why it is wrong.
    - [x] Time.
    - [ ] Energy. | The reason for this choice.
    reveal: The explanation that is shown after a guess.

If the right choice depends on the scene, each choice has a reason and names the computed word that makes it
right: ``- [more=plane] The plane. | Why it is wrong in other scenes.``
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
"""Number of choices in every question; the keys are 1, 2 and 3."""
PARTS = ("ask", "choices", "reveal")
POINTING = ("open:", "see:")
FIELD = re.compile(r"\{(?:(\d+):)?([a-z_0-9]+)\}")
CLAUSE = re.compile(r"\{\{((?:[^{}]|\{[^{}]*\})*)\}\}")
SCENE = "scene"
"""Key of ``Numbers`` whose value identifies the scene; texts cannot use it."""
Numbers: TypeAlias = Mapping[str, str]
"""Texts that replace the fields of a lesson's text, by field name; empty while they are computed."""
Value = TypeVar("Value")
Look = TypeVar("Look", bound="DataclassInstance")
"""State of a screen: a frozen record of everything that a stop may set."""
Setting: TypeAlias = Callable[[Look, str], Look]
"""Returns a look with the change of a line ``set: name = text``; a ValueError advises what to try."""


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


@dataclass(frozen=True, slots=True)
class Lesson(Generic[Look]):
    """A lesson: a sequence of stops on one screen."""

    title: str
    stops: tuple[Stop[Look], ...]
    default: Look
    """The state in which a stop has what its section does not set."""


def read_lesson(
    path: Path, settings: Mapping[str, Setting[Look]], default: Look, numbers: Collection[str] = ()
) -> Lesson[Look]:
    """Read a lesson from a markdown file.

    Args:
        path: the file.
        settings: what a section can set, by the names that it uses.
        default: the state for what a section does not set.
        numbers: names of the fields that the texts may use.

    Raises:
        InputError: the file cannot be read, has no title or section, sets something unknown, uses an unknown
            field, or asks without choices or an answer.
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
                f"The lesson {path.name} has the field {stop and f'{stop}:'}{name}, which is not a number "
                f"of its screen; try one of {', '.join(numbers) or 'none'}."
            )
    for stop, name in FIELD.findall(CLAUSE.sub("", text)):
        if stop:
            raise InputError(
                f"The lesson {path.name} has the field {stop}:{name} outside of double braces; put the "
                f"whole clause inside, because a reader may have skipped stop {stop}."
            )
    stops = tuple(_stop(section, path.name, settings, default) for section in sections)
    choices = [choice for stop in stops if stop.question for choice in stop.question.choices]
    for name in (choice.when[0] for choice in choices if choice.when is not None):
        if name not in numbers:
            raise InputError(
                f"The lesson {path.name} has a choice that is right by {name}, which its screen does not "
                f"compute; try one of {', '.join(numbers) or 'none'}."
            )
    return Lesson(title[1].strip(), stops, default)


def _stop(section: str, file: str, settings: Mapping[str, Setting[Look]], look: Look) -> Stop[Look]:
    title, *lines = section.splitlines()
    body = "\n".join(line for line in lines if not line.startswith(("set:", *POINTING)))
    text, *parts = re.split(rf"^({'|'.join(PARTS)}):", body, flags=re.MULTILINE)
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
        raise InputError(f"{where} opens nothing; name a folder or a tab after 'open:'.")
    if "" in sees:
        raise InputError(f"{where} shows nothing; name a control or a number after 'see:'.")
    return Stop(title.strip(), text.strip(), look, opens, sees, _question(parts, where) if parts else None)


def _question(parts: list[str], where: str) -> Question:
    """Return the question in the parts of a section; names and texts alternate."""
    question, choices, reveal = (
        (part.strip() for part in parts[1::2]) if tuple(parts[::2]) == PARTS else ("",) * 3
    )
    if not (question and choices and reveal):
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
            raise InputError(f"{where} choice '{one.text}' {fault}; write a reason after ' | '.")
    return Question(question, found, reveal)


def sets(key: str, read: Callable[[str], Any]) -> Callable[[Look, str], Look]:
    """Return a setting that stores what ``read`` makes of the text in one field of the look."""
    return lambda look, text: replace(look, **{key: read(text)})


def choice(options: Mapping[str, Value]) -> Callable[[str], Value]:
    """Return a reader that takes the name of one of the options."""

    def read(text: str) -> Value:
        if text not in options:
            raise ValueError(f"try one of {', '.join(options)}")
        return options[text]

    return read


def quantity(
    unit: str, most: float, per_unit: float = 1.0, above_zero: bool = False
) -> Callable[[str], float]:
    """Return a reader of texts such as '2 cm' (unit cm) up to ``most``; it divides by ``per_unit``."""

    def read(text: str) -> float:
        found = re.fullmatch(rf"{NUMBER} ?{unit}", text)
        if found is None or float(found[1]) > most or (above_zero and float(found[1]) == 0.0):
            raise ValueError(f"try {'more than ' if above_zero else ''}0 to {most:g} {unit}")
        return float(found[1]) / per_unit

    return read


def short(label: str) -> str:
    """Return a label's text without its explanation."""
    return re.split(r" \(|[,:]", label)[0]
