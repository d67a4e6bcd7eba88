"""Reading files that strangers made: never more than a stated size, always a readable error."""

from __future__ import annotations

import os
from pathlib import Path

from pipeline.errors import InputError

MAX_TEXT_BYTES = 1_000_000
"""Intrinsics and poses."""
MAX_IMAGE_BYTES = 64_000_000
MAX_IMAGE_PIXELS = 25_000_000
MAX_GEOMETRY_BYTES = 1_000_000_000
"""Clouds and meshes."""


def read_bytes(path: str | os.PathLike[str], max_bytes: int, what: str) -> bytes:
    """The content of the file, ``what`` naming its kind in errors (``"depth image"``).

    Raises:
        InputError: the file is missing, unreadable, empty or larger than ``max_bytes``.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = file.read(max_bytes + 1)
    except FileNotFoundError:
        raise InputError(f"The {what} {path} does not exist; check the path") from None
    except OSError as error:
        raise InputError(f"The {what} {path} cannot be read ({error.strerror}); try another file") from None
    if len(data) > max_bytes:
        raise InputError(
            f"The {what} {path} is larger than the {max_bytes / 1e6:g} MB that are read; try a smaller one"
        )
    if not data:
        raise InputError(f"The {what} {path} is empty; try to copy or export it again")
    return data


def read_text(path: str | os.PathLike[str], what: str) -> str:
    """The content of a small text file.

    Raises:
        InputError: as ``read_bytes``, or it is not UTF-8 text.
    """
    try:
        return read_bytes(path, MAX_TEXT_BYTES, what).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"The {what} {path} is not a text file; check the path") from None
