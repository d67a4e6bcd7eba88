"""Jobs that the worker tests run in spawned processes."""

import os
import time
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.progress import Progress


def note(folder: str, name: str) -> str:
    """Leave a trace of having run, wait for the file ``go``, and return the name."""
    Path(folder, name).touch()
    while not Path(folder, "go").exists():
        time.sleep(0.005)
    return name


def report_and_note(folder: str, name: str):
    """Report until the file ``go`` is there."""
    Path(folder, name).touch()
    while not Path(folder, "go").exists():
        yield Progress("waiting", 0.5)
        time.sleep(0.005)
    yield Progress("going", 0.9)
    return name


def crash_when_told(folder: str) -> None:
    """Die once the file ``go`` is there."""
    Path(folder, "began").touch()
    while not Path(folder, "go").exists():
        time.sleep(0.005)
    os._exit(3)


def warm_up_when_told():
    """Be ready once the file ``go`` is there; a numbered file for each start holds the process."""
    folder = Path(os.environ["STARTED"])
    Path(folder, str(1 + len(list(folder.glob("[0-9]"))))).write_text(str(os.getpid()))
    while not Path(folder, "go").exists():
        time.sleep(0.005)
    yield


def count(n: int):
    """Report n times, return n."""
    for i in range(n):
        yield Progress("counting", i / n)
    return n


def count_forever(folder: str):
    """Report until stopped, leaving a trace of an orderly end."""
    Path(folder, "began").touch()
    try:
        while True:
            yield Progress("counting", 0.0)
            time.sleep(0.005)
    finally:
        Path(folder, "tidied").touch()


def deaf(folder: str) -> None:
    """Compute without ever reporting."""
    Path(folder, "began").touch()
    time.sleep(600)


def refuse() -> None:
    raise InputError("The cloud 'x.ply' is empty; try another file.")


def stumble() -> None:
    raise ZeroDivisionError("division by zero")


def crash() -> None:
    os._exit(3)


def process_id() -> int:
    return os.getpid()


WARMED = []


def warm_up_without_end():
    WARMED.append("before the first job")
    yield
    while True:
        WARMED.append("while none waits")
        time.sleep(0.01)
        yield


def warm_up_that_fails():
    yield
    raise RuntimeError("a library is broken")


def warmed():
    return len(WARMED), WARMED[0]
