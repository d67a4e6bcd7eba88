"""Runs of tests in a copy of the repository, with one fault or without."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from lab.mutants.mutations import GROUPS, Mutation
from lab.trials import ROOT
from packetmesh.errors import InputError

PATIENCE = 10.0
"""Time limit of each test run, as a multiple of the time that the group's tests take without a fault; a fault
that exceeds it counts as seen, because the run may never stop."""
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
    """Return the test files named after the mutated module; they may be outside of its group's folders."""
    return sorted(copy.glob(f"tests/**/test_{Path(mutation.path).stem}.py"))


def group_tests(copy: Path, group: str) -> list[Path]:
    """Return the files and folders of a group's tests."""
    return [copy / path for path in GROUPS[group][1]]


def digest(copy: Path, mutation: Mutation) -> str:
    """Return twelve hexadecimal digits that change with the mutated module and the tests that run for it."""
    files = {copy / mutation.path, *own_tests(copy, mutation)}
    for path in group_tests(copy, mutation.group):
        files.update(path.rglob("*.py") if path.is_dir() else (path,))
    parts = (hashlib.sha256(file.read_bytes()).digest() for file in sorted(files))
    return hashlib.sha256(b"".join(parts)).hexdigest()[:12]


def time_limit_s(copy: Path, group: str, mutations: Iterable[Mutation]) -> float:
    """Run all tests of a group's mutations without a fault; return the time limit of a run with one.

    Raises:
        InputError: a test fails.
    """
    own = {path for mutation in mutations for path in own_tests(copy, mutation)}
    started = time.perf_counter()
    run = _run(copy, [*sorted(own), *group_tests(copy, group)], None)
    if run.returncode != 0:
        last = (run.stdout.strip().splitlines() or ["no output"])[-1]
        raise InputError(
            f"The tests of the group {group} fail without a fault ({last}); mend them, then plant faults"
        )
    return PATIENCE * (time.perf_counter() - started)


def sees(copy: Path, mutation: Mutation, limit_s: float) -> bool:
    """Return whether a test fails, or exceeds the time, with the fault in the copy.

    The module's own tests run first, then those of its group. Numba's whole cache is deleted before: it
    notices a changed function, but no changed constant and no changed callee of another module.

    Raises:
        InputError: a run was stopped from outside, which tells nothing of the fault.
    """
    module = copy / mutation.path
    code = module.read_text(encoding="utf-8")
    module.write_text(mutation.applied(code), encoding="utf-8")
    shutil.rmtree(copy / ".numba", ignore_errors=True)
    try:
        paths = own_tests(copy, mutation), group_tests(copy, mutation.group)
        return any(_fails(copy, mutation, some, limit_s) for some in paths if some)
    finally:
        module.write_text(code, encoding="utf-8")


def _fails(copy: Path, mutation: Mutation, paths: Sequence[Path], limit_s: float) -> bool:
    try:
        code = _run(copy, paths, limit_s).returncode
    except subprocess.TimeoutExpired:
        return True
    if code in KILLED:
        raise InputError(
            f"The tests with the fault {mutation.name} were killed, perhaps for lack of memory, so it is "
            "neither seen nor unseen; run again with --workers 1"
        )
    return code not in UNSEEN


def _run(copy: Path, paths: Sequence[Path], limit_s: float | None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *map(str, paths)]
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    environment |= {"NUMBA_CACHE_DIR": str(copy / ".numba"), "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        command,
        cwd=copy,
        env=environment,
        capture_output=True,
        text=True,
        timeout=limit_s,
        start_new_session=True,  # so that Ctrl-C stops no tests, which would count as failed
    )
