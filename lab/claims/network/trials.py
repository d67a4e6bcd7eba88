"""Runs behind the claims: on every core, each kept in a file of its own, so that a stopped study goes on."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Generator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import network_sim
from lab.claims.network.tasks import Values
from packetmesh.batch import run_batch
from packetmesh.files import write_json
from packetmesh.progress import Progress

Task = TypeVar("Task")


def iterate_trials(
    stage: str, function: Callable[[Task], Values], tasks: Sequence[Task], folder: Path
) -> Generator[Progress, None, list[Values]]:
    """The values of every task, in their order; done are only those that ``folder`` does not have yet.

    Args:
        stage: what the progress says.
        function: importable by its name, as other processes call it.
        tasks: what it is called with; their ``repr`` says everything that the values depend on.
        folder: keeps the values; made when it is missing.

    Raises:
        InputError: the folder cannot be written.
    """
    files = [folder / "network" / f"{trial_key(function, task)}.json" for task in tasks]
    found = {file: values for file in files if (values := _read(file)) is not None}
    waiting = {file: task for file, task in zip(files, tasks, strict=True) if file not in found}
    yield Progress(f"{stage}: {len(found)} of {len(files)} at hand", len(found) / max(len(files), 1))
    names = list(waiting)
    for index, values in run_batch(function, list(waiting.values())):
        write_json(names[index], {"task": repr(waiting[names[index]]), "values": values})
        found[names[index]] = values
        yield Progress(f"{stage}: {len(found)} of {len(files)}", len(found) / len(files))
    return [found[file] for file in files]


def trial_key(function: Callable[..., Any], task: object) -> str:
    """Sixteen digits that change with the task and with the code that its values depend on."""
    module = inspect.getmodule(function)
    source = "" if module is None else inspect.getsource(module)
    contents = "\n".join((function.__qualname__, source, repr(task), _code_digest()))
    return hashlib.sha256(contents.encode()).hexdigest()[:16]


@cache
def _code_digest() -> str:
    """Digest of the simulator without its experiments."""
    root = Path(network_sim.__file__).parent
    files = sorted(path for path in root.rglob("*.py") if "experiments" not in path.parts)
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def _read(file: Path) -> Values | None:
    """The values in a file; None if it is missing or not ours, so that its task runs again."""
    try:
        values = json.loads(file.read_text())["values"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return values if isinstance(values, dict) else None
