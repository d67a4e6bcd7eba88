"""All lessons of one screen: those that ship and a teacher's own; and its numbers as a sentence."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Generic

from app.lesson.files import Kind, Look, Numbers
from app.lesson.player import LessonFolder
from app.lesson.reading import shipped_lesson
from app.web.markup import Markup
from app.window.in_address import STOP, InAddress
from app.window.page import page_call
from app.window.teaching import LANGUAGE
from app.window.ui import Ui

OWN = f"{STOP}-own-"
"""Beginning of the keys of a teacher's own lessons in the address."""


class ScreenLessons(Generic[Look]):
    """The lessons of a screen, of which one at most is shown, and the statement for screen readers."""

    def __init__(
        self,
        ui: Ui,
        kind: Kind[Look],
        shipped: Mapping[str, Path],
        on_stop: Callable[[Look], None],
        numbers: Callable[[], Numbers] = dict,
        on_end: Callable[[], None] = lambda: None,
    ) -> None:
        """Add a folder for each lesson, and the sentence for screen readers.

        Args:
            ui: panel of the browser.
            kind: what the lessons set and compute.
            shipped: files of the lessons that ship, by their keys in the address.
            on_stop: called with the state that a stop shows.
            numbers: returns the texts for the fields; empty while they are computed.
            on_end: called when a lesson is left.
        """
        self._kind, self._on_stop, self._on_end = kind, on_stop, on_end
        self.waiting: Look | None = None
        """What a stop sets once the screen has a result; the screen then makes it None. Before that, the stop
        has no numbers."""
        self._numbers = lambda: numbers() if self.waiting is None else {}
        lessons = {key: shipped_lesson(path, kind) for key, path in shipped.items()}
        lessons |= {f"{OWN}{one.name}": one for one in ui.teaching.own.get(kind.name, ())}
        self._folders = {
            key: LessonFolder(ui, lesson, partial(self._take_stop, key), self._numbers, self._leave)
            for key, lesson in lessons.items()
        }
        self._stated = ""
        self._statement = ui.gui.add_html(Markup(""))
        self.in_address: dict[str, InAddress] = {**self._folders, LANGUAGE: ui.teaching}
        """The stops of the lessons and their language, by their keys in the address."""

    def _take_stop(self, key: str, look: Look) -> None:
        """Leave the other lessons, and show the stop of this one."""
        for other, folder in self._folders.items():
            if other != key and folder.place():
                folder.take("")
        self._on_stop(look)

    def _leave(self) -> None:
        self.waiting = None
        self._on_end()

    def leave(self) -> None:
        """Leave the lesson that is shown."""
        for folder in self._folders.values():
            if folder.place():
                folder.take("")

    def refresh(self) -> None:
        """Update the numbers of the stop and the statement after the screen has changed."""
        for folder in self._folders.values():
            folder.refresh()
        numbers = self._numbers()
        stated = self._kind.statement(numbers) if numbers else ""
        if stated and stated != self._stated:
            self._stated = stated
            self._statement.content = page_call("state", stated)
