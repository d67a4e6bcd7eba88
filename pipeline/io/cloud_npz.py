"""Reader of NumPy archives with an array ``points`` and, optionally, ``colors`` and ``normals``."""

from __future__ import annotations

import io
import zipfile

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import BROKEN_ZIP, MAX_UNPACKED_BYTES, unpacked
from pipeline.io.cloud_table import COLOR, NORMAL, POSITION, check_count
from pipeline.io.numpy_files import array_in
from pipeline.types import AnyPath

_COLUMNS = {"points": POSITION, "colors": COLOR, "normals": NORMAL}


def parse_npz(path: AnyPath, data: bytes) -> np.ndarray:
    """Read the points as a structured array; nothing in the archive is executed (no pickles).

    Raises:
        InputError: the file is damaged, too large when unpacked, or its arrays are not (N, 3) numbers.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            inside = {item.filename.removesuffix(".npy"): item for item in archive.infolist()}
            if sum(item.file_size for item in inside.values()) > MAX_UNPACKED_BYTES:
                raise InputError(
                    f"The point cloud {path} unpacks to more than {MAX_UNPACKED_BYTES / 1e6:g} MB; try to "
                    "thin it"
                )
            arrays = {name: array_in(unpacked(archive, inside[name])) for name in _COLUMNS if name in inside}
    except (*BROKEN_ZIP, ValueError):
        raise InputError(
            f"The point cloud {path} is a truncated or damaged archive, or holds more than numbers; "
            "try numpy.savez(file, points=...)"
        ) from None
    if "points" not in arrays:
        raise InputError(f"The point cloud {path} has no array 'points'; try numpy.savez(file, points=...)")
    return _table(path, arrays)


def _table(path: AnyPath, arrays: dict[str, np.ndarray]) -> np.ndarray:
    count = len(np.atleast_1d(arrays["points"]))
    check_count(path, count)
    for name, array in arrays.items():
        if array.shape != (count, 3) or array.dtype.kind not in "fiu":
            raise InputError(
                f"The array '{name}' in {path} is {array.dtype} of shape {array.shape}; try "
                f"{count} x 3 numbers"
            )
    names = [(column, name) for name in arrays for column in _COLUMNS[name]]
    table = np.empty(count, [(column, arrays[name].dtype) for column, name in names])
    for name, array in arrays.items():
        for place, column in enumerate(_COLUMNS[name]):
            table[column] = array[:, place]
    return table
