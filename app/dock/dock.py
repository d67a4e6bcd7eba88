"""The dock at the lower edge of the window: one clock, its buttons, and a timeline with lanes.

The page's part is ``dock.js``, ``dock_view.js`` (drawing) and ``dock_row.js`` (place in the page). The server
sends three hidden pieces of HTML (set-up, pictures, state). Each is complete, so that a page that connects
later gets everything. The user's actions come back through a hidden text field as the list of all actions
that the server has not acknowledged: of several changes within 50 ms viser sends only the last.
"""

from __future__ import annotations

import base64
import math
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import astuple
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from app.dock.messages import actions_in, is_number
from app.dock.ticker import Ticker
from app.drawing.timeline import Lane
from app.web.markup import Markup
from app.window.hidden import add_hidden
from app.window.page import page_call
from app.window.ui import Ui

PICTURE_S = 0.04
"""Time between two pictures during playback, seconds."""
RUN_S = 30.0
"""Approximate duration of a whole run at the initial speed, seconds."""
SPEEDS = tuple(m * 10.0**p for p in range(-4, 4) for m in (1.0, 2.0, 5.0))
"""Speeds that can be chosen, simulated seconds per second."""
WIDTH_PX = (200, 2400)
"""Smallest and largest width of a picture."""
LEAST_SPAN_NS = 1000
"""Shortest time window."""
COUNT_NS = 1_000_000_000
"""Length of one iteration or step on the axis of a timeline that counts them instead of time."""
PAGES = 50
"""Number of pages whose acknowledged actions are remembered."""


