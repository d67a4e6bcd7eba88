"""Entries of the command palette, and the keys of those that have one.

The palette is viser's: *Find* in the control panel, Ctrl-K or ? opens it. ``palette.js`` recognises the keys.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from app.web.uploads import plain
from app.window.gui import Gui

Name: TypeAlias = Literal[
    "above", "front", "back", "left", "right", "node", "opened", "fit", "alone", "picture", "undo", "redo"
]


@dataclass(frozen=True, slots=True)
class Key:
    """A key as viser names it, with the modifier that is held."""

    letter: Any
    modifier: Any = None

    @property
    def name(self) -> str:
        """Name of the key in ``palette.js``, such as "mod+shift+z"."""
        held = "" if self.modifier is None else f"{self.modifier}+"
        return held.replace("cmd/ctrl", "mod") + str(self.letter).lower()


KEYS: Mapping[Name, Key] = {
    "above": Key("T"),
    "front": Key("F"),
    "back": Key("B"),
    "left": Key("L"),
    "right": Key("R"),
    "node": Key("C"),
    "opened": Key("O"),
    "fit": Key("V"),
    "alone": Key("M"),
    "picture": Key("P"),
    "undo": Key("Z", "cmd/ctrl"),
    "redo": Key("Z", "cmd/ctrl+shift"),
}
"""All keys that work on every screen. None is a key of viser (W A S D Q E and the arrows turn and move the
view, Ctrl-K opens the palette), of a lesson (arrows, page keys, space, 1 2 3, S) or of a dock (arrows, space,
Home, End, + and -). On a French keyboard Z, W, Q, A and M are in other places; of these only M and
Ctrl-Z are keys here."""


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of the palette."""

    label: str
    kind: str
    """What it is, such as "Setting on Depth"; shown below the label and searched, too."""
    action: Callable[[], object]
    """Runs on the session's thread."""
    key: Key | None = None


class Palette:
    """The entries of one panel of controls: of a browser, or of all browsers of a lecture."""

    def __init__(self, gui: Gui, post: Callable[..., None]) -> None:
        """Keep the panel; ``post`` runs a function on the session's thread."""
        self._gui, self._post = gui, post
        self._added: dict[tuple[str, str], Any] = {}
        self._entries: dict[tuple[str, str], Entry] = {}
        """The entries that are offered, by label and kind."""

    def offer(self, entries: Iterable[Entry]) -> None:
        """Offer exactly these entries. One of a known label and kind keeps its place, with the new action."""
        self._entries = {(entry.label, entry.kind): entry for entry in entries}
        for name in [name for name in self._added if name not in self._entries]:
            self._added.pop(name).remove()
        for name, entry in self._entries.items():
            if name not in self._added:
                self._added[name] = self._add(name, entry)

    def _add(self, name: tuple[str, str], entry: Entry) -> Any:
        letter, modifier = (None, None) if entry.key is None else (entry.key.letter, entry.key.modifier)
        label, kind = plain(entry.label), plain(entry.kind)
        command = self._gui.add_command(label, description=kind, hotkey=letter, modifier=modifier)
        command.on_trigger(lambda _: self._post(self._run, name))
        return command

    def _run(self, name: tuple[str, str]) -> None:
        """Run the newest action of an entry; nothing if it is no longer offered."""
        if name in self._entries:
            self._entries[name].action()
