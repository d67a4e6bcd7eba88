"""The player of a race: the dock with the error curve of every method."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from app.dock.dock import Dock
from app.drawing.timeline import Curve, CurvesLane, round_up
from app.screens.fuse.clock import CLOCKS, RaceClock
from app.screens.fuse.labels import MARKS, OFF_FROM
from app.screens.fuse.methods import color_of
from app.screens.fuse.view import OFF_DIGITS, RaceLane, Reference
from app.window.ui import Ui

RUN_S = 12.0
"""Approximate playing time of a race, seconds."""
LANE_PX = 96
END = "end"


class RacePlayer:
    """Moves the clock of a race."""

    def __init__(self, ui: Ui, on_move: Callable[[int], None], on_clock: Callable[[], None]) -> None:
        """Add the dock. ``on_move`` gets every new time; ``on_clock`` is called after a clock change."""
        self._ui, self._on_clock = ui, on_clock
        self._lanes: Sequence[RaceLane] = ()
        self._reference: Reference = "truth"
        self.clock: RaceClock | None = None
        self._dock = Dock(ui, on_move, lambda lane, item: None)
        self.show = self._dock.show

    def add_axis(self) -> None:
        """Add the drop-down for the clock."""
        self._axis = self._ui.gui.add_dropdown(
            "Axis",
            list(CLOCKS),
            hint="Unit of the clock and the curves: iterations, or milliseconds of each method in this "
            "app's computing process, preparation included.",
        )
        self._ui.when_changed(self._axis, lambda: self.load(self._lanes, self._reference))

    @property
    def now_ns(self) -> int:
        """Time of the clock."""
        return self._dock.now_ns

    @property
    def in_ms(self) -> bool:
        """Whether the clock counts milliseconds."""
        return CLOCKS[self._axis.value]

    @property
    def rest(self) -> str:
        """Iteration or millisecond of the clock when it was last at rest; ``end`` for the end."""
        if self.clock is None:
            return ""
        rest_ns = self._dock.rest_ns
        if rest_ns >= self.clock.end_ns:
            return END
        return f"{float(self.clock.shown(np.array(rest_ns))):.6g}"

    def load(self, lanes: Sequence[RaceLane], reference: Reference) -> None:
        """Load another race, at its start; without lanes, leave the dock as it is."""
        self._lanes, self._reference = lanes, reference
        if not lanes:
            return
        clock = self.clock = RaceClock.of(lanes, self.in_ms)
        self._on_clock()
        counts = "" if clock.in_ms else "iteration"
        self._dock.load(
            0, clock.end_ns, clock.stops_ns, [error_lane(self._reference, lanes, clock)], counts, RUN_S
        )

    def choose(self, in_ms: bool) -> None:
        """Count milliseconds or iterations from the next race on."""
        self._axis.value = next(name for name, value in CLOCKS.items() if value == in_ms)

    def seek_at(self, place: float | None) -> None:
        """Go to an iteration or millisecond; None is the end."""
        if self.clock is not None:
            self._dock.seek(self.clock.at(place))


def error_lane(reference: Reference, lanes: Sequence[RaceLane], clock: RaceClock) -> CurvesLane:
    """Return a lane of the error of every method on one scale; curves are hidden after the clock's time, and
    have a gap where the error is out of reach."""
    high_cm = round_up(max(1.0, *(float(np.nanmax(lane.offs_cm, initial=0.0)) for lane in lanes)))
    curves = [
        Curve(
            mark,
            "cm",
            color_of(lane.rival),
            steps_ns,
            lane.offs_cm,
            0.0,
            high_cm,
            OFF_DIGITS,
            lane.rival[1] == "plane",
        )
        for mark, lane, steps_ns in zip(MARKS, lanes, clock.steps_ns, strict=False)
    ]
    return CurvesLane(OFF_FROM[reference], curves, LANE_PX, veil=1.0, titled=True)
