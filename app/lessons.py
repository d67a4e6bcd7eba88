"""Kinds of lessons by screen, and a teacher's own lessons: found, read and checked before the app starts."""

from __future__ import annotations

import ast
import difflib
import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from app.lesson.faults import Fault, first_of
from app.lesson.files import LESSONS, Kind, Lesson, screen_of
from app.lesson.languages import NAMES
from app.lesson.on_screen import OWN
from app.lesson.reading import (
    TRANSLATION,
    check_lesson,
    head_of,
    read_text,
    titles_of,
)
from app.screens.calibrate.lesson import KIND as CALIBRATE
from app.screens.depth.lesson import KIND as DEPTH
from app.screens.fuse.lesson import KIND as FUSE
from app.screens.fuse.walk_lesson import KIND as WALK
from app.screens.network.lesson import KIND as NETWORK
from app.screens.surface.lesson import KIND as SURFACE
from packetmesh.errors import InputError
from pipeline.io.demos import DEMO_WALKS, DEMOS

KINDS: dict[str, Kind[Any]] = {kind.name: kind for kind in (CALIBRATE, DEPTH, FUSE, WALK, SURFACE, NETWORK)}
"""Kinds of lessons by the names of their screens in lesson files; ``walk`` is Fuse with a recording."""
SUFFIX = ".md"
_HERE = Path(__file__).parent
_SHARED = ("window", "looking", "measuring", "dock")
"""Folders with controls that several screens have; a screen has those that it imports."""


@dataclass(frozen=True, slots=True)
class OwnLesson:
    """A teacher's own lesson."""

    path: Path
    kind: str
    """Name of its kind, a key of ``KINDS``."""
    lesson: Lesson[Any]

    @property
    def place(self) -> str:
        """Query of an address that opens it at its first stop, in its scene if it names one."""
        scene = f"scene={self.lesson.scene}&" if self.lesson.scene else ""
        return f"{scene}{OWN}{self.lesson.name}=1&screen={screen_of(self.kind)}"


def own_lessons(places: Iterable[Path]) -> list[OwnLesson]:
    """Return the lessons in these files and folders.

    Raises:
        InputError: a place has no lesson, or a lesson has a fault.
    """
    lessons, faults = check_lessons(places)
    if faults:
        raise first_of(faults)
    return lessons


def by_kind(lessons: Iterable[OwnLesson]) -> dict[str, list[Lesson[Any]]]:
    """Return the lessons by the names of their kinds."""
    found: dict[str, list[Lesson[Any]]] = {}
    for one in lessons:
        found.setdefault(one.kind, []).append(one.lesson)
    return found


def check_lessons(places: Iterable[Path]) -> tuple[list[OwnLesson], list[Fault]]:
    """Read the lessons in these files and folders. Returns those without a fault, and all faults.

    Raises:
        InputError: a place does not exist, or is a folder without a lesson.
    """
    paths = list(dict.fromkeys(path for place in places for path in _files(place)))
    lessons, faults = list[OwnLesson](), list[Fault]()
    for path in paths:
        one, wrong = _check(path)
        faults += wrong
        if one is not None:
            faults += _twice(one, lessons)
            lessons.append(one)
    return lessons, faults


def _files(place: Path) -> list[Path]:
    """Return the lesson files at a place: the originals in a folder, or one file, the original if it is a
    translation.

    Raises:
        InputError: the place does not exist, or is a folder without a lesson.
    """
    if place.is_dir():
        found = sorted(path for path in place.glob(f"*{SUFFIX}") if _original(path) == path)
        if not found:
            raise InputError(f"The folder {place} has no lesson; write one as {place / 'my-lesson.md'}.")
        return found
    if not place.exists():
        raise InputError(
            f"There is no lesson {place}; give a file such as my-lesson.md, or a folder of them."
        )
    return [_original(place)]


def _original(path: Path) -> Path:
    """Return the lesson of which the file is a translation, if that exists; else the file."""
    named = TRANSLATION.fullmatch(path.stem)
    original = path if named is None or named[2] not in NAMES else path.with_name(f"{named[1]}{SUFFIX}")
    return original if original.exists() else path


