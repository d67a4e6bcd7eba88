"""Reads lesson files and their translations; every fault has its file and line (format: ``files.py``)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Generic

from app.lesson.faults import Fault, Faults, first_of
from app.lesson.files import CHOICES, CLAUSE, FIELD, LESSONS, Choice, Kind, Lesson, Look, Question, Stop
from app.lesson.files import choice as one_of
from app.lesson.languages import NAMES
from app.window.teaching import ENGLISH
from packetmesh.errors import InputError
from packetmesh.files import text_in

PARTS = ("ask", "choices", "reveal")
KEYS = ("set", "open", "see")
"""Keys of a section's lines that change the screen."""
HEAD = ("screen", "scene", "language")
MOST_BYTES = 1_000_000
TRANSLATION = re.compile(r"(.+)\.([A-Za-z]{2,3}(?:[-_]\w+)?)")
"""Name of a translated lesson's file without its suffix: the original's name and the language."""
_MARK = re.compile(r"^- \[( |x|[a-z_]+=[a-z]+)\] ", re.MULTILINE)
_NEARLY = re.compile(rf"\s*({'|'.join((*KEYS, *PARTS))})\s*:", re.IGNORECASE)
"""Beginning of a line that is a key, or nearly one."""
Lines = Sequence[tuple[int, str]]
"""Lines of a file with their numbers, which start at 1."""


def read_lesson(path: Path, kind: Kind[Look]) -> Lesson[Look]:
    """Read a lesson and its translations, which are next to it.

    Raises:
        InputError: a file cannot be read, has no title or stop, sets something unknown, uses an unknown
            field, asks without choices or an answer, or is a translation with other parts than the original.
    """
    lesson, faults = check_lesson(path, kind)
    if lesson is None or faults:
        raise first_of(faults)
    return lesson


shipped_lesson = cache(read_lesson)
"""``read_lesson`` for files that do not change while the program runs."""


def check_lesson(path: Path, kind: Kind[Look]) -> tuple[Lesson[Look] | None, list[Fault]]:
    """Read a lesson like ``read_lesson``. Returns it without faulty translations, and all faults.

    The lesson is None if its own file has a fault.
    """
    read, faults = _parse(path, kind, None)
    if read is None:
        return None, faults
    translations = {}
    whole = not faults
    for code, other in translations_of(path).items():
        translated, wrong = _parse(other, kind, read)
        if code == read.language:
            sentence = f"is in the language of {path.name}; rename it, or write 'language:' in {path.name}"
            faults.append(Fault(other, 0, sentence))
        if translated is not None and not wrong and whole:
            translations[code] = replace(_lesson(other, kind, translated), language=code)
        faults += wrong
    return (replace(_lesson(path, kind, read), translations=translations) if whole else None), faults


def translations_of(path: Path) -> dict[str, Path]:
    """Return the files with the translations of a lesson, by language, in the order of the codes."""
    found = {}
    for other in sorted(path.parent.glob("*.md")):
        named = TRANSLATION.fullmatch(other.stem)
        if named is not None and named[1] == path.stem and named[2] in NAMES:
            found[named[2]] = other
    return found


def titles_of(path: Path) -> dict[str, str]:
    """Return the titles of a lesson that ships, by language, English first."""
    paths = {ENGLISH: path, **translations_of(path)}
    return {code: head_of(read_text(one))[0]["title"][1] for code, one in paths.items()}


def languages(lessons: Iterable[Lesson[Any]] = ()) -> dict[str, str]:
    """Return the names of all languages that a shipped lesson or one of these has, by their codes."""
    codes = {ENGLISH}
    for path in LESSONS.glob("*.md"):
        codes |= translations_of(path).keys()
    for lesson in lessons:
        codes |= {lesson.language, *lesson.translations}
    return {code: name for code, name in NAMES.items() if code in codes}


