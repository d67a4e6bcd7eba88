"""Reader of a recording's folder or file of any kind, and bounds on its number of frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.depth_units import MEDIUM_WEIGHT
from pipeline.importing.kinds import Kind, recognise
from pipeline.importing.sequence import Sequence, distinct
from pipeline.types import AnyPath

CONFIDENCE_NOTE = (
    "Depth to which the telephone gives its lowest confidence (0) is left out; that of medium confidence "
    f"counts {MEDIUM_WEIGHT:g} in the map of a camera that walks, and 1 elsewhere"
)
MOST_FRAMES, MOST_CANDIDATES = 5000, 12_000
"""Most frames of a recording, and most from which a few are chosen; of more every n-th is used, which bounds
time and memory."""


def slice_of_frames(frames: int, most: int) -> tuple[slice, tuple[str, ...]]:
    """Return a slice with at most ``most`` of a recording's frames, and a note if it lacks some."""
    step = max(1, -(-frames // most))
    note = f"One in {step} of the {frames} frames is used, by number and not by motion (at most {most})"
    return slice(None, None, step), (note,) if step > 1 else ()


def check_scale(depth_scale: float | None) -> None:
    """Raise an InputError for a depth scale that is not a positive finite number."""
    if depth_scale is not None and not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InputError(f"The depth scale is {depth_scale}; try 1000 for images in millimetres")


def check_bag_intrinsics(bag: Path, intrinsics: AnyPath | None) -> None:
    """Raise an InputError for an intrinsics file that is given with a bag."""
    if intrinsics is not None:
        raise InputError(
            f"The cameras of the bag {bag} are read from its camera_info; try without intrinsics"
        )


def read_sequence(
    path: Path, depth_scale: float | None, intrinsics: AnyPath | None, most: int
) -> tuple[Kind, Path, Sequence]:
    """Return kind, place and frames of a recording, each moment once; only a few images are read.

    Args:
        path: the recording's folder or file, or a folder with only this recording.
        depth_scale: depth units per metre; None takes that of the kind of recording.
        intrinsics: intrinsics file of the colour camera; None takes the recording's, or those of its kind.
        most: largest number of frames; of more every n-th is used.

    Raises:
        InputError: the path is no usable recording.
    """
    kind, folder = recognise(path)
    sequence = kind.read(folder, None if intrinsics is None else Path(intrinsics))
    if depth_scale is not None:
        sequence = sequence.with_scale(depth_scale)
    sequence = sequence.completed(sequence)
    candidates, repeated = distinct(sequence.candidates)
    chosen, rare = slice_of_frames(len(candidates), most)
    candidates = candidates[chosen]
    confident = (CONFIDENCE_NOTE,) if any(one.confidence is not None for one in candidates) else ()
    notes = (*sequence.notes, *repeated, *rare, *confident)
    return kind, folder, replace(sequence, candidates=candidates, notes=notes)
