"""A simulated user, who clicks steps, drags the ball radius and waits for meshes."""

from __future__ import annotations

import contextlib
import threading
import time
from dataclasses import dataclass, field

import numpy as np
from websockets.exceptions import WebSocketException

from app.load.connection import Connection, wait_for
from app.screens.surface.quick import QUIET_S
from app.screens.surface.settings import STEP_MM
from app.window.stepper import MARKS

STEPS = ("Scene", "Depth", "Fuse", "Surface", "Export")
"""Steps to click; showing them starts no computation."""
RADIUS_MM = (12.0, 40.0)
MOVES, MOVE_S = 8, 0.08
"""Number of moves of a dragged slider, and the time between them, seconds."""
THINKING_S = 1.5
"""Mean time between two actions of a user, seconds."""
MESH_SHARE = 0.3
"""Share of radius changes among the actions while no mesh is awaited."""
FIRST_S = 240.0
"""Time limit for the panel, seconds; it is long because all browsers come at once."""
LONGEST_S = 30.0
"""Limit after which an answer counts as missing, seconds."""


@dataclass(slots=True)
class Diary:
    """Times measured by one browser, seconds; NaN for those that it did not reach."""

    opened_s: float = float("nan")
    """Time from the browser's start until the panel had its steps and the slider of the radius."""
    first_mesh_s: float = float("nan")
    """Time from the browser's start until the first surface was complete."""
    answers_s: list[float] = field(default_factory=list)
    """Answer times of clicks that need no computation."""
    meshes_s: list[float] = field(default_factory=list)
    """Times from the last move of the radius until that surface is complete."""
    lost: str = ""
    """Reason why the browser could not continue; empty if it could."""
    notices: list[str] = field(default_factory=list)


class Visitor:
    """A thread that uses the app until ``leave`` is called or the connection fails."""

    def __init__(self, url: str, seed: int) -> None:
        self.diary = Diary()
        self._url, self._rng = url, np.random.default_rng(seed)
        self._leaving = threading.Event()
        self._dragged_s: float | None = None
        self._thread = threading.Thread(target=self._visit, daemon=True)
        self._thread.start()

    def leave(self) -> None:
        """End the thread after its current action, without waiting for a mesh, and wait for its end."""
        self._leaving.set()
        self._thread.join()

    def _visit(self) -> None:
        started_s = time.monotonic()
        try:
            with contextlib.closing(Connection(self._url)) as page:
                self.diary.notices = page.notices
                self._stay(page, started_s)
        except (TimeoutError, OSError, WebSocketException) as error:
            self.diary.lost = f"{type(error).__name__}: {error}"

    def _stay(self, page: Connection, started_s: float) -> None:
        wait_for(lambda: "Radius (mm)" in page.uuids and bool(page.steps), FIRST_S)
        self.diary.opened_s = time.monotonic() - started_s
        first = False
        while not self._leaving.wait(self._rng.exponential(THINKING_S)):
            if page.lost:
                raise ConnectionError("the server ended the connection")
            if not first and (first := "surface" in page.shown_s):
                self.diary.first_mesh_s = page.shown_s["surface"] - started_s
            self._look_for_mesh(page)
            if first and self._dragged_s is None and self._rng.random() < MESH_SHARE:
                self._click(page, "Surface")
                self._drag(page)
            else:
                self._click(page, str(self._rng.choice([step for step in STEPS if step != page.current])))

    def _click(self, page: Connection, step: str) -> None:
        if page.current == step:
            return
        clicked_s = time.monotonic()
        page.go(step)
        wait_for(lambda: page.current == step, LONGEST_S)
        self.diary.answers_s.append(page.shown_s[step] - clicked_s)

    def _drag(self, page: Connection) -> None:
        steps = np.round(self._rng.uniform(*RADIUS_MM, MOVES) / STEP_MM)
        for radius_mm in np.sort(STEP_MM * steps):
            page.set("Radius (mm)", float(radius_mm))
            self._dragged_s = time.monotonic()
            time.sleep(MOVE_S)
        time.sleep(QUIET_S)  # a user does not click at once after a drag

    def _look_for_mesh(self, page: Connection) -> None:
        """Record the time of the last drag's surface if it has come."""
        if self._dragged_s is None or page.mark("Surface") != MARKS["fresh"]:
            return
        if page.shown_s["surface"] > self._dragged_s:
            self.diary.meshes_s.append(page.shown_s["surface"] - self._dragged_s)
            self._dragged_s = None
