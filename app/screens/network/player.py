"""The player of simulated time: from slow motion of single frames to minutes in a second."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from app.player import Ticker, Timeline
from app.screens.network.view import NetworkView

STEP_NS = 1000
"""The player counts microseconds."""
SLOWEST, FASTEST = -3.0, 2.5
"""Powers of ten of simulated seconds in a second."""
PICTURE_S = 0.04
"""Between two pictures while it plays: with 60 nodes and 90,000 events each takes half a millisecond."""
RUN_S = 60.0
"""How long a whole run takes at first."""


class NetworkPlayer:
    """Moves over the simulated time and tells what to show."""

    def __init__(
        self,
        gui: viser.GuiApi,
        post: Callable[..., None],
        changed: Callable[[Any, Callable[[], None]], None],
        on_move: Callable[[], None],
    ) -> None:
        """Add the buttons and sliders.

        Args:
            gui: where to add them.
            post: runs a function on the session's thread.
            changed: registers an action for a change of a handle by a person.
            on_move: called at every new time.
        """
        self._post, self._on_move = post, on_move
        self._start_ns = 0
        self._events_ns: NDArray[np.int64] = np.zeros(0, np.int64)
        self._timeline = timeline = Timeline(self._moved)
        self._ticker = Ticker(lambda: post(self._tick), PICTURE_S)
        keys = gui.add_button_group(
            "Player",
            ("Play", "Pause", "Event back", "Next event"),
            hint="An event is anything on the timeline: a frame, a loss, an image.",
        )
        actions: dict[str, Callable[[], None]] = {
            "Play": timeline.play,
            "Pause": timeline.pause,
            "Event back": lambda: self._step(-1),
            "Next event": lambda: self._step(1),
        }
        keys.on_click(lambda event: post(self._press, actions[event.target.value]))
        self._scrub = gui.add_slider("Time (s)", 0.0, 1.0, 0.001, 0.0, hint="Drag to any simulated time.")
        changed(self._scrub, lambda: self.seek(round(self._scrub.value * 1e9)))
        self._speed = gui.add_slider(
            "Speed ×1",
            SLOWEST,
            FASTEST,
            0.05,
            0.0,
            hint="Simulated time that passes in a second, as a power of ten: -3 is 1 ms, which shows single "
            "frames; 2 is 100 s.",
        )
        changed(self._speed, self._hurry)

    @property
    def now_ns(self) -> int:
        """Simulated time that is shown."""
        return self._start_ns + self._timeline.position * STEP_NS

    @property
    def speed(self) -> float:
        """Simulated seconds in a second."""
        return float(10.0**self._speed.value)

    def load(self, views: Sequence[NetworkView]) -> None:
        """Play other runs from the end of their warm-up."""
        self._ticker.run(False)
        self._start_ns = min(view.start_ns for view in views)
        end_ns = max(view.end_ns for view in views)
        self._events_ns = np.unique(np.concatenate([view.pieces.start_ns for view in views]))
        span_s = max((end_ns - self._start_ns) / 1e9, 0.001)
        self._scrub.min, self._scrub.max = self._start_ns / 1e9, self._start_ns / 1e9 + span_s
        self._scrub.step = max(round(span_s / 2000.0, 3), 0.001)
        self.pace(span_s / RUN_S)
        self._timeline.reset(-(-(end_ns - self._start_ns) // STEP_NS) + 1)

    def seek(self, t_ns: int) -> None:
        """Go to a simulated time."""
        self._timeline.seek(-(-(t_ns - self._start_ns) // STEP_NS))

    def pace(self, speed: float) -> None:
        """Play so many simulated seconds in a second, as nearly as the slider has them."""
        self._speed.value = round(float(np.clip(np.log10(speed), SLOWEST, FASTEST)) * 20.0) / 20.0
        self._hurry()

    def pause(self) -> None:
        """Stay where it is."""
        self._press(self._timeline.pause)

    def close(self) -> None:
        """End the player's thread."""
        self._ticker.close()

    def _step(self, count: int) -> None:
        """Pause at the next event, or at the one before."""
        self._timeline.pause()
        events_ns = self._events_ns
        if not len(events_ns):
            return
        if count > 0:
            at = int(np.searchsorted(events_ns, self.now_ns, side="right"))
        else:
            at = int(np.searchsorted(events_ns, self.now_ns - STEP_NS, side="right")) - 1
        if 0 <= at < len(events_ns):
            self.seek(int(events_ns[at]))

    def _press(self, action: Callable[[], None]) -> None:
        action()
        self._ticker.run(self._timeline.playing)

    def _hurry(self) -> None:
        self._timeline.speed = self.speed * 1e9 / STEP_NS
        speed = f"{self.speed:.3g}" if self.speed >= 1.0 else f"1/{1.0 / self.speed:.0f}"
        self._speed.label = f"Speed ×{speed}"

    def _tick(self) -> None:
        self._timeline.tick()
        self._ticker.run(self._timeline.playing)

    def _moved(self, _: int) -> None:
        self._scrub.value = round(self.now_ns / 1e9, 6)
        self._on_move()


def short_time(time_s: float) -> str:
    """A length of time in a label."""
    if time_s >= 100.0:
        return f"{time_s:.0f} s"
    return f"{time_s:.3g} s" if time_s >= 1.0 else f"{1000.0 * time_s:.3g} ms"
