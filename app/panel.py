"""What every step of the app is made of."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import viser

from app.state import Spec, Step

if TYPE_CHECKING:
    from app.session import Session


class Panel(ABC):
    """A step: its controls in the control panel and its nodes in the 3-D scene.

    All methods run on the session's own thread.
    """

    title: ClassVar[str]
    step: ClassVar[Step | None] = None
    """The step of the chain whose result it shows."""
    drawn_below: ClassVar[str]
    """Scene node under which it draws; only the current step's is visible."""

    def __init__(self, session: Session) -> None:
        self.session = session

    @property
    def gui(self) -> viser.GuiApi:
        """Where controls go."""
        return self.session.gui

    @property
    def scene(self) -> viser.SceneApi:
        """Where the 3-D nodes go."""
        return self.session.scene

    def when_changed(self, handle: Any, action: Callable[[], None]) -> None:
        """Have ``action`` done on the session's thread when a person changes an input."""

        def changed(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self.session.post(action)

        handle.on_update(changed)

    @abstractmethod
    def build(self) -> None:
        """Add the controls to the current container."""

    def on_spec(self, spec: Spec) -> None:
        """The settings or the source changed."""

    def on_view(self, step: Step, view: Any) -> None:
        """A step of the chain, this or another, has a new view."""

    def on_partial(self, view: Any) -> None:
        """This panel's step shows what it has so far."""

    def on_show(self) -> None:
        """This became the current step."""

    def on_action(self, action: str) -> None:
        """A button for all steps was pressed."""

    def look(self) -> bool:
        """Turn the view to what it draws; False leaves that to the session, which turns it to the scene."""
        return False

    @property
    def command(self) -> str:
        """The command line that computes what it shows."""
        return self.session.spec.command()

    @property
    def wide(self) -> bool:
        """Whether it shows two things side by side."""
        return False

    def close(self) -> None:
        """The browser is gone."""
