"""The server under load, in its own process, which also reports its state."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import psutil

READY_S = 120.0


@dataclass(frozen=True, slots=True)
class Look:
    """The server's state at one moment."""

    sessions: int
    threads: int
    files: int
    """Number of files in the store, including uploads."""
    bytes: int
    strays: tuple[int, ...]
    """Numbers of the running jobs of browsers that have left; a job keeps its number."""
    prepared: bool
    """Whether the server has computed everything that it computes ahead."""
    server_bytes: int = 0
    """Memory of the server process."""
    workers_bytes: int = 0
    """Memory of all computing processes together."""


class Serving:
    """A server that reports its state."""

    def __init__(self, url: str, process_id: int, pipe: Connection) -> None:
        self.url = url
        self._process, self._pipe = psutil.Process(process_id), pipe

    def look(self) -> Look:
        """Return the present state."""
        self._pipe.send("look")
        inside: tuple[int, int, int, int, tuple[int, ...], bool] = self._pipe.recv()
        return Look(*inside, _memory_bytes(self._process), sum(map(_memory_bytes, self._workers())))

    def used_s(self) -> float:
        """Return the processor time that the serving process, without its workers, has used."""
        times_s = self._process.cpu_times()
        return float(times_s.user + times_s.system)

    def _workers(self) -> list[psutil.Process]:
        return self._process.children(recursive=True)


def _memory_bytes(process: psutil.Process) -> int:
    try:
        return int(process.memory_info().rss)
    except psutil.Error:
        return 0


@contextmanager
def serving(scene: str) -> Iterator[Serving]:
    """Context with a server on loopback that starts with a scene.

    Raises:
        TimeoutError: it did not start within ``READY_S``.
        EOFError: its process ended at the start.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(there, scene))
    process.start()
    there.close()
    try:
        if not here.poll(READY_S):
            raise TimeoutError("the server did not start")
        yield Serving(here.recv(), process.pid or 0, here)
    finally:
        here.close()
        process.join(20.0)
        process.kill()


def _serve(pipe: Connection, scene: str) -> None:
    """Run as the main function of the process: serve, send the address, then answer each "look" with the
    server's state until the other end of the pipe is closed.
    """
    from app.server import build_server

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    app = build_server(scene, port=0, ahead=True)
    unused, numbers = itertools.count(), dict[object, int]()  # running jobs only: a key keeps its owner alive
    try:
        pipe.send(app.url)
        while pipe.recv() == "look":
            there = {id(owner) for owner in app.owners}
            gone = [owner for owner in app.pool.running() if id(owner) not in there]
            sizes = list(_sizes(app.folder.path))
            numbers = {owner: numbers[owner] if owner in numbers else next(unused) for owner in gone}
            strays = tuple(numbers.values())
            prepared = app.ahead is not None and app.ahead.done
            inside = len(app.sessions), threading.active_count(), len(sizes), sum(sizes), strays, prepared
            pipe.send(inside)
    except EOFError:
        pass
    finally:
        app.stop()


def _sizes(folder: Path) -> Iterator[int]:
    """Yield the sizes of all files below a folder that still exist."""
    for below, _, names in os.walk(folder):
        for name in names:
            with suppress(OSError):
                yield Path(below, name).stat().st_size
