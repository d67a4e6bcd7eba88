"""Refusal of outputs that would replace the files from which they are made."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from packetmesh.errors import InputError


def keep_inputs(replaced: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Check that no file or folder that a command replaces is one of its inputs, or contains one.

    Raises:
        InputError: one is.
    """
    places = [path.resolve() for path in replaced]
    for given in inputs:
        if any(given.resolve().is_relative_to(place) for place in places):
            raise InputError(f"The results would replace {given}, an input; try another place for --out")
