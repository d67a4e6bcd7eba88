"""Readers of points from plain numbers: NumPy arrays, and LiDAR sweeps of KITTI and nuScenes."""

from __future__ import annotations

import logging
from pathlib import PurePath

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_columns import log_columns, table_named, table_of_columns
from pipeline.io.cloud_table import POSITION, Layout, check_count
from pipeline.io.numpy_files import array_in
from pipeline.types import AnyPath, FloatArray

_log = logging.getLogger(__name__)

_NUMBER = np.dtype("<f4")
_KITTI, _NUSCENES = 4, 5
"""Numbers of a point: x, y, z, reflectance; or x, y, z, intensity, index of the laser's ring."""
_MOST_RINGS = 128
_LARGEST_INTENSITY = 255.0
FARTHEST_M, NEAREST_M = 1e5, 1e-30
"""Largest and least plausible magnitude of a sweep's coordinates; labels read as floats are smaller."""
_WIDEST = 50
"""An array of 3, 4 or 6 rows with more columns than this has a point in each column."""
_MIXED = 0.1
"""Two columns are alike if their distribution functions differ by less than this everywhere."""
_LEAST_ROWS = 200
"""Fewer rows do not show whether columns are alike."""


def parse_npy(path: AnyPath, data: bytes, layout: Layout) -> np.ndarray:
    """Read an array (N, 3 or more), or one with named fields; columns are interpreted as in text files.

    Raises:
        InputError: the file is damaged, not such an array of numbers, or its columns are in doubt.
    """
    try:
        array = array_in(data)
    except ValueError:
        raise InputError(
            f"The point cloud {path} is a truncated or damaged array, or holds more than numbers; "
            "try numpy.save(file, points)"
        ) from None
    if array.dtype.names and array.ndim == 1 and layout.columns is None:
        check_count(path, len(array))
        return array
    if array.ndim == 2 and array.shape[0] in (3, 4, 6) and array.shape[1] > _WIDEST:
        raise InputError(
            f"The array in {path} has {array.shape[0]} rows of {array.shape[1]} numbers, and each row should "
            "be a point; try numpy.save(file, points.T)"
        )
    if array.ndim != 2 or array.shape[1] < 3 or array.dtype.kind not in "fiu":
        raise InputError(
            f"The array in {path} is {array.dtype} of shape {array.shape}; try N x 3 numbers, or N x 6 with "
            "colours or normals"
        )
    check_count(path, len(array))
    return table_of_columns(path, array.astype(np.float64), layout.columns)


def parse_sweep(path: AnyPath, data: bytes, layout: Layout) -> np.ndarray:
    """Read a LiDAR sweep of four-byte numbers, by given columns, or as KITTI's or nuScenes' format.

    KITTI has x, y, z and reflectance (Geiger et al. 2013), nuScenes x, y, z, intensity and the index of the
    laser's ring, a whole number (Caesar et al. 2020). The file's name, or else the values tell them apart.

    Raises:
        InputError: the length is no multiple of a row, the numbers are no positions, or may be either format.
    """
    if layout.columns is not None:
        rows = _rows(path, data, len(layout.columns))
        _check_positions(path, rows[:, [layout.columns.index(name) for name in POSITION]])
        return table_named(rows, layout.columns)
    width = _width(path, data)
    rows = _rows(path, data, width)
    _check_positions(path, rows[:, :3])
    names = (*POSITION, *(["_"] * (width - 3)))
    if width == _NUSCENES:
        log_columns(path, names, ("x", "y", "z", "intensity", "ring index"))
    return table_named(rows, names)


def _width(path: AnyPath, data: bytes) -> int:
    """Return how many numbers a point has.

    Raises:
        InputError: the length fits neither format, or the numbers may be either.
    """
    size = len(data)
    fits = [width for width in (_KITTI, _NUSCENES) if size and size % (width * _NUMBER.itemsize) == 0]
    if not fits:
        raise InputError(
            f"The point cloud {path} has {size} bytes, which are no rows of four or five 4-byte numbers; "
            "a .bin file is read as a sweep of KITTI or nuScenes: try --columns if it has other columns, or "
            "copy it again if it was cut off"
        )
    named_nuscenes = str(path).lower().endswith(".pcd.bin") or PurePath(path).name.startswith("LIDAR_TOP")
    if named_nuscenes and _NUSCENES in fits:
        return _NUSCENES
    _check_positions(path, _rows(path, data, fits[0])[:, :3])
    fits = [width for width in fits if not _mixed(_rows(path, data, width))]
    if not fits:
        raise InputError(
            f"The numbers in {path} are no rows of x, y, z, reflectance (KITTI), and no rows of five numbers "
            "(nuScenes); try --columns with a name for each number of a point, such as x,y,z or x,y,z,i,_,_"
        )
    plausible = [width for width in fits if _plausible(_rows(path, data, width))]
    if fits == [_KITTI] and not named_nuscenes:
        return _KITTI
    if len(plausible) == 1:
        return plausible[0]
    raise InputError(
        f"The sweep {path} may have four numbers a point, as in KITTI, or five, as in nuScenes; try "
        "--columns x,y,z,i or --columns x,y,z,i,_, whichever is right"
    )


def _plausible(rows: FloatArray) -> bool:
    """Return whether the columns after the position are an intensity and, in rows of five, a ring index."""
    intensity = rows[:, 3]
    with np.errstate(invalid="ignore"):
        fine = bool(np.all((intensity >= 0.0) & (intensity <= _LARGEST_INTENSITY)))
        if fine and rows.shape[1] == _NUSCENES:
            ring = rows[:, 4]
            fine = bool(np.all((ring >= 0.0) & (ring < _MOST_RINGS) & (ring == np.rint(ring))))
    return fine


def _mixed(rows: FloatArray) -> bool:
    """Return whether columns two apart have alike values, as where rows are read with a wrong width."""
    if len(rows) < _LEAST_ROWS:
        return False
    from scipy.stats import ks_2samp  # takes a second to import

    return all(ks_2samp(rows[:, k], rows[:, k + 2], method="asymp").statistic < _MIXED for k in (0, 1))


def _rows(path: AnyPath, data: bytes, width: int) -> FloatArray:
    """Return the (N, width) numbers of a file.

    Raises:
        InputError: the length is no multiple of a row, or there are too many points.
    """
    if not data or len(data) % (width * _NUMBER.itemsize):
        raise InputError(
            f"The point cloud {path} has {len(data)} bytes, which are no rows of {width} 4-byte numbers; try "
            "--columns with a name for each number of a point"
        )
    check_count(path, len(data) // (width * _NUMBER.itemsize))
    with np.errstate(invalid="ignore"):
        return np.frombuffer(data, _NUMBER).reshape(-1, width).astype(np.float64)


def _check_positions(path: AnyPath, points: FloatArray) -> None:
    """Raise an InputError if a coordinate is beyond ``FARTHEST_M`` everywhere, or all are about zero."""
    if (
        not (np.abs(points) > NEAREST_M).any()
        or not (np.abs(np.nan_to_num(points, nan=np.inf)) < FARTHEST_M).any(axis=0).all()
    ):
        raise InputError(
            f"The numbers in {path} are no positions; a .bin file is read as a sweep of KITTI or nuScenes: "
            "try --columns with a name for each number of a point, or to export it as PLY"
        )
