"""Comparison of a recording's path with the true one, where it is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.importing.tum import poses_at
from pipeline.recording.errors import ate_m
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
    true = poses_at(file, np.asarray(rig.walk.times_s))
    poses = [T if k in true else None for k, T in enumerate(rig.walk.T_world_camera)]
    apart_m = ate_m(poses, [true.get(k, np.eye(4)) for k in range(len(poses))])
    if np.isnan(apart_m):
        return rig
    note = f"The path differs from the true one by {100.0 * apart_m:.1f} cm (RMSE, aligned)"
    return replace(rig, walk=replace(rig.walk, notes=(*rig.walk.notes, note)))
