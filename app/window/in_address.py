"""States of a screen's parts as they are written in the page's address."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from app.window.ui import Ui
from packetmesh.errors import InputError

if TYPE_CHECKING:
    import viser

STOP = "stop"
"""Keys of lessons in the address begin with this; Back goes from stop to stop."""


class InAddress(Protocol):
    """What the address says of a part of a screen."""

    def place(self) -> str:
        """Its state; empty where it is as at the start."""
        ...

    def take(self, place: str) -> None:
        """Go to such a state, at once or when what it is about has come.

        Raises:
            InputError: there is none like it.
        """
        ...


@dataclass(frozen=True, slots=True)
class CallbackState:
    """State of a screen that is read and applied by two callbacks."""

    read: Callable[[], str]
    apply: Callable[[str], object]

    def place(self) -> str:
        """Its state."""
        return self.read()

    def take(self, place: str) -> None:
        """Go to such a state."""
        self.apply(place)


@dataclass(frozen=True, slots=True)
class Picked:
    """A list, of which the address says what was picked."""

    handle: viser.GuiDropdownHandle[str]
    names: Mapping[str, str]
    """What the address says, and what the list says; the first is the one of the start."""
    action: Callable[[], object]
    """Answers a change."""

    def place(self) -> str:
        """The name of what is picked."""
        names = list(self.names)[1:]
        return next((name for name in names if self.names[name] == self.handle.value), "")

    def take(self, place: str) -> None:
        """Pick it."""
        name = place or next(iter(self.names))
        if name not in self.names or self.names[name] not in self.handle.options:
            raise InputError(f"The address has {name[:40]}; try one of {', '.join(self.names)}")
        if self.handle.value != self.names[name]:
            self.handle.value = self.names[name]
            self.action()


class Awaited:
    """A list whose names come with what is computed; an address may ask for one of them before."""

    def __init__(self, ui: Ui, handle: viser.GuiDropdownHandle[str], action: Callable[[], object]) -> None:
        """Take care of a list; ``action`` answers a change."""
        self._ui, self._handle, self._action, self._asked = ui, handle, action, ""
        ui.when_changed(handle, self._picked)

    @property
    def value(self) -> str:
        """The name that is picked."""
        return self._handle.value

    def _picked(self) -> None:
        self._asked = ""
        self._action()

    def offer(self, names: tuple[str, ...], all_there: bool = True) -> None:
        """Have the list hold these names; the one that was picked or asked for is picked if it is there."""
        chosen = self._asked or self.value
        if names != self._handle.options:
            self._handle.options = names
        if chosen not in names:
            chosen = names[0]
        elif chosen == self._asked:
            self._asked = ""
        if chosen != self.value:
            self._handle.value = chosen
        if all_there and self._asked:
            unknown, self._asked = self._asked, ""
            self._ui.post(tell_unknown, unknown, names)

    def place(self) -> str:
        """The name that is picked or asked for, unless it is the first."""
        return self._asked or ("" if self.value == self._handle.options[0] else self.value)

    def take(self, place: str) -> None:
        """Pick it, at once or when it is there."""
        name = place or self._handle.options[0]
        self._asked = "" if name in self._handle.options else name
        if not self._asked and name != self.value:
            self._handle.value = name
            self._action()


def tell_unknown(asked: str, names: Collection[str]) -> None:
    """Say that an address asks for a name that is not there.

    Raises:
        InputError: always; a session tells it.
    """
    raise InputError(f"The address has {asked[:40]}, which is not here; try one of {', '.join(names)}")
