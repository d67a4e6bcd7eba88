"""A line of limited rate in front of a server, which many browsers share, as behind an access point."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from urllib.parse import urlsplit

CHUNK_BYTES = 16 << 10
BURST_S = 0.05
"""Time for which the line may run ahead of its rate."""


@dataclass
class Line:
    """A running line."""

    url: str
    """Address of the server behind it."""
    bytes_down: int = 0
    """Bytes from the server so far."""
    bytes_up: int = 0


@contextmanager
def line(url: str, bits_per_s: float) -> Iterator[Line]:
    """Context with a line to a server, whose browsers together get ``bits_per_s`` from it.

    A token bucket: each piece waits until the line has carried those before it.
    """
    there = urlsplit(url)
    loop, ready = asyncio.new_event_loop(), threading.Event()
    found = Line("")
    free_s = 0.0

    async def carried(size: int) -> None:
        """Wait until the line has room for so many bytes."""
        nonlocal free_s
        now_s = loop.time()
        free_s = max(free_s, now_s - BURST_S) + 8.0 * size / bits_per_s
        if free_s > now_s:
            await asyncio.sleep(free_s - now_s)

    async def down(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
        while data := await source.read(CHUNK_BYTES):
            await carried(len(data))
            found.bytes_down += len(data)
            target.write(data)
            await target.drain()

    async def up(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
        while data := await source.read(CHUNK_BYTES):
            found.bytes_up += len(data)
            target.write(data)
            await target.drain()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            behind, to_server = await asyncio.open_connection(there.hostname, there.port)
            both = [asyncio.create_task(down(behind, writer)), asyncio.create_task(up(reader, to_server))]
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            for task in both:
                task.cancel()
            await asyncio.gather(*both, return_exceptions=True)
            to_server.close()
        writer.close()

    async def run() -> None:
        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        found.url = f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        ready.set()

    def work() -> None:
        asyncio.set_event_loop(loop)
        loop.create_task(run())
        loop.run_forever()

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    ready.wait()
    try:
        yield found
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
