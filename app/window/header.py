"""The top of the control panel: the stepper, the status line, the progress bar, and buttons for all steps.

``actions.js`` disables the buttons that have nothing to do, such as ``Reset`` before any setting was used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from app.compute.state import Step, StepStatus
from app.drawing.colors import BRAND, DELIVERED
from app.web.markup import Markdown, Markup
from app.window.gui import Gui
from app.window.page import page_call, stale_html
from app.window.stepper import Stepper
from app.window.tools import Tools
from packetmesh.progress import Progress

STARTING = Markdown("**Starting** …")


class Header:
    """Stepper, status line, progress bar and buttons."""

    def __init__(
        self,
        gui: Gui,
        titles: Sequence[str],
        on_pick: Callable[[str], None],
        on_action: Callable[[str], None],
    ) -> None:
        """Add the parts to the current container."""
        self._stepper = Stepper(gui, titles, on_pick)
        self.tools = Tools(gui)
        self._status = gui.add_markdown(STARTING)
        self._bar = gui.add_progress_bar(0.0)
        self._stale = gui.add_html(Markup(""))
        self._idle = gui.add_html(page_call("idle", ("Cancel", "Retry")))
        actions = gui.add_button_group(
            "All steps",
            ("Cancel", "Retry", "Reset", "Copy as command"),
            hint="Cancel stops the computation; Retry runs a cancelled or failed step again; Reset "
            "restores settings, race, network and lessons; Copy as command shows the equivalent "
            "command.",
        )
        actions.on_click(lambda event: on_action(event.target.value))

    def progressed(self, report: Progress) -> None:
        """Show the progress of a computation."""
        self._bar.value = min(100.0, 100.0 * report.fraction)
        self._status.content = Markdown("**Computing** · {}").format(report.stage)

    def dim(self, numbers: bool, picture: bool) -> None:
        """Dim the numbers or the picture, which belong to other settings than the current ones."""
        self._stale.content = stale_html(numbers, picture)

    def show(
        self,
        current: str,
        statuses: Mapping[str, StepStatus],
        running: Sequence[Step],
        failure: str | None,
        busy: bool,
    ) -> None:
        """Update all parts.

        Args:
            current: title of the step that is shown.
            statuses: statuses of the steps by title.
            running: the steps that are computed now.
            failure: error sentence of a failed step.
            busy: whether a side job runs.
        """
        self._stepper.show(current, statuses)
        computing = bool(running) or busy
        alive = {"Cancel": computing, "Retry": failure is not None}
        self._idle.content = page_call("idle", [name for name in alive if not alive[name]])
        if running:
            self._status.content = Markdown("**Computing** · {}").format(running[0])
        elif failure is not None:
            self._status.content = Markdown("**Stopped** · {}. Change a setting or press Retry.").format(
                failure.rstrip(".")
            )
            self._bar.value = 0.0
        elif not busy:
            self._status.content = Markdown("**Up to date**")
            self._bar.value = 100.0
        elif self._status.content == STARTING:
            self._status.content = Markdown("**Computing** …")
        self._bar.color = BRAND if computing else DELIVERED