def _check(path: Path) -> tuple[OwnLesson | None, list[Fault]]:
    """Return the lesson in a file and all faults; None instead of a lesson with faults."""
    named = TRANSLATION.fullmatch(path.stem)
    if named is not None and named[2] in NAMES:
        sentence = f"translates {named[1]}{SUFFIX}, which does not exist; write that file first"
        return None, [Fault(path, 0, sentence)]
    if named is not None and path.with_name(f"{named[1]}{SUFFIX}").exists():
        sentence = f"has the unknown language '{named[2]}' in its name; write one of {', '.join(NAMES)}"
        return None, [Fault(path, 0, sentence)]
    try:
        text = read_text(path)
    except InputError as error:
        return None, [Fault(path, 0, str(error))]
    head, _ = head_of(text)
    line, screen = head.get("screen", (1, ""))
    if screen in KINDS:
        return _check_on(path, text, KINDS[screen])
    fault = f"has the unknown screen '{screen[:40]}'" if screen else "names no screen"
    fault += f"; write one such as 'screen: surface': {', '.join(KINDS)}"
    name, others = _likely_screen(path, text, screen)
    if others:
        fault += f"; the other faults are those on the screen {name}"
    return None, sorted([Fault(path, line, fault), *others], key=_place)


def _place(fault: Fault) -> tuple[Path, int]:
    """Return the file and the line of a fault, by which faults are sorted."""
    return fault.path, fault.line


def _likely_screen(path: Path, text: str, screen: str) -> tuple[str, list[Fault]]:
    """Return the screen that a lesson with the unknown screen ``screen`` means, and its faults there: that of
    the most similar name, else the one on which it has the fewest faults.
    """
    near = difflib.get_close_matches(screen.lower(), KINDS, n=1, cutoff=0.75)
    found = {name: _check_on(path, text, KINDS[name])[1] for name in near or KINDS}
    name = min(found, key=lambda one: len(found[one]))
    return name, found[name]


def _check_on(path: Path, text: str, kind: Kind[Any]) -> tuple[OwnLesson | None, list[Fault]]:
    """Return the lesson of a screen in a file, and all faults; None instead of a lesson with faults."""
    lesson, faults = check_lesson(path, kind)
    faults += _scene_faults(path, head_of(text)[0], kind)
    faults += _unknown_names(path, text, kind)
    faults.sort(key=_place)
    return (None if lesson is None or faults else OwnLesson(path, kind.name, lesson)), faults


def _scene_faults(path: Path, head: Mapping[str, tuple[int, str]], kind: Kind[Any]) -> Sequence[Fault]:
    """Return a fault if the head names a scene that is not a demo scene; for a walk, not a demo recording."""
    line, scene = head.get("scene", (0, ""))
    scenes = DEMO_WALKS if kind is WALK else DEMOS
    if line == 0 or scene in scenes:
        return ()
    return (Fault(path, line, f"has the scene '{scene[:40]}'; write one of {', '.join(scenes)}"),)


def _unknown_names(path: Path, text: str, kind: Kind[Any]) -> list[Fault]:
    """Return a fault for each folder, tab, control or number to show that the screen does not have."""
    folders, names = names_on(screen_of(kind.name))
    faults = []
    for number, line in enumerate(text.splitlines(), 1):
        key, colon, value = line.partition(":")
        known = folders if key == "open" else names
        name = value.strip()
        if not colon or key not in ("open", "see") or not name or name in known:
            continue
        near = difflib.get_close_matches(name, folders if key == "open" else _labels(names), n=3, cutoff=0.6)
        what = "folder or tab" if key == "open" else "control or number"
        if near:
            advice = f"try {' or '.join(near)}"
        elif key == "open":
            advice = f"it has {', '.join(sorted(folders))}"
        else:
            advice = "write its name as it is on the screen"
        sentence = f"has the {what} '{name[:60]}', which its screen does not have; {advice}"
        faults.append(Fault(path, number, sentence))
    return faults


@cache
def names_on(screen: str) -> tuple[frozenset[str], frozenset[str]]:
    """Return the titles of a screen's folders and tabs, and all texts in its code, labels included.

    Choices of drop-downs, which cannot be framed, are left out, but for those of one small word: some of them
    are names of numbers, too, such as fx.
    """
    own = _modules(f"screens/{screen}")
    shared = (_modules(place) for place in _SHARED if any(f"app.{place}" in text for text in own))
    trees = [ast.parse(text) for text in (*own, *itertools.chain.from_iterable(shared))]
    constants = _constants(trees)
    folders, texts, labels, choices = set[str](), set[str](), set[str](), set[str]()
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.add(node.value)
        if isinstance(node, ast.Call | ast.List):
            labels |= _labels_in(node, constants)
        if isinstance(node, ast.Call) and _called(node) in ("add_folder", "add_tab"):
            folders |= _texts_in(node.args[:1], {})
        elif isinstance(node, ast.Call) and _called(node) == "add_dropdown":
            choices |= _texts_in(node.args[1:2], constants)
    only_choices = {text for text in choices - labels if " " in text or text[:1].isupper()}
    return frozenset(folders), frozenset(texts - only_choices)


