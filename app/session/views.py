"""Camera views of a browser: the app turns the view to what is drawn, and keeps what the user has turned."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import viser

from app.drawing.cameras import turn
from packetmesh.errors import InputError
from pipeline.types import FloatArray

View: TypeAlias = FloatArray
"""(2, 3) camera position and look-at point in the world frame, metres."""
ALIKE = 1e-3
"""Largest difference of a coordinate between equal views, over the distance to the look-at point."""
ECHO_S = 0.7
"""Time after the app turned the view in which a browser's report is not taken for the user's, seconds."""
MOST_KNOWN = 16
FARTHEST_M = 1e5


class Views:
    """The views of one browser, by the kind of object that is looked at."""

    def __init__(self, client: viser.ClientHandle, clock: Callable[[], float] = time.monotonic) -> None:
        self._client, self._clock = client, clock
        self._kind = ""
        self._framed = self._now()
        self._framed_s = -ECHO_S
        self._known = deque([self._framed], MOST_KNOWN)
        """Views before and after the app's last turns: a slow browser may report any of them later."""
        self._turned: dict[str, View] = {}
        """Views to which the user has turned, by the kind of object."""
        self._requested: View | None = None
        """The view that the address asks for, until the results of the address have been computed."""

    @property
    def framed(self) -> View:
        """Return the view to which the app turned last."""
        return self._framed

    def frame(self, look: Callable[[], str], keep: bool) -> None:
        """Let the app turn the view, then restore the view to which the user had turned it.

        Args:
            look: turns the view or leaves it as it is, and returns the kind of object shown.
            keep: whether the same object is shown as before, for example after a visit to another screen.
        """
        before = self._now()
        if self._by_hand():
            self._turned[self._kind] = before
        kind = look()
        after = self._now()
        moved, same = not _alike(before, after), kind == self._kind
        self._kind = kind
        if not moved and same:
            return
        if moved and not keep:
            self._turned.pop(kind, None)
        self._framed, self._framed_s = after, self._clock()
        self._known += before, after
        view = self._turned.get(kind) if self._requested is None else self._requested
        if view is not None:
            turn(self._client, view[1], view[0])

    def settle(self) -> None:
        """Treat the address's view as one turned by the user, now that all its results have been computed."""
        if self._requested is not None:
            self._turned[self._kind], self._requested = self._requested, None

    def place(self) -> str:
        """Return the view that the user has turned to as text; empty for the app's own view."""
        view = self._requested
        if view is None and (self._by_hand() or self._kind in self._turned):
            view = self._now()
        return "" if view is None else ",".join(f"{value:.3f}" for value in view.ravel())

    def take(self, place: str) -> None:
        """Turn the view to the one in an address; an empty ``place`` restores the app's own view.

        Raises:
            InputError: the text is not two different positions.
        """
        try:
            view = np.array([float(value) for value in place.split(",")] if place else [])
        except ValueError:
            view = np.zeros(1)
        if not place:
            self._requested = None
            turned = self._turned.pop(self._kind, None)
            if self._by_hand() or turned is not None:
                turn(self._client, self._framed[1], self._framed[0])
            return
        if view.shape != (6,) or not np.all(np.abs(view) < FARTHEST_M) or np.allclose(view[:3], view[3:]):
            raise InputError(
                "The address has an invalid camera; give its position and target, x,y,z,x,y,z in metres"
            )
        self._requested = view.reshape(2, 3)
        self._known += self._now(), self._requested
        turn(self._client, self._requested[1], self._requested[0])

    def _now(self) -> View:
        camera = self._client.camera
        return np.array([camera.position, camera.look_at])

    def _by_hand(self) -> bool:
        """Whether the user has turned the view: it differs from all that the app turned to or from."""
        if self._clock() - self._framed_s < ECHO_S or self._requested is not None:
            return False
        now = self._now()
        return not any(_alike(now, known) for known in self._known)


def _alike(one: View, other: View) -> bool:
    return bool(np.abs(one - other).max() <= ALIKE * max(float(np.linalg.norm(one[0] - one[1])), 1e-6))
