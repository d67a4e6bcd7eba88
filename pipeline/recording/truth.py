"""Comparison of a recording's path with the true one, where it is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pipeline.importing.tum import poses_at
from pipeline.recording.errors import path_note
from pipeline.types import Rig


def with_true_path(rig: Rig, file: Path) -> Rig:
    """Return the rig with a note on how far the camera's path is from the true one.

    Args:
        rig: rig of a recording; without a walk it is returned as it is.
        file: true poses in TUM's form, at the times of the frames.

    Raises:
        InputError: the file cannot be read.
    """
    if rig.walk is None:
        return rig
    walk = rig.walk
    true = poses_at(file, walk.times_s)
    notes = path_note(walk.T_world_camera, [true.get(k) for k in range(len(walk.times_s))], "the true one")
    return replace(rig, walk=replace(walk, notes=(*walk.notes, *notes)))
