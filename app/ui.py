"""What every screen is made of: where its controls and drawings go, and the session it asks for work."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

import numpy as np

from app.debounce import Debounce
from app.state import Spec, Step
from app.tables import command_html
from app.web.markup import Markdown
from app.web.uploads import plain
from app.window.gui import Gui
from packetmesh.errors import InputError
from pipeline.types import FloatArray

if TYPE_CHECKING:
    import viser

    from app.lecture import Lecture
    from app.session import Session

STOP = "stop"
"""What the keys of lessons in the address begin with: Back goes from stop to stop."""
Input = TypeVar("Input", bound="viser.GuiInputHandle[Any]")


@dataclass(frozen=True, slots=True)
class Ui:
    """A browser's control panel and scene; what a person does there is answered on the session's thread."""

    gui: Gui
    scene: viser.SceneApi
    post: Callable[..., None]
    """Runs a function on the session's thread."""
    atomic: Callable[[], AbstractContextManager[None]]
    """Groups what is sent to the browser."""
    flush: Callable[[], None]
    """Sends it now."""
    closers: list[Callable[[], None]] = field(default_factory=list)
    """What ends the timers and threads of the screens."""
    resets: list[Callable[[], None]] = field(default_factory=list)
    """What *Reset* takes back beside the settings and the screens."""
    lecture: Lecture | None = None
    """Whose browsers all see the same."""

    def when_changed(self, handle: Input, action: Callable[[], object]) -> Input:
        """The handle, whose changes by a person, not by the program, cause ``action``."""

        def changed(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                self.post(action)

        handle.on_update(changed)
        return handle

    def buttons(
        self, label: str, actions: Mapping[str, Callable[[], object]], hint: str, visible: bool = True
    ) -> viser.GuiButtonGroupHandle[str]:
        """A row of buttons with what each of them does."""
        group = self.gui.add_button_group(label, tuple(actions), hint=hint, visible=visible)
        group.on_click(lambda event: self.post(actions[event.target.value]))
        return group

    def show_command(self, command: str) -> None:
        """Show a command in a window of its own."""
        with self.gui.add_modal("The same from the command line") as modal:
            self.gui.add_markdown(Markdown("This computes and writes what the app shows now:"))
            self.gui.add_html(command_html(plain(command)))
            self.gui.add_button("Close").on_click(lambda _: modal.close())

    def when_clicked(self, below: str, action: Callable[[FloatArray, FloatArray], object]) -> None:
        """Answer a click while the node ``below`` is shown: ``action`` gets its ray, origin and direction."""

        def clicked(event: Any) -> None:
            if self.shows(below):
                action(np.array(event.ray_origin), np.array(event.ray_direction))

        self.scene.on_click()(lambda event: self.post(clicked, event))

    def shows(self, name: str) -> bool:
        """Whether a scene node is there and visible."""
        frame = self.scene.get_handle_by_name(name)
        return frame is not None and frame.visible

    def debounce(self, wait_s: float, action: Callable[[], object]) -> Debounce:
        """A timer whose ``action`` runs on the session's thread."""
        timer = Debounce(wait_s, lambda: self.post(action))
        self.closers.append(timer.cancel)
        return timer

    def close(self) -> None:
        """End all timers and threads of the screens."""
        for close in self.closers:
            close()


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
class Said:
    """A part whose two ways are elsewhere."""

    say: Callable[[], str]
    hear: Callable[[str], object]

    def place(self) -> str:
        """Its state."""
        return self.say()

    def take(self, place: str) -> None:
        """Go to such a state."""
        self.hear(place)


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


@dataclass(frozen=True, slots=True)
class Offer:
    """A file to take along."""

    label: str
    file: str
    """Its name."""
    job: str
    """That makes its content, as bytes."""
    arguments: tuple[Any, ...] = ()
    photographs: bool = False
    """Whether the job takes the 3-D view as the browser draws it, (H, W, 4), as its last argument."""


NO_NOTE = Markdown("")


@dataclass(frozen=True, slots=True)
class Offers:
    """Files of one kind, and how a command makes the same."""

    kind: str
    hint: str
    files: tuple[Offer, ...]
    command: str = ""
    note: Markdown = NO_NOTE
    """On the command, or why there is none."""


class Panel(ABC):
    """A step: its controls in the control panel and its nodes in the 3-D scene.

    All methods run on the session's thread.
    """

    title: ClassVar[str]
    step: ClassVar[Step | None] = None
    """The step of the chain whose result it shows."""
    drawn_below: ClassVar[str]
    """Scene node under which it draws; only the current step's is visible."""
    only_when_shown: ClassVar[bool] = False
    """Whether its step is computed only while it is the current one."""

    def __init__(self, session: Session) -> None:
        self.session, self.ui = session, session.ui
        self.gui, self.scene = session.ui.gui, session.ui.scene
        self.in_address: dict[str, InAddress] = {}
        """By key, what the address says while what the screen draws is shown; lessons under ``STOP``."""

    @abstractmethod
    def build(self) -> None:
        """Add the controls to the current container."""

    def on_spec(self, spec: Spec) -> None:
        """The settings or the source changed."""

    def on_view(self, step: Step, view: Any) -> None:
        """A step of the chain, this or another, has a new view."""

    def on_partial(self, view: Any) -> None:
        """This panel's step shows what it has so far."""

    def on_failure(self, step: Step, sentence: str) -> None:
        """A step, this or another, could not be computed, or was cancelled."""

    def on_show(self) -> None:
        """This became the current step."""

    def on_hide(self) -> None:
        """Another step becomes the current one."""

    def on_action(self, action: str) -> None:
        """A button for all steps was pressed."""

    @property
    def ahead(self) -> bool:
        """Whether its picture is newer than its numbers, as while a hand drags a slider."""
        return False

    def look(self) -> bool:
        """Turn the view to what it draws; False leaves that to the session, which turns it to the scene."""
        return False

    def offers(self) -> tuple[Offers, ...]:
        """What can be taken along of what it shows."""
        return ()

    @property
    def command(self) -> str:
        """The command line that computes what it shows."""
        return self.session.spec.command()

    @property
    def wide(self) -> bool:
        """Whether it shows two things side by side."""
        return False
