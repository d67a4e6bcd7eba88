"""A step of the app, and the session that runs its jobs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from app.compute.state import Results, Spec, Step
from app.compute.store import Store
from app.web.markup import Markdown
from app.web.uploads import Uploads
from app.window.in_address import InAddress
from app.window.ui import Target, Ui
from pipeline.config import PipelineConfig

if TYPE_CHECKING:
    import viser


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


class PanelSession(Protocol):
    """The session as its panels see it; all but ``post`` is called on the session's thread."""

    target: Target
    ui: Ui
    store: Store
    uploads: Uploads
    folder: Path
    """Where its uploads are kept."""
    spec: Spec
    results: Results
    panels: Sequence[Panel]
    current: Panel

    def post(self, function: Callable[..., None], *arguments: Any) -> None:
        """Run a function on the session's thread; its errors become notifications."""
        ...

    def clients(self) -> Iterable[viser.ClientHandle]:
        """Return the browsers whose view the session turns."""
        ...

    def notify(self, title: str, sentence: str, color: Any = "red") -> None:
        """Show a notification in the browsers."""
        ...

    def new_folder(self) -> Path:
        """Make a folder for an upload, or for what is made of one."""
        ...

    def edit(self, change: Callable[[PipelineConfig], PipelineConfig]) -> None:
        """Change the settings and recompute what depends on them."""
        ...

    def want(self, spec: Spec) -> None:
        """Take another spec and recompute what depends on the difference."""
        ...

    def side_job(
        self,
        job: str,
        *arguments: Any,
        on_end: Callable[[Any], None],
        on_partial: Callable[[Any], None] = ...,
    ) -> None:
        """Run a job next to the chain, in place of the one before."""
        ...

    def quick_job(self, job: str, *arguments: Any, on_end: Callable[[Any], None]) -> None:
        """Run a job of a fraction of a second; of several submitted, only the last."""
        ...

    def cancel_side_job(self) -> None:
        """Stop the side job now."""
        ...

    def offers(self) -> tuple[Offers, ...]:
        """Return the files that all screens offer for download."""
        ...

    def show(self, title: str) -> None:
        """Show the step of that title."""
        ...

    def frame_view(self, anew: bool = False, keep: bool = False) -> None:
        """Turn the view to what is shown; ``keep`` leaves it where a person has turned it."""
        ...

    def show_staleness(self) -> None:
        """Dim the numbers and the picture while they belong to other settings."""
        ...


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

    def __init__(self, session: PanelSession) -> None:
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
