"""Pose of a separate depth camera relative to the colour camera: ``extrinsics.json``."""

from __future__ import annotations

import json

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, read_json
from pipeline.io.poses import rigid_or_none
from pipeline.types import AnyPath, FloatArray

KEY = "T_color_depth"


def read_extrinsics(path: AnyPath) -> FloatArray:
    """Read the (4, 4) ``T_color_depth``, metres, from the depth camera's to the colour camera's frame.

    Raises:
        InputError: the file is unreadable, or has no rigid transform of that name.
    """
    values = read_json(path, "extrinsics file")
    try:
        T = rigid_or_none(np.array(values[KEY], dtype=np.float64))
    except (ValueError, KeyError, TypeError, OverflowError):
        T = None
    if T is None:
        raise InputError(
            f'The extrinsics file {path} holds no rigid transform; try {{"{KEY}": four rows of four}}, a '
            "rotation and a translation in metres"
        )
    return T


def write_extrinsics(path: AnyPath, T_color_depth: FloatArray) -> None:
    """Write a (4, 4) transform so that reading it gives exactly the same numbers.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(path) as sibling:
        sibling.write_text(json.dumps({KEY: T_color_depth.tolist()}, indent=1, allow_nan=False) + "\n")
