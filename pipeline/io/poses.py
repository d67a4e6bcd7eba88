"""Reading and writing of poses as text files of 4 x 4 numbers."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, read_text
from pipeline.types import AnyPath, FloatArray

_RIGID_TOLERANCE = 1e-4


def read_pose(path: AnyPath) -> FloatArray:
    """Read a (4, 4) rigid transform from a text file.

    Raises:
        InputError: the file does not contain sixteen numbers that form a rotation and a translation.
    """
    rows = [
        line.split("#")[0].replace(",", " ").split() for line in read_text(path, "pose file").splitlines()
    ]
    try:
        T = np.array([row for row in rows if row], dtype=np.float64)
    except ValueError:
        T = np.empty(0)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise InputError(f"The pose file {path} does not hold 4 x 4 numbers; try four lines of four numbers")
    if rigid_or_none(T) is None:
        raise InputError(
            f"The pose file {path} is not a rigid transform; try a rotation and a translation in metres, "
            "with 0 0 0 1 as the last line"
        )
    return T


def rigid_or_none(T: FloatArray) -> FloatArray | None:
    """Return ``T`` if it is a (4, 4) rotation and translation, else None."""
    if T.shape != (4, 4) or not np.isfinite(T).all():
        return None
    rotation = T[:3, :3]
    orthonormal = np.allclose(rotation @ rotation.T, np.eye(3), atol=_RIGID_TOLERANCE)
    if not orthonormal or np.linalg.det(rotation) < 0 or not np.allclose(T[3], (0, 0, 0, 1)):
        return None
    return T


def write_pose(path: AnyPath, T: FloatArray) -> None:
    """Write a (4, 4) transform so that reading it gives exactly the same numbers.

    Raises:
        InputError: the file cannot be written.
    """
    with atomic_path(path) as sibling:
        np.savetxt(sibling, T, fmt="%.17g")
