"""Records: a command's numbers, the code that computed them, the kind of machine, and the date."""

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
    *("docs/places_recall.svg", "docs/places_verdict.svg", "docs/recordings.svg", "docs/planning.svg"),
)
"""The records and the files written from them; a change of these is no change of the code."""
DIGITS = 6
"""Significant digits of a stored number."""


@dataclass(frozen=True, slots=True)
class Record:
    """The numbers of one command."""

    name: str
    command: str
    """Command line that gives the numbers."""
    commit: str
    """Short hash of the code that ran."""
    date: str
    """ISO 8601."""
    versions: dict[str, str]
    """Versions of Python and of the installed libraries."""
    machine: str
    """Kind of machine: cores, memory and graphics."""
    numbers: dict[str, Any]


Records = Mapping[str, Record]
"""Records by name."""


def new_record(name: str, command: str, commit: str, numbers: dict[str, Any]) -> Record:
    """Return a record of today's measurement on this machine."""
    versions = library_versions((*LIBRARIES, "viser", "pymeshlab"))
    return Record(name, command, commit, date.today().isoformat(), versions, machine(), rounded(numbers))


def read_records(folder: Path = FOLDER) -> dict[str, Record]:
    """Return all records of a folder, by name.

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
    """Write ``NAME.json`` and return its path."""
    values = asdict(record)
    path = folder / f"{values.pop('name')}.json"
    write_json(path, values)
    return path


def committed_code(root: Path = ROOT) -> str:
    """Return the short hash of the commit of the code in ``root``.

    Raises:
        InputError: files differ from the commit, so it would not identify the code; or git fails.
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
    """Return the cores, memory and graphics of this machine, without its name."""
    graphics = "an NVIDIA GPU" if any(Path("/dev").glob("nvidia[0-9]*")) else "no GPU"
    memory_gib = psutil.virtual_memory().total / 2**30
    return f"{psutil.cpu_count()} {platform.machine()} cores, {memory_gib:.0f} GiB of memory, {graphics}"


def rounded(value: Any) -> Any:
    """Return plain values with every float rounded to six significant digits."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
