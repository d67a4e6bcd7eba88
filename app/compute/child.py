"""The main function of a computing process: run the pool's jobs and report, until the server has ended."""

from __future__ import annotations

import inspect
import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any

from packetmesh.batch import THREAD_LIMITS
from packetmesh.errors import PacketMeshError
from packetmesh.files import file_trouble

NICENESS = 5
"""Niceness of the computing processes: the server process gets the processor first."""
TRY_SMALLER = "try smaller settings (fewer points, images or nodes, or a shorter run)."
OUT_OF_MEMORY = f"There is not enough memory for this: {TRY_SMALLER}"


def attend(connection: Connection, warm_up: Callable[[], Iterator[None]], threads: int) -> None:
    """Run as the main function of a computing process.

    Args:
        connection: pipe to the pool: receives ("job", (function, arguments)) and ("stop", None); sends
            "ready", "warm", "progress" and the job's outcome, each with a value.
        warm_up: yields between the parts of the warm-up; the first is run before "ready".
        threads: number of threads for numerical libraries.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_server, daemon=True).start()
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    for name in THREAD_LIMITS:
        os.environ.setdefault(name, str(threads))
    try:
        warming = warm_up()
        more, warm_sent = _goes_on(warming), False
        connection.send(("ready", None))
        while True:
            while more and not connection.poll():
                more = _goes_on(warming)
            if not (more or warm_sent):
                connection.send(("warm", None))
                warm_sent = True
            kind, job = connection.recv()
            if kind == "job":
                connection.send(_answer(connection, *job))
    except (EOFError, OSError):
        return


def _goes_on(warming: Iterator[None]) -> bool:
    """Run one part of the warm-up. Returns whether there is more."""
    try:
        next(warming)
    except StopIteration:
        return False
    except Exception:  # the first job fails in the same way and reports it
        traceback.print_exc()
        return False
    return True


def _end_with_server() -> None:
    """End this process when the server ends: a job that never reports would not notice it."""
    server = multiprocessing.parent_process()
    assert server is not None
    server.join()
    os._exit(1)


def _answer(
    connection: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]
) -> tuple[str, Any]:
    """Run one job. Returns its outcome as a message for the pool's thread that attends this process."""
    try:
        value = function(*arguments)
        while inspect.isgenerator(value):
            try:
                connection.send(("progress", next(value)))
            except StopIteration as stop:
                value = stop.value
                break
            if connection.poll():
                connection.recv()
                value.close()
                return "stopped", None
        return "result", value
    except PacketMeshError as error:
        return "error", str(error)
    except MemoryError:
        return "error", OUT_OF_MEMORY
    except OSError as error:
        if isinstance(error, (BrokenPipeError, ConnectionError)):
            raise
        return "error", file_trouble(error)
    except Exception as error:
        traceback.print_exc()
        return "error", f"This step failed unexpectedly ({type(error).__name__}: {error})."
