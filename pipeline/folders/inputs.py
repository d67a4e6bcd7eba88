"""Refusal of outputs that would replace the files from which they are made."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.io.rigs import is_pair


def check_inputs_stay(replaced: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Check that no file or folder that a command replaces is one of its inputs, or contains one.

    Raises:
        InputError: one is.
    """
    places = [path.resolve() for path in replaced]
    for given in inputs:
        if any(given.resolve().is_relative_to(place) for place in places):
            raise InputError(f"The results would replace {given}, an input; try another place for --out")


def check_cameras_stay(folder: Path) -> None:
    """Check that a calibration in a folder would not replace the camera files of an RGB-D pair or a rig.

    Raises:
        InputError: the folder is a pair, or has nodes that are.
    """
    if any(map(is_pair, (folder, *folder.glob("node_*")))):
        raise InputError(
            f"{folder} has the images of a rig, and the results would replace its cameras; try another place "
            "for --out, and give it to `reconstruct` as --calibration"
        )
