"""A limit on the connections that have sent no view; a page sends its view at once.

Viser reports a browser with its first view: before, neither ``Crowd`` nor ``Lecture`` knows its connection.
"""

from __future__ import annotations

import asyncio

import viser

from app.web import viser_private as private

MOST_SILENT = 256
"""Most connections without a view; one more closes the one that has been silent longest."""
SILENT_S = 60.0
"""Time after which a connection without a view is closed, seconds."""


def limit_silent(server: viser.ViserServer) -> None:
    """Close connections of a new server that stay silent. All of this runs on the connections' thread."""
    silent: list[int] = []
    """Numbers of the connections without a view, the longest silent one first."""

    def come(number: int) -> None:
        silent.append(number)
        if len(silent) > MOST_SILENT:
            turn_away(silent[0])
        asyncio.get_running_loop().call_later(SILENT_S, turn_away, number)

    def turn_away(number: int) -> None:
        if number in silent:
            forget(number)
            private.close(server, number, private.TRY_AGAIN, "no page is shown")

    def forget(number: int) -> None:
        if number in silent:
            silent.remove(number)

    async def show(client: viser.ClientHandle) -> None:
        forget(client.client_id)

    private.on_opened(server, come)
    private.on_closed(server, forget)
    server.on_client_connect(show)
