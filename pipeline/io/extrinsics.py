"""Pose of a separate depth camera relative to the colour camera: ``extrinsics.json``."""

from __future__ import annotations

import json

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, read_json
from pipeline.io.poses import departure, nearest_rigid, rounding_note, why_not_rigid
from pipeline.types import AnyPath, FloatArray

KEY = "T_color_depth"


def read_extrinsics(path: AnyPath) -> FloatArray:
    """Read the (4, 4) ``T_color_depth`` as ``read_extrinsics_noted`` does, without its note."""
    return read_extrinsics_noted(path)[0]


def read_extrinsics_noted(path: AnyPath) -> tuple[FloatArray, tuple[str, ...]]:
    """Read the (4, 4) ``T_color_depth``, metres, from the depth camera's to the colour camera's frame.

    A matrix that is not quite a rotation is replaced by the nearest rotation, with a note.

    Raises:
        InputError: the file is unreadable, or has no rigid transform of that name.
    """
    values = read_json(path, "extrinsics file")
    remedy = f'try {{"{KEY}": four rows of four}}, a rotation and a translation in metres'
    if KEY not in values:
        known = ", ".join(list(values)[:6]) or "no key"
        raise InputError(f"The extrinsics file {path} has no {KEY} but {known}; {remedy}")
    try:
        T = np.array(values[KEY], dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        T = np.empty(0)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise InputError(f"The {KEY} of the extrinsics file {path} is not 4 x 4 finite numbers; {remedy}")
    nearest = nearest_rigid(T)
    if nearest is None:
        raise InputError(
            f"The {KEY} of the extrinsics file {path} is not a rigid transform: {why_not_rigid(T)}; {remedy}"
        )
    return nearest, rounding_note(f"The rotation in {path}", departure(T))


def write_extrinsics(path: AnyPath, T_color_depth: FloatArray) -> None:
    """Write a (4, 4) transform so that reading it gives exactly the same numbers.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(path) as sibling:
        sibling.write_text(json.dumps({KEY: T_color_depth.tolist()}, indent=1, allow_nan=False) + "\n")
