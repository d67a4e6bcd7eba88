"""Readers of points from plain numbers: NumPy arrays, and sweeps of the KITTI benchmark."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_table import POSITION, check_count
from pipeline.io.cloud_text import table_of_columns
from pipeline.io.numpy_files import array_in
from pipeline.types import AnyPath

SWEEP_ROW = np.dtype([(name, "<f4") for name in (*POSITION, "reflectance")])
FARTHEST_M = 1e5
"""Largest plausible coordinate of a sweep; larger numbers mean that the file is something else."""


def parse_npy(path: AnyPath, data: bytes) -> np.ndarray:
    """Read an array (N, 3 or more); columns after the third are interpreted as in text files.

    Raises:
        InputError: the file is damaged, or not such an array of numbers.
    """
    try:
        array = array_in(data)
    except ValueError:
        raise InputError(
            f"The point cloud {path} is a truncated or damaged array, or holds more than numbers; "
            "try numpy.save(file, points)"
        ) from None
    if array.ndim != 2 or array.shape[1] < 3 or array.dtype.kind not in "fiu":
        raise InputError(
            f"The array in {path} is {array.dtype} of shape {array.shape}; try N x 3 numbers, or N x 6 with "
            "colours or normals"
        )
    check_count(path, len(array))
    return table_of_columns(array.astype(np.float64))


def parse_sweep(path: AnyPath, data: bytes) -> np.ndarray:
    """Read a LiDAR sweep in KITTI's format: x, y, z and reflectance, four bytes each (Geiger et al. 2013).

    Raises:
        InputError: the length is no multiple of a row, or the numbers are no positions.
    """
    if not data or len(data) % SWEEP_ROW.itemsize:
        raise InputError(
            f"The point cloud {path} has {len(data)} bytes, which are no rows of four 4-byte numbers; "
            "a .bin file is read as a sweep of KITTI"
        )
    table = np.frombuffer(data, SWEEP_ROW)
    check_count(path, len(table))
    positions = np.stack([table[name] for name in POSITION])
    if not (np.abs(np.nan_to_num(positions, nan=np.inf)) < FARTHEST_M).any(axis=1).all():
        raise InputError(f"The numbers in {path} are no positions; a .bin file is read as a sweep of KITTI")
    return table
