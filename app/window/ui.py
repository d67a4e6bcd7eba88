"""A browser's control panel and scene, with handlers that run on the session's thread."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar

import numpy as np

from app.web.markup import Markdown
from app.web.uploads import plain
from app.window.debounce import Debounce
from app.window.gui import Gui
from app.window.tables import command_html
from app.window.teaching import Teaching
from pipeline.types import FloatArray

if TYPE_CHECKING:
    import viser

Input = TypeVar("Input", bound="viser.GuiInputHandle[Any]")
Target: TypeAlias = "viser.ClientHandle | viser.ViserServer"
"""Where a session's controls and drawings go: one browser, or the server in a lecture."""
Count: TypeAlias = Callable[[str, int], None]
"""Counts a vote: takes the voter's id and the choice, which starts at 1."""


class SharedBy(Protocol):
    """The browsers that share a session in a lecture."""

    @property
    def class_size(self) -> int:
        """Number of browsers that do not teach."""
        ...

    def followers(self) -> Iterable[viser.ClientHandle]:
        """Return the browsers whose view the session turns."""
        ...

    def everybody(self) -> Iterable[viser.ClientHandle]:
        """Return all browsers."""
        ...

    def poll(self, count: Count | None) -> None:
        """Open a vote whose votes ``count`` receives, or close it (None)."""
        ...


@dataclass(frozen=True, slots=True)
class Ui:
    """A browser's control panel and scene; their events are handled on the session's thread."""

    gui: Gui
    scene: viser.SceneApi
    post: Callable[..., None]
    """Runs a function on the session's thread."""
    atomic: Callable[[], AbstractContextManager[None]]
    """Groups messages to the browser."""
    flush: Callable[[], None]
    """Sends the messages now."""
    lecture: SharedBy | None = None
    """The lecture whose browsers all show the same; None for a session of one browser."""
    teaching: Teaching = field(default_factory=Teaching)
    """State that its lessons share."""
    closers: list[Callable[[], None]] = field(default_factory=list)
    """Functions that stop the timers and threads of the screens."""
    resets: list[Callable[[], None]] = field(default_factory=list)
    """Functions that *Reset* calls before it resets the screens and the settings."""

    def when_changed(self, handle: Input, action: Callable[[], object]) -> Input:
        """Call ``action`` when a user, not the program, changes ``handle``. Returns the handle."""

        def changed(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                self.post(action)

        handle.on_update(changed)
        return handle

    def buttons(
        self, label: str, actions: Mapping[str, Callable[[], object]], hint: str, visible: bool = True
    ) -> viser.GuiButtonGroupHandle[str]:
        """Add a row of buttons with their actions."""
        group = self.gui.add_button_group(label, tuple(actions), hint=hint, visible=visible)
        group.on_click(lambda event: self.post(actions[event.target.value]))
        return group

    def show_command(self, command: str) -> None:
        """Show a command line in a modal window."""
        with self.gui.add_modal("The same from the command line") as modal:
            self.gui.add_markdown(
                Markdown("This command computes and writes the results that the app shows now:")
            )
            self.gui.add_html(command_html(plain(command)))
            self.gui.add_button("Close").on_click(lambda _: modal.close())

    def when_clicked(self, below: str, action: Callable[[FloatArray, FloatArray], object]) -> None:
        """Call ``action`` with (3,) origin and direction of a click's ray, if the node ``below`` is shown."""

        def clicked(event: Any) -> None:
            if self.shows(below):
                action(np.array(event.ray_origin), np.array(event.ray_direction))

        self.scene.on_click()(lambda event: self.post(clicked, event))

    def shows(self, name: str) -> bool:
        """Whether a scene node exists and is visible."""
        frame = self.scene.get_handle_by_name(name)
        return frame is not None and frame.visible

    def debounce(self, wait_s: float, action: Callable[[], object]) -> Debounce:
        """Return a timer whose ``action`` runs on the session's thread."""
        timer = Debounce(wait_s, lambda: self.post(action))
        self.closers.append(timer.cancel)
        return timer

    def close(self) -> None:
        """Stop all timers and threads of the screens."""
        for close in self.closers:
            close()
