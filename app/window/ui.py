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
from pipeline.types import FloatArray

if TYPE_CHECKING:
    import viser

Input = TypeVar("Input", bound="viser.GuiInputHandle[Any]")
Target: TypeAlias = "viser.ClientHandle | viser.ViserServer"
"""Where a session's controls and drawings go: one browser, or the server for a session that all share."""
Count: TypeAlias = Callable[[int, int], None]
"""Counts the vote of a voter, both by their numbers; choices count from 1."""


class SharedBy(Protocol):
    """The people who share a session in a lecture."""

    @property
    def class_size(self) -> int:
        """Browsers that do not teach."""
        ...

    def followers(self) -> Iterable[viser.ClientHandle]:
        """Browsers whose view the session turns."""
        ...

    def everybody(self) -> Iterable[viser.ClientHandle]:
        """All browsers."""
        ...

    def poll(self, count: Count | None) -> None:
        """Open a vote whose votes ``count`` gets, or close it."""
        ...


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
    lecture: SharedBy | None = None
    """The lecture whose browsers all show the same; None for a session of one browser."""

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
