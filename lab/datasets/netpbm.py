"""Reader of grey images of the Netpbm family: PGM of 8 bits, and PFM."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS, read_bytes

_HEADER = re.compile(rb"(P5|Pf)\s+(\d+)\s+(\d+)\s+(255|-?\d+(?:\.\d*)?)\s")


def read_netpbm(file: Path) -> np.ndarray:
    """Return (H, W) uint8 of a PGM file, or float32 of a PFM file; rows from the top in both cases.

    Raises:
        InputError: the file is missing, truncated, too large, or neither PGM of 8 bits nor grey PFM.
    """
    data = read_bytes(file, MAX_IMAGE_BYTES, "grey image")
    header = _HEADER.match(data)
    if header is None or (header[1] == b"P5" and header[4] != b"255"):
        raise InputError(f"The grey image {file} is no PGM of 8 bits and no PFM; try the set's own file")
    width, height, floats = int(header[2]), int(header[3]), header[1] == b"Pf"
    byte_order = "<" if float(header[4]) < 0 else ">"
    dtype = np.dtype(f"{byte_order}f4" if floats else np.uint8)
    if width * height > MAX_IMAGE_PIXELS or len(data) < header.end() + dtype.itemsize * width * height:
        raise InputError(
            f"The grey image {file} is truncated or too large for its {width} x {height} pixels; "
            "try to copy or unpack it again"
        )
    values = np.frombuffer(data, dtype, width * height, header.end()).reshape(height, width)
    return values[::-1].astype(np.float32) if floats else values