class Dock:
    """Shows the lanes of a timeline and moves a clock over it; independent of what the lanes show."""

    def __init__(
        self,
        ui: Ui,
        on_move: Callable[[int], None],
        on_pick: Callable[[int, int], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Add the dock; it is empty and hidden until ``load`` and ``show``.

        Args:
            ui: panel of the browser.
            on_move: called with the new time in ns when the clock has moved.
            on_pick: called with the indices of the clicked lane and item; the item is -1 if there is none.
            clock: returns the real time in seconds.
        """
        self._ui, self._on_move, self._on_pick, self._clock = ui, on_move, on_pick, clock
        self._name = uuid.uuid4().hex
        self._lanes: tuple[Lane, ...] = ()
        self._start_ns, self._end_ns, self.now_ns = 0, 1, 0
        self._window_ns, self._width_px = (0, 1), 1200
        self._stops_ns: NDArray[np.int64] = np.zeros(0, np.int64)
        self._playing, self._visible, self._loops, self._speed = False, False, False, 1.0
        self._counts = ""
        self._anchor = (0.0, 0)
        self._last_applied: dict[str, int] = {}
        self._tip = ""
        self._chosen: dict[str, Any] = {}
        with add_hidden(ui, self._name):
            self._field = ui.when_changed(ui.gui.add_text("Dock", ""), self._on_message)
            self._setup, self._picture, self._state = (ui.gui.add_html(Markup("")) for _ in range(3))
        self._ticker = Ticker(lambda: ui.post(self._tick), PICTURE_S)
        ui.closers.append(self._ticker.close)

    # Called by screens.

    @property
    def playing(self) -> bool:
        """Whether the clock moves."""
        return self._playing

    @property
    def rest_ns(self) -> int:
        """Time of the clock; while it moves, its time at the last start, jump or change of speed."""
        return self._anchor[1] if self._playing else self.now_ns

    @property
    def shown_ns(self) -> int:
        """Simulated time between two pictures during playback at the present speed."""
        return round(self._speed * PICTURE_S * 1e9)

    @property
    def speed(self) -> float:
        """Simulated seconds per second."""
        return self._speed

    def load(
        self,
        start_ns: int,
        end_ns: int,
        stops_ns: NDArray[np.int64],
        lanes: Sequence[Lane],
        counts: str = "",
        run_s: float = RUN_S,
    ) -> None:
        """Load another timeline, paused at its start.

        Args:
            start_ns: start of the timeline.
            end_ns: end of the timeline; later than the start.
            stops_ns: (S,) ascending times at which the step buttons stop.
            lanes: lanes from top to bottom.
            counts: what the axis counts instead of time, such as "iteration"; each takes ``COUNT_NS``.
            run_s: approximate duration of the whole timeline at the initial speed, seconds.
        """
        self.pause()
        self._counts = counts
        self._start_ns, self._end_ns = start_ns, max(end_ns, start_ns + LEAST_SPAN_NS)
        self._stops_ns, self._lanes = stops_ns, tuple(lanes)
        self._window_ns, self._tip, self._chosen = (self._start_ns, self._end_ns), "", {}
        self._pace((self._end_ns - self._start_ns) / 1e9 / run_s)
        self._send_setup()
        self._draw()
        self.now_ns = start_ns
        self._send_state()
        self._on_move(start_ns)

    def show(self, visible: bool) -> None:
        """Show or hide the dock."""
        if visible != self._visible:
            self._visible = visible
            if not visible:
                self.pause()
            self._send_setup()

    def update(self, lanes: Sequence[Lane]) -> None:
        """Replace the lanes of the same timeline, for example by curves that have grown."""
        before, self._lanes = self._lanes, tuple(lanes)
        if [_looks(lane) for lane in before] != [_looks(lane) for lane in lanes]:
            self._send_setup()
        self._draw()
        self._send_state()

    def mark(self, lane: int, item: int) -> None:
        """Mark an item of a lane; the item -1 removes the mark."""
        self._choose(lane, item)
        self._send_state()

    def _choose(self, lane: int, item: int) -> None:
        self._chosen = {"lane": lane, "place": self._lanes[lane].place(item)} if item >= 0 else {}

    def play(self) -> None:
        """Start the clock, at the start of the timeline if it is at the end."""
        if self.now_ns >= self._end_ns:
            self._go(self._start_ns)
        self._playing = True
        self._anchor = (self._clock(), self.now_ns)
        self._ticker.run(True)
        self._send_state()

    def pause(self) -> None:
        """Stop the clock."""
        self._playing = False
        self._ticker.run(False)
        self._send_state()

    def seek(self, t_ns: int) -> None:
        """Move the clock to a time, limited to the timeline, and play on from there if playing."""
        self._go(t_ns)
        self._anchor = (self._clock(), self.now_ns)

    def step(self, count: int) -> None:
        """Pause and move to the next stop, or the one before if ``count`` is negative; stay without one."""
        self.pause()
        if count > 0:
            at = int(np.searchsorted(self._stops_ns, self.now_ns, side="right"))
        else:
            at = int(np.searchsorted(self._stops_ns, self.now_ns)) - 1
        if 0 <= at < len(self._stops_ns):
            self.seek(int(self._stops_ns[at]))

    # The clock.

    def _tick(self) -> None:
        if not self._playing:
            return
        began_s, origin_ns = self._anchor
        t_ns = origin_ns + round((self._clock() - began_s) * self._speed * 1e9)
        if t_ns >= self._end_ns and self._loops:
            t_ns = self._start_ns + (t_ns - self._start_ns) % (self._end_ns - self._start_ns)
            self._anchor = (self._clock(), t_ns)
        elif t_ns >= self._end_ns:
            self._playing = False
            self._ticker.run(False)
        self._go(t_ns)

    def _go(self, t_ns: int) -> None:
        t_ns = min(max(t_ns, self._start_ns), self._end_ns)
        moved, self.now_ns = t_ns != self.now_ns, t_ns
        with self._ui.atomic():
            self._send_state()
            if moved:
                self._on_move(t_ns)

    def _pace(self, speed: float) -> None:
        """Choose the listed speed nearest to this one."""
        self._speed = min(SPEEDS, key=lambda one: abs(math.log(one / max(speed, 1e-9))))
        self._anchor = (self._clock(), self.now_ns)

    # Actions of the user.

    def _on_message(self) -> None:
        """Apply the page's actions that were not applied yet."""
        page, actions = actions_in(self._field.value)
        if not actions:
            return
        self._last_applied[page] = self._last_applied.pop(page, 0)
        while len(self._last_applied) > PAGES:
            del self._last_applied[next(iter(self._last_applied))]
        for number, name, arguments in actions:
            if number > self._last_applied[page] and name in ACTIONS:
                self._last_applied[page] = number
                apply, count = ACTIONS[name]
                if len(arguments) == count and all(map(is_number, arguments)):
                    apply(self, *arguments)
        self._send_state()
        self._ui.flush()

    def _toggle(self) -> None:
        if self._playing:
            self.pause()
        else:
            self.play()

    def _loop(self) -> None:
        """Turn repeated playback on or off."""
        self._loops = not self._loops

    def _faster(self, count: int) -> None:
        at = SPEEDS.index(self._speed) + int(count)
        self._pace(SPEEDS[min(max(at, 0), len(SPEEDS) - 1)])

    def _look(self, start_ns: float, end_ns: float, width_px: float) -> None:
        """Draw the time window and the width that a page reports."""
        self._width_px = min(max(round(width_px), WIDTH_PX[0]), WIDTH_PX[1])
        self._window(start_ns, end_ns)
        self._draw()

    def look(self, start_ns: float, end_ns: float) -> None:
        """Show another time window in all pages."""
        self._window(start_ns, end_ns)
        self._send_setup()
        self._draw()

    def _window(self, start_ns: float, end_ns: float) -> None:
        span = min(max(round(end_ns - start_ns), LEAST_SPAN_NS), self._end_ns - self._start_ns)
        start = min(max(round(start_ns), self._start_ns), self._end_ns - span)
        self._window_ns = (start, start + span)

    def _point(self, lane: int, t_ns: float, y_px: float, tolerance_ns: float) -> None:
        """Set the tip for the item under the pointer."""
        there = 0 <= lane < len(self._lanes)
        there = there and (t_ns <= self.now_ns or self._lanes[lane].veil < 1.0)
        self._tip = self._lanes[lane].tip(round(t_ns), int(y_px), round(tolerance_ns)) if there else ""

    def _click(self, lane: int, t_ns: float, y_px: float, tolerance_ns: float) -> None:
        """Move the clock to a click and mark the item there."""
        there = 0 <= lane < len(self._lanes)
        item = self._lanes[lane].pick(round(t_ns), int(y_px), round(tolerance_ns)) if there else -1
        self._choose(lane, item)
        self.seek(round(t_ns))
        if there:
            self._on_pick(lane, item)

    # Messages to the page.

    def _send(self, handle: Any, **fields: Any) -> None:
        handle.content = page_call("dock", {"dock": self._name, **fields})

    def _send_setup(self) -> None:
        self._send(
            self._setup,
            kind="setup",
            visible=self._visible and bool(self._lanes),
            ends=(self._start_ns, self._end_ns),
            window=self._window_ns,
            counts=self._counts,
            lanes=[_looks(lane) for lane in self._lanes],
        )

    def _send_state(self) -> None:
        self._send(
            self._state,
            kind="state",
            now=self.now_ns,
            playing=self._playing,
            loops=self._loops,
            speed=f"{self._speed:g} a second" if self._counts else speed_text(self._speed),
            heard=self._last_applied,
            tip=self._tip,
            chosen=self._chosen,
            labels=[
                [(label.y_px, label.text, label.color) for label in lane.labels(self.now_ns)]
                for lane in self._lanes
            ],
        )

    def _draw(self) -> None:
        """Draw all lanes for the window."""
        pictures, words = [], []
        for lane in self._lanes:
            picture = np.empty((lane.height_px, self._width_px, 3), np.uint8)
            lane.draw(picture, *self._window_ns)
            encoded = cv2.imencode(".png", picture[..., ::-1], (cv2.IMWRITE_PNG_COMPRESSION, 1))[1]
            pictures.append(f"data:image/png;base64,{base64.b64encode(encoded.tobytes()).decode()}")
            words.append([astuple(word) for word in lane.words(*self._window_ns, self._width_px)])
        self._send(
            self._picture,
            kind="picture",
            window=self._window_ns,
            pictures=pictures,
            words=words,
            heard=self._last_applied,
        )


def _looks(lane: Lane) -> dict[str, Any]:
    """Return the parts of a lane that the page gets with the set-up."""
    legend = list(lane.legend)
    ticks = [(tick.y_px, tick.text) for tick in lane.ticks]
    return {
        "title": lane.title,
        "height": lane.height_px,
        "veil": lane.veil,
        "legend": legend,
        "ticks": ticks,
    }


ACTIONS: dict[str, tuple[Callable[..., None], int]] = {
    "toggle": (Dock._toggle, 0),
    "step": (Dock.step, 1),
    "seek": (lambda dock, t_ns: dock.seek(round(t_ns)), 1),
    "faster": (Dock._faster, 1),
    "loop": (Dock._loop, 0),
    "look": (Dock._look, 3),
    "point": (lambda dock, lane, *place: dock._point(int(lane), *place), 4),
    "click": (lambda dock, lane, *place: dock._click(int(lane), *place), 4),
}
"""Actions by the names that the page uses, each with the count of its arguments, which are numbers."""


def speed_text(speed: float) -> str:
    """Return the simulated seconds per second as text: ×4, ×1/50."""
    factor = max(speed, 1.0 / speed)
    number = f"{factor:,.0f}" if factor >= 1000.0 else f"{factor:.3g}"
    return f"×{number}" if speed >= 1.0 else f"×1/{number}"


def time_text(t_ns: int) -> str:
    """Return a duration for a sentence: 3.21 s, 12.4 ms."""
    if t_ns == 0:
        return "0 s"
    for unit, ns in (("s", 1e9), ("ms", 1e6), ("µs", 1e3)):
        if abs(t_ns) >= ns or unit == "µs":
            value = t_ns / ns
            digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2
            return f"{value:.{digits}f} {unit}"
    raise AssertionError