def read_text(path: Path) -> str:
    """Return the text of a lesson's file.

    Raises:
        InputError: it is missing, not a regular file, too large, empty, or cannot be decoded.
    """
    try:
        size_bytes = path.stat().st_size
        if not path.is_file():  # a pipe or a device could be endless
            raise InputError("is no file; write the lesson in a text file")
        if size_bytes > MOST_BYTES:
            raise InputError(
                f"has more than {MOST_BYTES // 1_000_000} MB; write a shorter text, without pictures in it"
            )
        text = text_in(path.read_bytes())
    except UnicodeDecodeError:
        raise InputError("cannot be read as text; save it in the encoding UTF-8") from None
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror}); give a file that a text editor can open"
        ) from None
    if "\0" in text:
        raise InputError("cannot be read as text; save it in the encoding UTF-8")
    if not text.strip():
        raise InputError("is empty; begin it with a line '# title'")
    return text


def head_of(text: str) -> tuple[dict[str, tuple[int, str]], Lines]:
    """Return the head's values with their line numbers, by key (``title``, those of ``HEAD``), and the other
    lines before the first section.
    """
    values, others = dict[str, tuple[int, str]](), []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("## "):
            break
        key, colon, value = line.partition(":")
        if line.startswith("# ") and "title" not in values:
            values["title"] = number, line[2:].strip()
        elif colon and key in HEAD and key not in values:
            values[key] = number, value.strip()
        elif line.strip():
            others.append((number, line))
    return values, others


@dataclass(frozen=True, slots=True)
class _Read(Generic[Look]):
    """A file of a lesson, as far as it can be read."""

    name: str
    """Name of the file without its suffix."""
    title: str
    language: str
    scene: str
    stops: tuple[Stop[Look] | None, ...]
    """A stop with a fault is None."""


def _lesson(path: Path, kind: Kind[Look], read: _Read[Look]) -> Lesson[Look]:
    """Return the lesson of a file without a fault."""
    stops = tuple(stop for stop in read.stops if stop is not None)
    return Lesson(read.title, stops, kind.default, path.stem, read.scene, read.language)


def _parse(
    path: Path, kind: Kind[Look], original: _Read[Look] | None
) -> tuple[_Read[Look] | None, list[Fault]]:
    """Read one file, a translation if ``original`` is given. Returns it, None without stops, and faults."""
    faults = Faults(path)
    try:
        text = read_text(path)
    except InputError as error:
        faults.add(0, str(error))
        return None, faults
    head, others = head_of(text)
    title, language = head.get("title", (0, ""))[1], head.get("language", (0, ENGLISH))[1]
    if not title:
        faults.add(1, "has no title; begin it with a line '# title'")
    if language not in NAMES:
        faults.add(head["language"][0], f"has an unknown language; write one of {', '.join(NAMES)}")
    if original is not None:
        for key in HEAD:
            if key in head:
                source = "this file's name" if key == "language" else f"{original.name}.md"
                faults.add(head[key][0], f"is a translation; leave out '{key}:', it is in {source}")
    sections = _sections(text)
    for number, line in others if sections else ():
        faults.add(
            number,
            f"has '{line.strip()[:40]}' before the first stop, where only the title and one line each of "
            f"{', '.join(HEAD)} can be; leave it out, or begin a stop above it with '## title'",
        )
    if not sections:
        faults.add(len(text.splitlines()), "has no stops; begin each with a line '## title'")
        return None, faults
    same: Sequence[Stop[Look] | None] = [None] * len(sections)
    if original is not None and len(sections) == len(original.stops):
        same = original.stops
    elif original is not None:
        count = len(original.stops)
        faults.add(
            sections[-1][0][0],
            f"ends with stop {len(sections)}, and {original.name}.md has {count}; translate each once",
        )
    _check_fields(sections, kind, faults)
    stops = tuple(
        _stop(section, kind, one, faults, original is not None)
        for section, one in zip(sections, same, strict=True)
    )
    return _Read(path.stem, title, language, head.get("scene", (0, ""))[1], stops), faults


