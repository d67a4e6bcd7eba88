"""The board over the lanes of a race: each lane's method and present error, and the colour scale.

The page's part is ``board.js``, its style is ``board.css``. The server sends two hidden pieces of HTML, each
complete: the setup of a race, and its present state.
"""

from __future__ import annotations

import base64
import uuid
from collections.abc import Sequence
from typing import Any

from app.drawing.colors import DISTANCE_STOPS, MOST_DISTANCE_M, css
from app.screens.fuse.draw import FOOT, HEAD, HEAD_PX, WHOLE_FOOT
from app.screens.fuse.labels import MARKS, OFF_FROM
from app.screens.fuse.methods import METHODS, METRICS, color_of
from app.screens.fuse.numbers import off_text
from app.screens.fuse.view import OFF_DIGITS, SUCCESS_M, LensView, RaceLane, RaceStep, RaceView, Reference
from app.web.markup import Markup
from app.window.hidden import add_hidden
from app.window.page import page_call
from app.window.tables import UNKNOWN, number
from app.window.ui import Ui
from pipeline.types import ByteArray


class Board:
    """The board, which is over the picture while a race is shown."""

    def __init__(self, ui: Ui) -> None:
        """Add the board, empty and hidden."""
        self._name = uuid.uuid4().hex
        self._view: RaceView | None = None
        self._visible = False
        with add_hidden(ui, self._name):
            self._setup, self._state = ui.gui.add_html(Markup("")), ui.gui.add_html(Markup(""))

    def load(self, view: RaceView | None) -> None:
        """Show another race, at its start; None removes the race."""
        self._view = view
        self._send_setup()
        if view is not None:
            self.mark([0] * len(view.lanes))

    def show(self, visible: bool) -> None:
        """Show or hide the board."""
        if visible != self._visible:
            self._visible = visible
            self._send_setup()

    def mark(self, rows: Sequence[int]) -> None:
        """Show the error of every lane at one of its steps."""
        if self._view is not None:
            seen = list(zip(self._view.lanes, rows, strict=True))
            scores = [{**score(lane, row), "lens": _bytes(lane.steps[row].lens)} for lane, row in seen]
            self._send(self._state, kind="state", lanes=scores)

    def _send_setup(self) -> None:
        lanes = () if self._view is None else self._view.lanes
        lens = None if self._view is None else self._view.lens
        self._send(
            self._setup,
            kind="setup",
            visible=self._visible and bool(lanes),
            lens=None if lens is None else _lens(lens),
            band=(HEAD, HEAD_PX, WHOLE_FOOT if lens is None else FOOT),
            lanes=[_head(mark, lane) for mark, lane in zip(MARKS, lanes, strict=False)],
            scale=scale("truth" if self._view is None else self._view.reference),
        )

    def _send(self, handle: Any, **fields: Any) -> None:
        handle.content = page_call("board", {"dock": self._name, **fields})


def _head(mark: str, lane: RaceLane) -> dict[str, str]:
    """Return the heading of a lane, which stays the same at all its steps."""
    method, metric = lane.rival
    about = METHODS[method]
    return {
        "name": f"{mark} {lane.label}",
        "color": css(color_of(lane.rival)),
        "about": f"{about.text} {METRICS[metric]}",
        "source": f"Source: {about.source}.",
    }


def _lens(lens: LensView) -> dict[str, Any]:
    """Return the magnified corner's width in centimetres and its target points, without the moving points."""
    return {"window": 100.0 * lens.window_m, "target": _bytes(lens.target)}


def _bytes(rows: ByteArray) -> str:
    return base64.b64encode(rows.tobytes()).decode()


def scale(reference: Reference) -> dict[str, Any]:
    """Return the legend of the moving cloud's colours."""
    return {
        "text": f"Distance {OFF_FROM[reference]}",
        "stops": [css(stop) for stop in DISTANCE_STOPS],
        "ends": ("0", f"{100.0 * MOST_DISTANCE_M:.0f} cm and more"),
        "target": "the cloud that stays",
        "pairs": "pairs; dark: large weight",
    }


def score(lane: RaceLane, row: int) -> dict[str, str]:
    """Return a lane's error, state and, at its end, verdict at one of its steps, as texts."""
    step, ended = lane.steps[row], row == len(lane.steps) - 1
    distance, unit = distance_text(step)
    state, note = "running", f"iteration {row} of {lane.iterations}"
    if ended and step.point_error_m is not None:
        arrived = step.point_error_m < SUCCESS_M
        state = "arrived" if arrived else "missed"
        note = f"{'✓ arrived' if arrived else '✗ missed'} · {lane.iterations} iterations"
    elif ended:
        note = f"stopped · {lane.iterations} iterations"
    of = "off" if step.point_error_m is not None else "to the nearest point"
    verdict = f"RMSE {_cm(step.rmse_m)} · verdict {lane.verdict_text}" if ended else ""
    return {"number": distance, "unit": f"{unit} {of}", "note": note, "state": state, "verdict": verdict}


def distance_text(step: RaceStep) -> tuple[str, str]:
    """Return a step's error and its unit: RMS distance from the reference position, or else the median
    distance from the nearest points."""
    if step.off_m != step.off_m:
        return UNKNOWN, ""
    return off_text(step, unit=""), "cm"


def _cm(distance_m: float) -> str:
    return number(distance_m, OFF_DIGITS, "cm", 100.0)
