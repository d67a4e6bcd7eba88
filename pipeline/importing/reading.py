"""Reading the frames of a recording's folder, of any kind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.kinds import Kind, recognise
from pipeline.importing.sequence import Sequence, distinct
from pipeline.types import AnyPath

MOST_FRAMES = 5000
"""Most frames of a recording; of a longer one every n-th is used, which bounds time and memory."""


def of_many(frames: int) -> tuple[slice, tuple[str, ...]]:
    """Return which of a recording's frames are used, and a note if not all."""
    step = max(1, -(-frames // MOST_FRAMES))
    note = f"Of the {frames} frames one in {step} is used, so that there are at most {MOST_FRAMES}"
    return slice(None, None, step), (note,) if step > 1 else ()


def check_scale(depth_scale: float | None) -> None:
    """Raise an InputError for a depth scale that cannot be."""
    if depth_scale is not None and not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InputError(f"The depth scale is {depth_scale}; try 1000 for images in millimetres")


def check_bag_intrinsics(bag: Path, intrinsics: AnyPath | None) -> None:
    """Raise an InputError for an intrinsics file that is given with a bag."""
    if intrinsics is not None:
        raise InputError(
            f"The cameras of the bag {bag} are read from its camera_info; try without intrinsics"
        )


def read_sequence(
    path: Path, depth_scale: float | None, intrinsics: AnyPath | None
) -> tuple[Kind, Path, Sequence]:
    """Return kind, folder and frames of a recording, each moment once; no image is read.

    Args:
        path: the recording's folder, or a folder with only this recording.
        depth_scale: depth units per metre; None takes that of the kind of recording.
        intrinsics: intrinsics file of the colour camera; None takes the recording's, or those of its kind.

    Raises:
        InputError: the path is no usable recording.
    """
    kind, folder = recognise(path)
    sequence = kind.read(folder, None if intrinsics is None else Path(intrinsics))
    if depth_scale is not None:
        sequence = sequence.with_scale(depth_scale)
    candidates, repeated = distinct(sequence.candidates)
    return kind, folder, replace(sequence, candidates=candidates, notes=(*sequence.notes, *repeated))
