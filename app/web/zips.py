"""Opens uploaded ZIP files, with one sentence for a broken one."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from packetmesh.errors import InputError
from packetmesh.files import BROKEN_ZIP


@contextmanager
def opened_zip(file: Path | BinaryIO, sentence: str) -> Iterator[zipfile.ZipFile]:
    """Open a ZIP file for reading.

    Raises:
        InputError: with this sentence, if the file or its content cannot be read.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            yield archive
    except InputError:
        raise
    except BROKEN_ZIP:
        raise InputError(sentence) from None
