"""Poses of a recording: those that can be used, and why the others cannot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import read_text
from pipeline.io.poses import departure, matrix_in, nearest_rigid, why_not_rigid
from pipeline.types import FloatArray


@dataclass(frozen=True, slots=True)
class FoundPoses:
    """Poses as they were read from the files of a recording."""

    T_world_camera: Mapping[Any, FloatArray]
    """(4, 4) poses, metres, by the path or number of their frame."""
    refused: tuple[str, ...]
    """A sentence without a remedy for each pose that exists but cannot be used."""
    lost: int
    """Number of poses with infinite or undefined numbers, as recordings have where they lost track."""
    departure: float
    """Largest departure from orthonormal (``departure``) of the rotations of ``T_world_camera`` as read."""

    @property
    def count(self) -> int:
        """Number of poses, usable or not."""
        return len(self.T_world_camera) + len(self.refused) + self.lost


def poses_in_files(paths: Iterable[Path]) -> FoundPoses:
    """Read pose files of 4 x 4 numbers; a file that is missing has no pose."""
    matrices: dict[Any, FloatArray] = {}
    unreadable = []
    for path in paths:
        if not path.is_file():
            continue
        try:
            T = matrix_in(read_text(path, "pose file"))
        except InputError as error:
            unreadable.append(str(error).split(";")[0])
            continue
        if T is None:
            unreadable.append(f"{path.name} does not hold 4 x 4 numbers")
        else:
            matrices[path] = T
    return found_poses(matrices, unreadable)


def found_poses(matrices: Mapping[Any, FloatArray], unreadable: Iterable[str] = ()) -> FoundPoses:
    """Return poses from (4, 4) matrices, each with the nearest rotation.

    Args:
        matrices: matrices by the path or number of their frame.
        unreadable: sentences on further poses that could not be read.
    """
    poses: dict[Any, FloatArray] = {}
    refused, lost, off = list(unreadable), 0, 0.0
    for key, T in matrices.items():
        nearest = nearest_rigid(T)
        if nearest is not None:
            poses[key] = nearest
            off = max(off, departure(T))
        elif np.isfinite(T).all():
            name = key.name if isinstance(key, Path) else f"The pose of frame {key}"
            refused.append(f"{name} is not a rigid transform: {why_not_rigid(T)}")
        else:
            lost += 1
    return FoundPoses(poses, tuple(refused), lost, off)


def scanned_transform(path: Path) -> tuple[FloatArray, float]:
    """Read the (4, 4) rigid transform, metres, in a file of a recording, and its ``departure`` as read.

    Raises:
        InputError: the file holds no rigid transform.
    """
    found = poses_in_files([path])
    if path not in found.T_world_camera:
        why = found.refused[0] if found.refused else f"{path.name} does not hold finite numbers"
        raise InputError(f"In {path.parent}, {why}; try to export the recording again, or remove the file")
    return found.T_world_camera[path], found.departure
