"""A record: what a command measured, by which code, on what kind of machine, and when."""

from __future__ import annotations

import json
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path
from typing import Any

import psutil

from lab.trials import LIBRARIES, ROOT, library_versions
from packetmesh.errors import InputError
from packetmesh.files import read_text, write_json

FOLDER = ROOT / "docs" / "results"
WRITTEN = (
    *("docs/results", "docs/results.md", "README.md"),
    *("assets/depth/README.md", "assets/depth/worth.md"),
)
"""What records and pages are written to: changes there are no changes of the code."""
DIGITS = 6
"""Significant digits that a record keeps of a number."""


@dataclass(frozen=True, slots=True)
class Record:
    """The numbers of one command."""

    name: str
    command: str
    """A line that anybody can run."""
    commit: str
    """Short hash of the code that ran."""
    date: str
    """ISO 8601."""
    versions: dict[str, str]
    """Of Python and of the libraries that are installed."""
    machine: str
    """Its class: cores and memory."""
    numbers: dict[str, Any]


Records = Mapping[str, Record]
"""By name."""


def new_record(name: str, command: str, commit: str, numbers: dict[str, Any]) -> Record:
    """What was measured today on this machine."""
    versions = library_versions((*LIBRARIES, "viser", "pymeshlab"))
    return Record(name, command, commit, date.today().isoformat(), versions, machine(), rounded(numbers))


def read_records(folder: Path = FOLDER) -> dict[str, Record]:
    """All records of a folder, by name.

    Raises:
        InputError: a file is no record.
    """
    records = {}
    for path in sorted(folder.glob("*.json")):
        try:
            records[path.stem] = Record(path.stem, **json.loads(read_text(path, "record")))
        except (ValueError, TypeError) as error:
            raise InputError(f"{path} is no record of results ({error}); record it again") from None
    return records


def write_record(record: Record, folder: Path = FOLDER) -> Path:
    """Write ``NAME.json`` and give its path."""
    values = asdict(record)
    path = folder / f"{values.pop('name')}.json"
    write_json(path, values)
    return path


def committed_code(root: Path = ROOT) -> str:
    """The commit of the code in ``root``.

    Raises:
        InputError: files differ from it, so that it would not say what ran.
    """
    unlike = _git(root, "status", "--porcelain", "--", ".", *(f":!{path}" for path in WRITTEN))
    if unlike:
        raise InputError(
            f"{unlike.splitlines()[0][3:]} differs from the last commit; commit before recording results"
        )
    return _git(root, "rev-parse", "--short", "HEAD")


def _git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise InputError(f"git says of {root}: {done.stderr.strip()}; record results in a clone")
    return done.stdout.rstrip()


def machine() -> str:
    """Cores, memory and graphics of this machine, without its name."""
    graphics = "an NVIDIA GPU" if any(Path("/dev").glob("nvidia[0-9]*")) else "no GPU"
    memory_gib = psutil.virtual_memory().total / 2**30
    return f"{psutil.cpu_count()} {platform.machine()} cores, {memory_gib:.0f} GiB of memory, {graphics}"


def rounded(value: Any) -> Any:
    """Plain values with every float to six significant digits."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