def _sections(text: str) -> list[Lines]:
    """Return the lines of each section, its title first."""
    sections: list[list[tuple[int, str]]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("## "):
            sections.append([])
        if sections:
            sections[-1].append((number, line))
    return list(sections)


def _check_fields(sections: Sequence[Lines], kind: Kind[Look], faults: Faults) -> None:
    """Add a fault for each field that its screen does not compute, or whose stop may have been skipped, and
    for each brace outside of fields.
    """
    known = ", ".join(kind.numbers) or "none"
    for number, line in (one for section in sections for one in section):
        for stop, name in FIELD.findall(line):
            if stop and not 1 <= int(stop) <= len(sections):
                faults.add(number, f"has the field {stop}:{name}; number the stop from 1 to {len(sections)}")
            elif name not in kind.numbers:
                faults.add(
                    number,
                    f"has the field {stop and f'{stop}:'}{name}, which is not a number of its screen; try "
                    f"one of {known}",
                )
    for section in sections:
        whole = "\n".join(line for _, line in section)
        blank = CLAUSE.sub(lambda found: "\n" * found[0].count("\n"), whole)
        for (number, _), line in zip(section, blank.split("\n"), strict=True):
            for stop, name in FIELD.findall(line):
                if stop:
                    faults.add(
                        number,
                        f"has the field {stop}:{name} outside of double braces; put the whole clause inside, "
                        f"because a reader may have skipped stop {stop}",
                    )
        plain = FIELD.sub("", CLAUSE.sub(lambda found: found[1], whole))
        for (number, _), line in zip(section, plain.split("\n"), strict=True):
            if {"{", "}"} & set(line) and all(fault.line != number for fault in faults):
                example = kind.numbers[0] if kind.numbers else "name"
                faults.add(
                    number,
                    f"has a brace that is not part of a field; write a number as {{{example}}}, a clause "
                    f"with a number of another stop as {{{{… {{1:{example}}} …}}}}, and no other braces",
                )


def _stop(
    section: Lines, kind: Kind[Look], same: Stop[Look] | None, faults: Faults, translated: bool
) -> Stop[Look] | None:
    """Return the stop of a section; None if it has a fault.

    A translation has the settings of ``same``, the original's stop; None if that has a fault or is missing.
    """
    (first, heading), *lines = section
    title, before = heading[3:].strip(), len(faults)
    where = f"stop '{title}'"
    for number, line in lines:
        nearly = _NEARLY.match(line)
        if nearly is not None and nearly[0] != f"{nearly[1].lower()}:":
            key = nearly[1].lower()
            faults.add(
                number, f"begins with '{nearly[0]}'; write '{key}:', without a space and in small letters"
            )
    changes = [(number, *_parted(line)) for number, line in lines if line.partition(":")[0] in KEYS]
    look, opens, sees = kind.default, list[str](), list[str]()
    for number, key, value in changes:
        if translated:
            faults.add(number, f"is a translation; leave out '{key}:', it is in the original")
        elif key == "set":
            name, _, setting = (part.strip() for part in value.partition("="))
            try:
                look = one_of(kind.settings)(name)(look, setting)
            except ValueError as error:
                faults.add(number, f"{where} cannot set {name} = {setting}: {error}")
        elif not value:
            what = (
                "opens nothing; name a folder or a tab" if key == "open" else "shows nothing; name a control"
            )
            faults.add(number, f"{where} {what} after '{key}:'")
        else:
            (opens if key == "open" else sees).append(value)
    parts = _parts([one for one in lines if one[1].partition(":")[0] not in KEYS])
    text = parts.pop("", (first, ""))[1]
    if not text:
        faults.add(first, f"{where} has no text")
    question = _question(parts, where, kind, first, faults) if parts else None
    if len(faults) > before:
        return None
    if same is None:
        return Stop(title, text, look, tuple(opens), tuple(sees), question)
    stop = replace(same, title=title, text=text, question=question)
    _compare(stop, same, first, faults)
    return stop


def _parted(line: str) -> tuple[str, str]:
    key, _, value = line.partition(":")
    return key, value.strip()


def _parts(lines: Lines) -> dict[str, tuple[int, str]]:
    """Return the line and the text of each part of a section in their order; the text's key is empty."""
    found: dict[str, tuple[int, list[str]]] = {"": (lines[0][0] if lines else 0, [])}
    key = ""
    for number, line in lines:
        name, colon, value = line.partition(":")
        if colon and name in PARTS:
            key, line = f"{name} again" if name in found else name, value
            found[key] = number, []
        found[key][1].append(line)
    return {key: (number, "\n".join(texts).strip()) for key, (number, texts) in found.items()}


def _question(
    parts: dict[str, tuple[int, str]], where: str, kind: Kind[Look], first: int, faults: Faults
) -> Question | None:
    line = min(number for number, _ in parts.values())
    if tuple(parts) != PARTS or not all(text for _, text in parts.values()):
        faults.add(
            line,
            f"{where} must ask with 'ask:', 'choices:' and 'reveal:', in this order, each once and with text",
        )
        return None
    line, written = parts["choices"]
    before, *items = _MARK.split(written)
    if items and before.strip():
        faults.add(
            line,
            f"{where} has '{' '.join(before.split())[:40]}' before the first choice; move it to 'ask:', or "
            "begin its line with '- [x] ' or '- [ ] '",
        )
        return None
    marks, texts = items[::2], [" ".join(item.split()) for item in items[1::2]]
    whens = [(name, word) if word else None for name, _, word in (mark.partition("=") for mark in marks)]
    computed = [when for when in whens if when is not None]
    of_one = len(set(computed)) == CHOICES and len({name for name, _ in computed}) == 1
    if len(texts) != CHOICES or not (of_one or (not computed and marks.count("x") == 1)):
        faults.add(
            line,
            f"{where} needs {CHOICES} choices: '- [x] choice' once, else '- [ ] choice | why it is wrong'; "
            "or all of them such as '- [name=word] choice | why it is wrong where it is'",
        )
        return None
    if computed and {word for _, word in computed} != set(kind.words.get(computed[0][0], ())):
        known = "; ".join(f"{name}: {', '.join(words)}" for name, words in kind.words.items())
        faults.add(
            line,
            f"{where} has choices right by words that its screen does not compute; take "
            f"{f'the three words of one name ({known}), or ' if known else ''}'- [x] choice' once",
        )
    parted = (text.partition(" | ") for text in texts)
    found = tuple(
        Choice(text.strip(), reason.strip(), when)
        for (text, _, reason), when in zip(parted, whens, strict=True)
    )
    for mark, one in zip(marks, found, strict=True):
        if (mark == "x") == bool(one.reason):
            fault = "is right but has a reason why not" if one.reason else "has no reason why it is wrong"
            remedy = "leave out what follows ' | '" if one.reason else "write a reason after ' | '"
            faults.add(line, f"{where} choice '{one.text}' {fault}; {remedy}")
    return Question(parts["ask"][1], found, parts["reveal"][1])


def _compare(stop: Stop[Look], same: Stop[Look], line: int, faults: Faults) -> None:
    """Add a fault for each part in which a translated stop differs from the original."""
    where, of = f"stop '{stop.title}'", f"'{same.title}' of the original"
    if (stop.question is None) != (same.question is None):
        faults.add(line, f"{where} must ask if and only if {of} does")
    elif stop.question is not None and same.question is not None:
        marks, others = (
            [(not one.reason, one.when) for one in question.choices]
            for question in (stop.question, same.question)
        )
        if marks != others:
            faults.add(line, f"{where} must have the marks of {of} before its choices, in the same order")
    used, wanted = (
        {found[0] for text in one.texts for found in FIELD.finditer(text)} for one in (stop, same)
    )
    for name in sorted(wanted - used):
        faults.add(line, f"{where} lacks the field {name}, which {of} has; write it in")
    for name in sorted(used - wanted):
        faults.add(line, f"{where} has the field {name}, which {of} does not have; leave it out")
