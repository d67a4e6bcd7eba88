"""Parts of a screen whose state is written in the page's address."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from app.window.ui import Ui
from packetmesh.errors import InputError

if TYPE_CHECKING:
    import viser

STOP = "stop"
"""Prefix of the lessons' keys in the address. The browser's Back button goes from stop to stop."""


class InAddress(Protocol):
    """A part of a screen whose state is in the address."""

    def place(self) -> str:
        """Return the state as text; empty for the start state."""
        ...

    def take(self, place: str) -> None:
        """Go to a state, at once or when its results have been computed.

        Raises:
            InputError: there is no such state.
        """
        ...


@dataclass(frozen=True, slots=True)
class CallbackState:
    """State of a screen that is read and applied by two callbacks."""

    read: Callable[[], str]
    apply: Callable[[str], object]

    def place(self) -> str:
        """Return the state as text."""
        return self.read()

    def take(self, place: str) -> None:
        """Go to a state."""
        self.apply(place)


@dataclass(frozen=True, slots=True)
class Picked:
    """A drop-down whose choice is in the address."""

    handle: viser.GuiDropdownHandle[str]
    names: Mapping[str, str]
    """Labels by the names used in the address; the first is the start value."""
    action: Callable[[], object]
    """Called after a change."""

    def place(self) -> str:
        """Return the name of the choice; empty for the first."""
        names = list(self.names)[1:]
        return next((name for name in names if self.names[name] == self.handle.value), "")

    def take(self, place: str) -> None:
        """Choose by name; an empty name chooses the first.

        Raises:
            InputError: the list has no such name.
        """
        name = place or next(iter(self.names))
        if name not in self.names or self.names[name] not in self.handle.options:
            raise InputError(f"The address has {name[:40]}; try one of {', '.join(self.names)}")
        if self.handle.value != self.names[name]:
            self.handle.value = self.names[name]
            self.action()


class Awaited:
    """A drop-down whose names come with results; an address may request a name before the list has it."""

    def __init__(self, ui: Ui, handle: viser.GuiDropdownHandle[str], action: Callable[[], object]) -> None:
        """Keep the drop-down ``handle``; ``action`` is called after a change."""
        self._ui, self._handle, self._action, self._requested = ui, handle, action, ""
        ui.when_changed(handle, self._picked)

    @property
    def value(self) -> str:
        """The chosen name."""
        return self._handle.value

    def _picked(self) -> None:
        self._requested = ""
        self._action()

    def offer(self, names: tuple[str, ...], all_there: bool = True) -> None:
        """Set the names of the list. A name that was chosen or requested is selected if it is among them.

        Args:
            names: one name or more.
            all_there: whether no more names will come: a requested name that is missing is then reported.
        """
        chosen = self._requested or self.value
        if names != self._handle.options:
            self._handle.options = names
        if chosen not in names:
            chosen = names[0]
        elif chosen == self._requested:
            self._requested = ""
        if chosen != self.value:
            self._handle.value = chosen
        if all_there and self._requested:
            unknown, self._requested = self._requested, ""
            self._ui.post(tell_unknown, unknown, names)

    def place(self) -> str:
        """Return the name that is chosen or requested; empty for the first."""
        return self._requested or ("" if self.value == self._handle.options[0] else self.value)

    def take(self, place: str) -> None:
        """Choose a name, at once or as soon as the list has it."""
        name = place or self._handle.options[0]
        self._requested = "" if name in self._handle.options else name
        if not self._requested and name != self.value:
            self._handle.value = name
            self._action()


def tell_unknown(name: str, names: Collection[str]) -> None:
    """Report that an address names an entry that does not exist.

    Raises:
        InputError: always; the session shows it.
    """
    raise InputError(f"The address has {name[:40]}, which does not exist here; try one of {', '.join(names)}")
