"""Run the trials of claims, store their results, and skip those that are already stored.

A trial is a function of a task. Its result is a line of JSON in a file named by the function and a digest of
its code: an interrupted run resumes, and changed code starts a new file.
"""

from __future__ import annotations

import ast
import hashlib
import json
import platform
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar

import packetmesh
from packetmesh.batch import run_batch
from packetmesh.files import finite, writable_folder
from packetmesh.progress import Progress

Task = TypeVar("Task")

ROOT = Path(packetmesh.__file__).parents[1]
PACKAGES = ("packetmesh", "network_sim", "pipeline", "lab")
LIBRARIES = (
    "numpy",
    "scipy",
    "numba",
    "opencv-python-headless",
    "open3d",
    "open3d-cpu",
    "onnxruntime",
    "simpy",
    "trimesh",
    "small-gicp",
    "kiss-matcher",
    "kiss-icp",
    "pycolmap",
)
"""Libraries whose version can change a result; those that are not installed are skipped."""
PART_BYTES = 1 << 24
"""Bytes of a data file that are read at once; a data set may be larger than the memory."""


def iterate_trials(
    stage: str,
    function: Callable[[Task], Any],
    tasks: Sequence[Task],
    folder: Path,
    scheduler: str | None = None,
    processes: int | None = None,
    data: Iterable[Path] = (),
) -> Generator[Progress, None, list[Any]]:
    """Compute every task whose result is not in ``folder`` yet, and store each result at once.

    Args:
        stage: name of the trials in the progress reports.
        function: importable by its name, because other processes call it; returns plain values (NaN becomes
            None).
        tasks: frozen records or tuples; their ``repr`` contains everything that a result depends on besides
            the code and the data.
        folder: folder of the results; made if it is missing.
        scheduler: address of a Dask scheduler; None takes processes on this machine.
        processes: number of processes on this machine; None takes one per core.
        data: files that results depend on, or folders of them.

    Returns:
        The results in the order of the tasks, read back from JSON.

    Raises:
        InputError: the folder cannot be written, or the scheduler cannot be reached.
        PacketMeshError: a process was killed.
    """
    digest = trial_digest(function.__module__, tuple(data))
    path = writable_folder(folder) / f"{function.__name__}-{digest}.ndjson"
    results = _read(path)
    keys = [repr(task) for task in tasks]
    waiting = [(key, task) for key, task in zip(keys, tasks, strict=True) if key not in results]
    done = len(keys) - len(waiting)
    yield Progress(f"{stage}: {done} of {len(keys)} stored", done / max(len(keys), 1))
    with path.open("a", encoding="utf-8") as file:
        for index, result in run_batch(function, [task for _, task in waiting], scheduler, processes):
            key = waiting[index][0]
            line = json.dumps(finite({"task": key, "result": result}), allow_nan=False)
            file.write(f"{line}\n")
            file.flush()
            results[key] = json.loads(line)["result"]
            done += 1
            yield Progress(f"{stage}: {done} of {len(keys)}", done / len(keys))
    return [results[key] for key in keys]


def _read(path: Path) -> dict[str, Any]:
    """Return results by task; a half-written last line is cut off, and invalid lines are ignored."""
    if not path.exists():
        return {}
    contents = path.read_bytes()
    whole = contents[: contents.rfind(b"\n") + 1]
    if len(whole) < len(contents):
        with path.open("r+b") as file:
            file.truncate(len(whole))
    results = {}
    for line in whole.splitlines():
        try:
            entry = json.loads(line)
            results[entry["task"]] = entry["result"]
        except (ValueError, KeyError, TypeError):
            continue
    return results


@cache
def trial_digest(module: str, data: tuple[Path, ...] = (), root: Path = ROOT) -> str:
    """Return twelve hexadecimal digits that change with everything that a trial depends on besides its task.

    That is the code of its module and of all our modules that it imports, directly or not, without comments
    and docstrings; the versions of Python and of ``LIBRARIES``; and the data. A process computes it once.

    Args:
        module: module that defines the trial's function.
        data: files and folders.
        root: folder of our packages.
    """
    digest = hashlib.sha256(json.dumps(library_versions()).encode())
    for name, tree in sorted(_imported(module, root).items()):
        digest.update(f"{name} {ast.dump(tree)}".encode())
    for path in data:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.is_file():
                with file.open("rb") as contents:
                    while part := contents.read(PART_BYTES):
                        digest.update(part)
    return digest.hexdigest()[:12]


def _imported(module: str, root: Path) -> dict[str, ast.Module]:
    """Return the syntax trees of a module and of every module of ours that it imports, by name."""
    found: dict[str, ast.Module] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in found or (file := _source(name, root)) is None:
            continue
        found[name] = ast.parse(file.read_bytes())
        for node in ast.walk(found[name]):
            if isinstance(node, ast.Import):
                waiting += [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                inside = [f"{node.module}.{alias.name}" for alias in node.names]
                waiting += [full if _source(full, root) else node.module for full in inside]
            elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                node.value.value = None  # a docstring
    return found


def _source(module: str, root: Path) -> Path | None:
    """Return the file of one of our modules; None for other modules or names."""
    path = root.joinpath(*module.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return file if module.partition(".")[0] in PACKAGES and file.is_file() else None


def library_versions(libraries: Iterable[str] = LIBRARIES) -> dict[str, str]:
    """Return the versions of Python and of those of these libraries that are installed, by name."""
    versions = {"python": platform.python_version()}
    for library in libraries:
        with suppress(metadata.PackageNotFoundError):
            versions[library] = metadata.version(library)
    return versions