def _modules(place: str) -> list[str]:
    """Return the code of all modules in a folder of the app."""
    return [path.read_text(encoding="utf-8") for path in sorted((_HERE / place).rglob("*.py"))]


def _called(call: ast.Call) -> str:
    """Return the last part of the name of the function that is called; empty without a name."""
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def _constants(trees: Iterable[ast.Module]) -> Mapping[str, list[ast.expr]]:
    """Return the values of the modules' constants by their names."""
    found: dict[str, list[ast.expr]] = {}
    for node in (node for tree in trees for node in tree.body):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value is not None:
            found.setdefault(node.target.id, []).append(node.value)
        if isinstance(node, ast.Assign):
            for target in node.targets:
                pairs = [(target, node.value)]
                if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    pairs = list(zip(target.elts, node.value.elts, strict=False))
                for name, value in pairs:
                    if isinstance(name, ast.Name):
                        found.setdefault(name.id, []).append(value)
    return found


def _labels_in(node: ast.Call | ast.List, constants: Mapping[str, list[ast.expr]]) -> set[str]:
    """Return the labels of controls that a call adds, and the names of the rows that a call or list has."""
    parts = node.args if isinstance(node, ast.Call) else node.elts
    rows = [part.elts[0] for part in parts if isinstance(part, ast.Tuple) and len(part.elts) > 1]
    if isinstance(node, ast.Call):
        name = _called(node)
        rows += node.args[
            : 2 if name == "buttons" else int(name.startswith("add_") or name in ("row", "term"))
        ]
    return _texts_in(rows, constants)


def _texts_in(nodes: Iterable[ast.AST], constants: Mapping[str, list[ast.expr]]) -> set[str]:
    """Return the texts in expressions, those of constants included, of dictionaries only the keys."""
    texts, left, seen = set[str](), list(nodes), set[str]()
    while left:
        node = left.pop()
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.add(node.value)
        elif isinstance(node, ast.Name | ast.Attribute):
            name = node.attr if isinstance(node, ast.Attribute) else node.id
            if name not in seen:
                seen.add(name)
                left += constants.get(name, [])
        elif isinstance(node, ast.Dict):
            pairs = zip(node.keys, node.values, strict=True)
            left += [value if key is None else key for key, value in pairs]
        elif isinstance(node, ast.Call):
            left += node.args
        elif not isinstance(node, ast.DictComp):
            left += ast.iter_child_nodes(node)
    return texts


def _labels(texts: Iterable[str]) -> list[str]:
    """Return the texts that can be labels: short, no sentences, and beginning with a capital letter."""
    return [text for text in texts if re.fullmatch(r"[A-Z].{0,38}[^.]", text)]


def _twice(one: OwnLesson, others: Iterable[OwnLesson]) -> list[Fault]:
    """Return a fault if another lesson, own or shipped, has the name or a title of this one.

    A title is compared in all languages, because the start page opens a lesson by any of its titles.
    """
    taken = dict[str, str]()
    for other in others:
        if other.path.stem == one.path.stem:
            return [Fault(one.path, 0, f"has the name of {other.path}; rename one of the two files")]
        taken |= dict.fromkeys(_titles(other).values(), other.path.name)
    shipped = [path for path in LESSONS.glob(f"*{SUFFIX}") if _original(path) == path]
    if one.path.resolve() not in shipped:
        taken |= {title: "a lesson that ships" for path in shipped for title in titles_of(path).values()}
    return [
        Fault(path, 1, f"has the title of {taken[title]}; give it another title")
        for path, title in _titles(one).items()
        if title in taken
    ]


def _titles(one: OwnLesson) -> dict[Path, str]:
    """Return the titles of a lesson by the files in which they are."""
    titles = {one.path: one.lesson.title}
    for code, other in one.lesson.translations.items():
        titles[one.path.with_name(f"{one.path.stem}.{code}{SUFFIX}")] = other.title
    return titles
