"""viser's messages from any thread: the event that wakes their sender belongs to one.

viser 1.1 sets an ``asyncio.Event`` from whatever thread queues a message, before it has the event loop set it
again. asyncio's events are not made for that: where the loop begins to wait at the same moment, ``set`` fails
with "deque mutated during iteration", once in some thousand visits, and leaves a page half built.
"""

from __future__ import annotations

import asyncio
from typing import Any

import viser


class AnyThreadEvent(asyncio.Event):
    """An event that other threads set, too; whoever waits is woken by the loop's own call that follows."""

    def set(self) -> None:
        """Set it; on the event loop, also wake those who wait, even if it is set already."""
        self._value = True
        if _on_loop():
            for waiter in self._waiters:
                if not waiter.done():
                    waiter.set_result(True)


def queue_from_any_thread(server: viser.ViserServer) -> None:
    """Have messages to all browsers, and to each that will come, queued safely from all threads."""

    def queue_to(connection: Any) -> None:
        connection.get_message_buffer().message_event.__class__ = AnyThreadEvent

    queue_to(server._websock_server)
    server._websock_server.on_client_connect(queue_to)


def _on_loop() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True
