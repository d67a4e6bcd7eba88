"""A step's panel, and the interface of the session that runs its jobs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Sequence
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
    """A file that a screen offers for download."""

    label: str
    file: str
    """Name of the file."""
    job: str
    """Address of the job that makes the content as bytes."""
    arguments: tuple[Any, ...] = ()
    photographs: bool = False
    """Whether the job's last argument is the 3-D view as the browser draws it, (H, W, 4)."""


NO_NOTE = Markdown("")


@dataclass(frozen=True, slots=True)
class Offers:
    """Files of one kind, and the command that makes the same files."""

    kind: str
    hint: str
    files: tuple[Offer, ...]
    command: str = ""
    note: Markdown = NO_NOTE
    """Note about the command, or the reason why there is none."""


class PanelSession(Protocol):
    """The session's interface for its panels; all but ``post`` is called on the session's thread."""

    target: Target
    ui: Ui
    store: Store
    uploads: Uploads
    folder: Path
    """Folder of the session's uploads."""
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
        """Make a folder for an upload, or for files made from one."""
        ...

    def edit(self, change: Callable[[PipelineConfig], PipelineConfig]) -> None:
        """Change the settings and recompute what depends on them."""
        ...

    def want(self, spec: Spec) -> None:
        """Change the spec and recompute what depends on the difference."""
        ...

    def side_job(
        self,
        job: str,
        *arguments: Any,
        on_end: Callable[[Any], None],
        on_partial: Callable[[Any], None] = ...,
    ) -> None:
        """Run a job after the chain's running step, in place of the side job before it.

        ``on_partial`` gets partial results, and ``on_end`` the result or None on failure.
        """
        ...

    def quick_job(
        self, job: str, *arguments: Any, on_end: Callable[[Any], None], key: Hashable = None
    ) -> None:
        """Run a short job in parallel with the chain; it replaces an earlier one of its module.

        ``on_end`` gets the answer, or None if the job failed or was stopped; it is not called for a job that
        was replaced while it waited. Answers with a key are shared by all sessions.
        """
        ...

    def cancel_side_job(self) -> None:
        """Stop the side job; its ``on_end`` gets None."""
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
    """The step whose result it shows; None if it has none."""
    drawn_below: ClassVar[str]
    """Scene node under which it draws; only the current panel's node is visible."""
    only_when_shown: ClassVar[bool] = False
    """Whether its step is computed only while the panel is the current one."""

    def __init__(self, session: PanelSession) -> None:
        self.session, self.ui = session, session.ui
        self.gui, self.scene = session.ui.gui, session.ui.scene
        self.in_address: dict[str, InAddress] = {}
        """Parts whose state is in the address while this is shown, by key; keys of lessons begin with
        ``STOP``."""
        self.always_in_address: dict[str, InAddress] = {}
        """Parts whose state is in the address whatever screen is shown, by keys that no other screen has."""

    @abstractmethod
    def build(self) -> None:
        """Add the controls to the current container."""

    def on_spec(self, spec: Spec) -> None:
        """Handle a change of the settings or the source."""

    def on_view(self, step: Step, view: Any) -> None:
        """Handle a new view of a step, this panel's or another."""

    def on_partial(self, view: Any) -> None:
        """Show a partial result of this panel's step."""

    def on_failure(self, step: Step, sentence: str) -> None:
        """Handle a step, this panel's or another, that failed or was cancelled."""

    def on_show(self) -> None:
        """Called when this becomes the current panel."""

    def on_hide(self) -> None:
        """Called before another panel becomes the current one."""

    def on_action(self, action: str) -> None:
        """Handle a press of a button for all steps, such as *Cancel*."""

    @property
    def ahead(self) -> bool:
        """Whether the picture is newer than the numbers, as while a slider is dragged."""
        return False

    def look(self) -> bool:
        """Turn the view to what is drawn. False lets the session turn it to the scene."""
        return False

    def offers(self) -> tuple[Offers, ...]:
        """Return the files that it offers for download."""
        return ()

    @property
    def command(self) -> str:
        """Return the command line that computes what it shows."""
        return self.session.spec.command()

    @property
    def wide(self) -> bool:
        """Whether it shows two objects side by side."""
        return False
