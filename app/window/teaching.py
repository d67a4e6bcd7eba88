"""State that the lessons of one session share: a teacher's own lessons, and the language of the texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from packetmesh.errors import InputError

ENGLISH = "en"
LANGUAGE = "lang"
"""Key of the language in the address."""


@dataclass(slots=True)
class Teaching:
    """The lessons' shared state. The language is the browser's own until another one is chosen."""

    own: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    """The teacher's own lessons, ``app.lesson.files.Lesson``, by the kind of screen."""
    languages: Mapping[str, str] = field(default_factory=lambda: {ENGLISH: "English"})
    """Names of all languages of lessons, each in its own language, by code."""
    own_language: str = ENGLISH
    """Code of the browser's language."""
    on_change: list[Callable[[], None]] = field(default_factory=list)
    """Called after another language was chosen."""
    _chosen: str = ""

    @property
    def language(self) -> str:
        """Code of the language in which lessons are shown."""
        return self._chosen or self.own_language

    def place(self) -> str:
        """Return the chosen language for the address; empty for the browser's own."""
        return self._chosen

    def take(self, place: str) -> None:
        """Choose a language by its code; empty chooses the browser's own.

        Raises:
            InputError: no lesson has this language.
        """
        if place and place not in self.languages:
            raise InputError(f"The address has lang={place[:9]}; try one of {', '.join(self.languages)}")
        self._chosen = place
        for action in self.on_change:
            action()
