"""The folder that hides a part of what was measured, and sees how well it can be filled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from app.depthwords import BLANK, MEASURED, OURS, PEER_NAMES
from app.jobs.depth_records import HiddenView, HideWish
from app.panels.depth.compare import CompareArea
from app.tables import Row, number, table

TEXT = """Where the sensor is blind, nobody can tell how good a guess is. So **hide a disc of what it did
measure**, have it filled without that knowledge, and compare."""
BUTTON = "Hide and fill"
WAITING = "Filling …"
SILENT = "No answer came. Press the button again."
NAMES = (MEASURED, BLANK, OURS, *PEER_NAMES.values())


class HideFolder:
    """Where the disc is, a button, the pictures before and after, and the errors of all ways to fill."""

    def __init__(
        self,
        gui: viser.GuiApi,
        post: Callable[..., None],
        changed: Callable[[Any, Callable[[], None]], None],
        on_hide: Callable[[HideWish], None],
    ) -> None:
        """Add the folder.

        Args:
            gui: where to add it.
            post: runs a function on the session's thread.
            changed: registers an action for a change of a handle by a person.
            on_hide: called with what to hide, of the node that is shown.
        """
        self._on_hide = on_hide
        with gui.add_folder("Hide a region and see it filled", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._x = gui.add_slider(
                "Centre x (%)", 0.0, 100.0, 1.0, 50.0, hint="In % of the width, from the left."
            )
            self._y = gui.add_slider(
                "Centre y (%)", 0.0, 100.0, 1.0, 50.0, hint="In % of the height, from the top."
            )
            self._size = gui.add_slider(
                "Diameter (%)", 4.0, 60.0, 1.0, 20.0, hint="Of the disc, in % of the image's width."
            )
            gui.add_button(BUTTON, icon=viser.Icon.ERASER, hint="It takes some seconds.").on_click(
                lambda _: post(self._ask)
            )
            self._status = gui.add_markdown("")
            self._area = CompareArea(gui, changed, NAMES, BLANK, OURS, visible=False)
            self._table = gui.add_html("")

    def ask(self, wish: HideWish) -> None:
        """Set the sliders and press the button, as a person would."""
        self._x.value, self._y.value = round(100.0 * wish.x_share), round(100.0 * wish.y_share)
        self._size.value = round(100.0 * wish.size_share)
        self._ask()

    def forget(self) -> None:
        """What was filled with other settings is not what these would fill."""
        self._status.content = self._table.content = ""
        self._area.load(None)

    def load(self, view: HiddenView | None) -> None:
        """Show the answer; None was stopped or could not be."""
        self.forget()
        if view is None:
            self._status.content = SILENT
            return
        self._status.content = f"**{view.hidden_px:,} measured pixels of {view.node} hidden.**"
        self._area.load(view.pictures)
        self._table.content = fills_table(view)

    def _ask(self) -> None:
        self.forget()
        self._status.content = WAITING
        self._on_hide(HideWish(0, self._x.value / 100.0, self._y.value / 100.0, self._size.value / 100.0))


def fills_table(view: HiddenView) -> str:
    """HTML: a line for each way to fill: AbsRel, share within 5 %, share filled, time."""
    hint = (
        "AbsRel: mean of |filled - measured| / measured over the hidden pixels that were filled. Within 5 %: "
        "share of all hidden pixels. Filled: share that got a depth at all. Time without the network's own."
    )
    rows = [
        Row(
            row.name,
            hint,
            (
                number(row.abs_rel, 3),
                number(row.within_share, 0, "%", 100.0),
                number(row.filled_share, 0, "%", 100.0),
                number(row.elapsed_s, 0, "ms", 1000.0),
            ),
        )
        for row in view.rows
    ]
    return table(rows, ("AbsRel", "within 5 %", "filled", "time"))
