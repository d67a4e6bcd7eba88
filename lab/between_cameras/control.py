"""The control: as many tiles of each camera left out as by our method, but drawn at random."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lab.between_cameras.trials import Masks, Method, Row, Task, ours, trial
from pipeline.delivery.tiled import TILE
from pipeline.types import FloatArray, Rig

NAME = "random tiles, as many as ours"


def control(task: Task) -> list[Row]:
    """Return the row of random tiles for one rig."""
    rows = trial(task, {NAME: Method(_random_masks, lambda *_: 0)}, ("placed", "chain"))
    return [row for row in rows if row["method"] == NAME]


def _random_masks(rig: Rig, poses: Sequence[FloatArray]) -> Masks:
    """Return random tiles, among those of each camera that hold measured depth."""
    rng = np.random.default_rng(0)
    drawn = []
    for mask, frame in zip(ours().masks(rig, poses), rig.frames, strict=True):
        rows, columns = mask.shape
        height, width = frame.depth.z_m.shape
        measured = np.zeros((TILE * rows, TILE * columns), np.bool_)
        measured[:height, :width] = frame.depth.valid
        filled = np.flatnonzero(measured.reshape(rows, TILE, columns, TILE).any(axis=(1, 3)))
        random = np.zeros(mask.size, np.bool_)
        random[rng.choice(filled, int(mask.sum()), replace=False)] = True
        drawn.append(random.reshape(mask.shape))
    return tuple(drawn)
