"""Reading and writing of poses as text files of 4 x 4 numbers, and writing of paths in TUM's form."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, read_text
from pipeline.kernels.geometry import rigid
from pipeline.types import AnyPath, FloatArray

_log = logging.getLogger(__name__)
EXACT, NOTED, LARGEST = 1e-4, 1e-3, 1e-2
"""Largest ``departure`` from a rotation of a matrix that is kept as it is, of one that is replaced by the
nearest rotation without a note, and with a note. Recordings are orthonormal to about 5e-4."""

_BETWEEN = re.compile(r"[,;()\[\]]|\barray\b")
"""Marks between the numbers of a matrix."""
_ENDS = re.compile(r"[\n)\]]\s*\Z")
"""The end of a line or of a bracket: 12 numbers without it may be a truncated file of 16."""


def read_pose(path: AnyPath) -> FloatArray:
    """Read a (4, 4) rigid transform as ``read_pose_noted`` does, and log the note."""
    T, notes = read_pose_noted(path)
    for note in notes:
        _log.warning("%s", note)
    return T


def read_pose_noted(path: AnyPath) -> tuple[FloatArray, tuple[str, ...]]:
    """Read a (4, 4) rigid transform from a text file (``matrix_in``), and a note on its rotation.

    A matrix that is not quite a rotation is replaced by the nearest rotation (``nearest_rigid``).

    Raises:
        InputError: the file does not contain 4 x 4 or 3 x 4 numbers of a rotation and a translation.
    """
    T = _matrix_in(path)
    if not np.isfinite(T).all():
        raise InputError(
            f"The pose file {path} holds 4 x 4 numbers that are not all finite; try a pose with finite "
            "numbers, or remove the file if the pose is not known"
        )
    nearest = nearest_rigid(T)
    if nearest is None:
        raise InputError(
            f"The pose file {path} is not a rigid transform: {why_not_rigid(T)}; try a rotation and a "
            "translation in metres, with 0 0 0 1 as the last line"
        )
    return nearest, rounding_note(f"The rotation in {path}", departure(T))


def _matrix_in(path: AnyPath) -> FloatArray:
    text = read_text(path, "pose file")
    T = matrix_in(text)
    if T is None:
        counts = ", ".join(str(len(row)) for row in _rows(text)[:6]) or "0"
        raise InputError(
            f"The pose file {path} does not hold 4 x 4 numbers but lines of {counts} words; try four lines "
            "of four numbers"
        )
    return T


def matrix_in(text: str) -> FloatArray | None:
    """Return the (4, 4) matrix in a text, None if it holds none.

    It has 16 numbers, or the first 12 and then a line end, row by row: four on each line, all on one line,
    or one on each line. Commas, semicolons and brackets may be between them, as Python prints them.
    """
    rows = _rows(text)
    if len(rows) > 1 and {len(row) for row in rows} not in ({1}, {4}):
        return None
    try:
        numbers = np.array([word for row in rows for word in row], dtype=np.float64)
    except ValueError:
        return None
    if numbers.size == 12 and _ENDS.search(text):
        numbers = np.append(numbers, (0.0, 0.0, 0.0, 1.0))
    return numbers.reshape(4, 4) if numbers.size == 16 else None


def _rows(text: str) -> list[list[str]]:
    """Return the words of the lines that have any, without comments."""
    rows = (_BETWEEN.sub(" ", line.split("#")[0]).split() for line in text.splitlines())
    return [row for row in rows if row]


def departure(T: FloatArray) -> float:
    """Return how far the rotation of a (4, 4) transform is from orthonormal: the largest entry of
    |R R^T - 1|."""
    rotation = T[:3, :3]
    return float(np.abs(rotation @ rotation.T - np.eye(3)).max())


def nearest_rigid(T: FloatArray) -> FloatArray | None:
    """Return a (4, 4) transform with the nearest rotation, in the Frobenius norm, in place of its 3 x 3 part.

    A rotation that is orthonormal to ``EXACT`` is kept to the last bit. Returns None if the matrix departs
    from orthonormal by more than ``LARGEST``, mirrors, is not finite, or does not end in 0 0 0 1.
    """
    if T.shape != (4, 4) or not np.isfinite(T).all() or not np.allclose(T[3], (0, 0, 0, 1), atol=1e-6):
        return None
    rotation = T[:3, :3]
    if np.linalg.det(rotation) < 0:
        return None
    if np.allclose(rotation @ rotation.T, np.eye(3), atol=EXACT):
        return T
    if departure(T) > LARGEST:
        return None
    left, _, right = np.linalg.svd(rotation)
    return rigid(left @ right, T[:3, 3])


def rounding_note(what: str, off: float) -> tuple[str, ...]:
    """Return a note on a rotation that departs from orthonormal by more than ``NOTED``, else nothing."""
    if off <= NOTED:
        return ()
    return (f"{what} is orthonormal only to {off:.1g}; the nearest rotation was taken",)


def why_not_rigid(T: FloatArray) -> str:
    """Return in words what keeps a finite (4, 4) matrix from being a rigid transform."""
    if not np.allclose(T[3], (0, 0, 0, 1), atol=1e-6):
        last = " ".join(f"{value:g}" for value in T[3])
        transposed = np.allclose(T[:, 3], (0, 0, 0, 1), atol=1e-6)
        return f"its last line is {last}" + (", as if it were transposed" if transposed else "")
    if np.linalg.det(T[:3, :3]) < 0:
        return "it mirrors (its determinant is negative)"
    scale = float(np.cbrt(np.linalg.det(T[:3, :3])))
    if scale > 0 and departure(_unscaled(T, scale)) <= LARGEST:
        return f"it enlarges by {scale:.4g}"
    return f"its 3 x 3 part is orthonormal only to {departure(T):.2g}, not to {LARGEST:g}"


def _unscaled(T: FloatArray, scale: float) -> FloatArray:
    return rigid(T[:3, :3] / scale, T[:3, 3])


def write_pose(path: AnyPath, T: FloatArray) -> None:
    """Write a (4, 4) transform so that reading it gives exactly the same numbers.

    Raises:
        InputError: the file cannot be written.
    """
    with atomic_path(path) as sibling:
        np.savetxt(sibling, T, fmt="%.17g")


def write_tum(file: AnyPath, times_s: FloatArray, T_world_camera: Sequence[FloatArray | None]) -> None:
    """Write (4, 4) poses and their (N,) times in TUM's form; those that are None have no line."""
    lines = ["# time (s), then the camera in the world: tx ty tz (m) qx qy qz qw"]
    for time_s, T in zip(times_s, T_world_camera, strict=True):
        if T is not None:
            values = *T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()
            lines.append(f"{time_s:.6f} " + " ".join(f"{value:.9f}" for value in values))
    with atomic_path(file) as temporary:
        Path(temporary).write_text("\n".join(lines) + "\n", encoding="utf-8")
