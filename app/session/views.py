"""Where a person stands before what is drawn: the app turns the view to it, and what a hand does stays."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import viser

from app.drawing.cameras import turn
from packetmesh.errors import InputError
from pipeline.types import FloatArray

View: TypeAlias = FloatArray
"""(2, 3) where to stand and what to look at, world frame, metres."""
ALIKE = 1e-3
"""Over the distance to what is looked at: two views no farther apart are one."""
ECHO_S = 0.7
"""After the app has turned the view, before a browser's answer is taken for a hand's."""
FARTHEST_M = 1e5


class Views:
    """The views of one browser, by the kind of thing that is looked at."""

    def __init__(self, client: viser.ClientHandle, clock: Callable[[], float] = time.monotonic) -> None:
        self._client, self._clock = client, clock
        self._kind = ""
        self._framed = self._before = self._now()
        self._framed_s = -ECHO_S
        self._turned: dict[str, View] = {}
        """By kind, where a hand has left it."""
        self._asked: View | None = None
        """By the address, until what it is about is there."""

    def frame(self, look: Callable[[], str], keep: bool) -> None:
        """Have the app turn the view, and turn it back to where a hand has left it.

        Args:
            look: turns the view, or leaves it as it is; the kind of what is shown.
            keep: whether it is still the same that is looked at, as when another screen was shown meanwhile.
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
        self._framed, self._before, self._framed_s = after, before, self._clock()
        wanted = self._turned.get(kind) if self._asked is None else self._asked
        if wanted is not None:
            turn(self._client, wanted[1], wanted[0])

    def settle(self) -> None:
        """All that the address asked for is there; from now on its view is like one of a hand."""
        if self._asked is not None:
            self._turned[self._kind], self._asked = self._asked, None

    def place(self) -> str:
        """Where a hand has turned the view to."""
        view = self._asked
        if view is None and (self._by_hand() or self._kind in self._turned):
            view = self._now()
        return "" if view is None else ",".join(f"{value:.3f}" for value in view.ravel())

    def take(self, place: str) -> None:
        """Turn the view to where an address says.

        Raises:
            InputError: it says no two places.
        """
        try:
            view = np.array([float(value) for value in place.split(",")] if place else [])
        except ValueError:
            view = np.zeros(1)
        if not place:
            self._asked = None
            if self._by_hand() or self._turned.pop(self._kind, None) is not None:
                turn(self._client, self._framed[1], self._framed[0])
            return
        if view.shape != (6,) or not np.all(np.abs(view) < FARTHEST_M) or np.allclose(view[:3], view[3:]):
            raise InputError("The address has a camera that is not two places, x,y,z,x,y,z in metres")
        self._asked = view.reshape(2, 3)
        turn(self._client, self._asked[1], self._asked[0])

    def _now(self) -> View:
        camera = self._client.camera
        return np.array([camera.position, camera.look_at])

    def _by_hand(self) -> bool:
        """Whether it is neither where the app has turned it nor, on its way there, where it was before."""
        if self._clock() - self._framed_s < ECHO_S or self._asked is not None:
            return False
        now = self._now()
        return not (_alike(now, self._framed) or _alike(now, self._before))


def _alike(one: View, other: View) -> bool:
    return bool(np.abs(one - other).max() <= ALIKE * max(float(np.linalg.norm(one[0] - one[1])), 1e-6))
