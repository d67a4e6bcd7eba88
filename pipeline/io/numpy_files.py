"""Arrays in NumPy's format, whose header is checked against what follows before anything is allocated."""

from __future__ import annotations

import io
from math import prod

import numpy as np


def array_in(data: bytes) -> np.ndarray:
    """The array that a .npy file holds; nothing in it is executed (no pickles).

    Raises:
        ValueError: no such file, a pickle, or not as many bytes as its shape says.
    """
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        shape, columns_first, kind = read(stream)
    except Exception:  # it is written as Python, which fails in more ways than can be listed
        raise ValueError("no header") from None
    here = len(data) - stream.tell()
    if kind.hasobject or min(shape, default=1) < 0 or prod(shape) * kind.itemsize != here:
        raise ValueError("not as many bytes as its shape says")
    flat = np.frombuffer(data, kind, prod(shape), stream.tell()).copy() if here else np.empty(0, kind)
    return flat.reshape(shape, order="F" if columns_first else "C")
