"""Runs of tests in a copy of the repository, with one fault or without."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import grimp

from lab.mutants.mutations import GROUPS, Mutation
from lab.trials import ROOT
from packetmesh.errors import InputError

PATIENCE = 5.0
"""Time limit of each test run, as a multiple of the time that the group's tests take without a fault; a fault
that exceeds it counts as seen, because the run may never stop."""
LONGEST_TEST_S = 200
"""Time limit of a single test; without a fault none takes a tenth of it."""
UNSEEN = (0, 5)
"""Exit codes of pytest if all tests pass, and if there is none to run, as all of a file are skipped. With any
other a test failed, an import failed or the interpreter crashed; without the fault none does."""
KILLED = (-signal.SIGKILL, -signal.SIGTERM)
"""Exit codes of a run that was stopped from outside, as for lack of memory."""


def copied(folder: Path) -> Path:
    """Copy every file that git tracks, so that faults are never in the working tree; return the folder."""
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in names.stdout.splitlines():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, folder / name)
    return folder


def own_tests(copy: Path, mutation: Mutation) -> list[Path]:
    """Return the package's test files named after the mutated module, some outside of its group's folders."""
    package = Path(mutation.path).parts[0]
    return sorted((copy / "tests" / package).glob(f"**/test_{Path(mutation.path).stem}.py"))


def group_tests(copy: Path, group: str) -> list[Path]:
    """Return the files and folders of a group's tests."""
    return [copy / path for path in GROUPS[group][1]]


@dataclass(frozen=True, slots=True)
class Answer:
    """Whether the tests saw a fault, and what the answer depends on."""

    seen: bool
    by: str = ""
    """The test file that saw it, relative to the repository; empty if none did or no test was named."""


def digest(copy: Path, mutation: Mutation, by: str = "") -> str:
    """Return twelve hexadecimal digits that change with what an answer depends on.

    That is the mutated module and the test file ``by`` that saw the fault, which new tests elsewhere do not
    make unseen; without one, all tests that run for the module.
    """
    files = {copy / mutation.path}
    if by:
        files.add(copy / by)
    else:
        files.update(own_tests(copy, mutation))
        for path in group_tests(copy, mutation.group):
            files.update(path.rglob("*.py") if path.is_dir() else (path,))
    parts = (hashlib.sha256(file.read_bytes()).digest() for file in sorted(files) if file.exists())
    return hashlib.sha256(b"".join(parts)).hexdigest()[:12]


def time_limit_s(copy: Path, group: str, mutations: Iterable[Mutation]) -> float:
    """Run all tests of a group's mutations without a fault; return the time limit of a run with one.

    What numba compiles for them is kept for the runs with faults.

    Raises:
        InputError: a test fails.
    """
    own = {path for mutation in mutations for path in own_tests(copy, mutation)}
    started = time.perf_counter()
    run = _run(copy, [*sorted(own), *group_tests(copy, group)], None, copy / SOUND)
    if run.returncode != 0:
        last = (run.stdout.strip().splitlines() or ["no output"])[-1]
        raise InputError(
            f"The tests of the group {group} fail without a fault ({last}); mend them, then plant faults"
        )
    return PATIENCE * (time.perf_counter() - started)


def sees(copy: Path, mutation: Mutation, limit_s: float, before: str = "") -> Answer:
    """Return whether a test fails, or exceeds the time, with the fault in the copy.

    The test file ``before`` that saw the fault in an earlier version runs first, then the module's own tests,
    then those of its group.

    Raises:
        InputError: a run was stopped from outside, which tells nothing of the fault.
    """
    module = copy / mutation.path
    code, times = module.read_text(encoding="utf-8"), module.stat()
    module.write_text(mutation.applied(code), encoding="utf-8")
    _keep_compiled(copy, mutation)
    try:
        earlier = [copy / before] if before and (copy / before).exists() else []
        for paths in (earlier, own_tests(copy, mutation), group_tests(copy, mutation.group)):
            if paths and (answer := _answer(copy, mutation, paths, limit_s)).seen:
                return answer
        return Answer(False)
    finally:
        module.write_text(code, encoding="utf-8")
        os.utime(module, ns=(times.st_atime_ns, times.st_mtime_ns))  # what was compiled of it is valid again


SOUND, FAULTY = ".numba", ".numba-fault"
"""Folders of a copy: numba's cache of the code without a fault, and with one."""


def _keep_compiled(copy: Path, mutation: Mutation) -> None:
    """Begin the cache of a fault with all that was compiled without one, but for what can depend on it.

    Numba notices a changed function, but no changed constant and no changed callee of another module.
    """
    changed = _importers(mutation.path.removesuffix(".py").replace("/", "."))

    def depends(folder: str, names: list[str]) -> list[str]:
        package = Path(folder).name.rpartition("_")[0]
        return [one for one in names if changed is None or (package, one.partition(".")[0]) in changed]

    shutil.rmtree(copy / FAULTY, ignore_errors=True)
    if (copy / SOUND).exists():
        shutil.copytree(copy / SOUND, copy / FAULTY, ignore=depends, copy_function=os.link)


@cache
def _importers(module: str) -> frozenset[tuple[str, str]] | None:
    """Return folder and name of a module and of all that import it, however far; None if it is not ours."""
    graph = _imports()
    if module not in graph.modules:
        return None
    found = {module, *graph.find_downstream_modules(module)}
    return frozenset((one.split(".")[-2], one.split(".")[-1]) for one in found if "." in one)


@cache
def _imports() -> grimp.ImportGraph:
    return grimp.build_graph("pipeline", "network_sim", "app", "lab", "packetmesh", cache_dir=None)


def _answer(copy: Path, mutation: Mutation, paths: Sequence[Path], limit_s: float) -> Answer:
    try:
        run = _run(copy, paths, limit_s, copy / FAULTY)
    except subprocess.TimeoutExpired:
        return Answer(True)
    if run.returncode in KILLED:
        raise InputError(
            f"The tests with the fault {mutation.name} were killed, perhaps for lack of memory, so it is "
            "neither seen nor unseen; run again with --workers 1"
        )
    if run.returncode in UNSEEN:
        return Answer(False)
    named = re.search(r"^(?:FAILED|ERROR) (tests/\S+?\.py)", run.stdout, re.MULTILINE)
    return Answer(True, named[1] if named else "")


def _run(
    copy: Path, paths: Sequence[Path], limit_s: float | None, compiled: Path
) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
    command += [f"--timeout={LONGEST_TEST_S}", "--timeout-method=thread", *map(str, paths)]
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONPYCACHEPREFIX": str(copy / ".bytecode")}
    environment |= {"NUMBA_CACHE_DIR": str(compiled), "OMP_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    return subprocess.run(
        command,
        cwd=copy,
        env=environment,
        capture_output=True,
        text=True,
        timeout=limit_s,
        start_new_session=True,  # so that Ctrl-C stops no tests, which would count as failed
    )
