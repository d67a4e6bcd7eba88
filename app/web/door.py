"""A limit on how fast browsers may connect; no connection is accepted before the server is ready."""

from __future__ import annotations

import http
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from app.web.origin import Answer, answering

MOST_AT_ONCE, MOST_A_SECOND = 48.0, 4.0
"""Connections of one address: the largest burst, and the rate per second after it. A class behind one router
connects in one burst."""
MOST_ADDRESSES = 10_000
"""Number of addresses above which those with a full allowance are forgotten."""
NOT_NOW = "PacketMesh takes no more connections at this moment; the page tries again automatically.\n"


@dataclass(slots=True)
class _Allowance:
    """The connections that an address may still open."""

    left: float
    counted_s: float


class Door:
    """Limits the connection rate of each address; refuses all connections until it is opened."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._allowances: dict[str, _Allowance] = {}
        self.is_open = False

    def guarded(self) -> AbstractContextManager[None]:
        """Return a context. A server started in it answers connections too early or too frequent with 503."""
        return answering(self._answering)

    def lets_in(self, address: str) -> bool:
        """Whether one more connection of an address is accepted; an accepted one is counted."""
        now_s = self._clock()
        if len(self._allowances) > MOST_ADDRESSES:
            self._forget(now_s)
        one = self._allowances.setdefault(address, _Allowance(MOST_AT_ONCE, now_s))
        one.left = min(one.left + MOST_A_SECOND * (now_s - one.counted_s), MOST_AT_ONCE)
        one.counted_s = now_s
        if not self.is_open or one.left < 1.0:
            return False
        one.left -= 1.0
        return True

    def _forget(self, now_s: float) -> None:
        """Forget the addresses whose allowance is full again."""
        whole_s = MOST_AT_ONCE / MOST_A_SECOND
        self._allowances = {
            address: one for address, one in self._allowances.items() if now_s - one.counted_s < whole_s
        }

    def _answering(self, answer: Answer) -> Answer:
        def answered(connection: Any, request: Any) -> Any:
            response = answer(connection, request)
            if response is not None or self.lets_in(str((connection.remote_address or ("",))[0])):
                return response
            refusal = connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, NOT_NOW)
            refusal.headers["Retry-After"] = "1"
            return refusal

        return answered
