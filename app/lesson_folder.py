"""The folder with a lesson."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic

import viser

from app.lesson import Lesson, Look

OFF = "not now"
BEGIN = "Choose a stop, or press **Next**."


class LessonFolder(Generic[Look]):
    """Leads through a lesson stop by stop; every stop sets the screen's controls."""

    def __init__(
        self,
        gui: viser.GuiApi,
        lesson: Lesson[Look],
        post: Callable[..., None],
        changed: Callable[[Any, Callable[[], None]], None],
        on_stop: Callable[[Look], None],
    ) -> None:
        """Add the folder.

        Args:
            gui: where to add it.
            lesson: whose stops to show.
            post: runs a function on the session's thread.
            changed: registers an action for a change of a handle by a person.
            on_stop: called with what the stop shows.
        """
        self._lesson = lesson
        self._on_stop = on_stop
        self._names = [f"{i}. {stop.title}" for i, stop in enumerate(lesson.stops, 1)]
        with gui.add_folder(f"Lesson: {lesson.title}", expand_by_default=False):
            self._stop = gui.add_dropdown(
                "Stop",
                [OFF, *self._names],
                hint="Shows what to look at and sets the controls below; change them as you like.",
            )
            changed(self._stop, self._picked)
            keys = gui.add_button_group("Go", ("Back", "Next"), hint="To the stop before or after.")
            keys.on_click(lambda event: post(self._go, 1 if event.target.value == "Next" else -1))
            self._text = gui.add_markdown(BEGIN)

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
            return
        stop = self._lesson.stops[index]
        self._text.content = f"**{stop.title}** ({index + 1} of {len(self._names)})\n\n{stop.text}"
        self._on_stop(stop.look)
