"""Faults in the files of lessons, each with its file, its line and advice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from packetmesh.errors import InputError


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault in a lesson's file, with advice on what to write instead."""

    path: Path
    line: int
    """Line in the file; 0 for the file as a whole."""
    sentence: str

    def __str__(self) -> str:
        where = f", line {self.line}," if self.line else ""
        return f"The lesson {self.path.name}{where} {self.sentence}."


class Faults(list[Fault]):
    """The faults of one file."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path

    def add(self, line: int, sentence: str) -> None:
        """Add a fault; 0 for the line means the file as a whole."""
        self.append(Fault(self._path, line, sentence))


def first_of(faults: Sequence[Fault]) -> InputError:
    """Return the first fault as an error; if there are others, it names the command that shows them."""
    more = "; packetmesh lesson check shows the other faults" if faults[1:] else ""
    return InputError(f"{str(faults[0]).removesuffix('.')}{more}.")
