"""The player of simulated time: from slow motion of single frames to minutes in a second."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from app.player import Player, Ruler
from app.screens.network.view import NetworkView
from app.ui import Ui

STEP_NS = 1000
"""The player counts microseconds."""
SLOWEST, FASTEST = -3.0, 2.5
"""Powers of ten of simulated seconds in a second."""
PICTURE_S = 0.04
"""Between two pictures while it plays: with 60 nodes and 90,000 events each takes half a millisecond."""
RUN_S = 60.0
"""How long a whole run takes at first."""
BUTTONS = ("Event back", "Next event", "An event is anything on the timeline: a frame, a loss, an image.")


class NetworkPlayer(Player):
    """Moves over the simulated time."""

    def __init__(self, ui: Ui, on_move: Callable[[], None]) -> None:
        """Add the buttons and sliders; ``on_move`` is called at every new time."""
        self._start_ns = 0
        ruler = _ruler(0, 1.0)
        super().__init__(ui, lambda _: on_move(), ruler, "Drag to any simulated time.", BUTTONS, PICTURE_S)
        self.add_speed(
            (SLOWEST, FASTEST, 0.05),
            0.0,
            "Simulated time that passes in a second, as a power of ten: -3 is 1 ms, which shows single "
            "frames; 2 is 100 s.",
            speed_label(0.0),
            rate=lambda power: 10.0**power * 1e9 / STEP_NS,
            name=speed_label,
        )

    @property
    def now_ns(self) -> int:
        """Simulated time that is shown."""
        return self._start_ns + self.position * STEP_NS

    @property
    def seconds_a_second(self) -> float:
        """Simulated seconds in a second."""
        return self.speed * STEP_NS / 1e9

    def load_runs(self, views: Sequence[NetworkView]) -> None:
        """Play other runs from the end of their warm-up."""
        self._start_ns = min(view.start_ns for view in views)
        end_ns = max(view.end_ns for view in views)
        starts_ns = np.concatenate([view.pieces.start_ns for view in views])
        span_s = max((end_ns - self._start_ns) / 1e9, 0.001)
        self.pace(span_s / RUN_S)
        length, stops = self._position_at(end_ns) + 1, np.unique(self._position_at(starts_ns))
        self.load(length, stops, _ruler(self._start_ns, span_s))

    def seek_time(self, t_ns: int) -> None:
        """Go to a simulated time."""
        self.seek(self._position_at(t_ns))

    def pace(self, speed: float) -> None:
        """Play so many simulated seconds in a second, as nearly as the slider has them."""
        self.set_speed(round(float(np.clip(np.log10(speed), SLOWEST, FASTEST)) * 20.0) / 20.0)

    def _position_at(self, t_ns: Any) -> Any:
        """The first position at or after a time, or after each of several."""
        return -(-(t_ns - self._start_ns) // STEP_NS)


def _ruler(start_ns: int, span_s: float) -> Ruler:
    step = max(round(span_s / 2000.0, 3), 0.001)
    return Ruler("Time (s)", start_ns / 1e9, STEP_NS / 1e9, step=step)


def speed_label(power: float) -> str:
    """Of the slider of the speed."""
    speed = 10.0**power
    return f"Speed ×{speed:.3g}" if speed >= 1.0 else f"Speed ×1/{1.0 / speed:.0f}"


def short_time(time_s: float) -> str:
    """A length of time in a label."""
    if time_s >= 100.0:
        return f"{time_s:.0f} s"
    return f"{time_s:.3g} s" if time_s >= 1.0 else f"{1000.0 * time_s:.3g} ms"
