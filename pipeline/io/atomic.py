"""Output files that are either whole or absent."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.errors import InputError


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary sibling of ``path`` to write to, renamed to ``path`` if the body succeeds.

    The sibling has the same suffix, so that libraries choose the same format; the folder is made
    when it is missing. Whatever the body raises, no partial file remains and an older ``path``
    stays as it was.

    Raises:
        InputError: the folder or the file cannot be written.
    """
    path = Path(path)
    sibling = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        sibling.touch()
        yield sibling
        sibling.replace(path)
    except OSError as error:
        raise InputError(
            f"{path} cannot be written ({error.strerror or error}); try another folder for the output"
        ) from None
    finally:
        _remove(sibling)


def _remove(sibling: Path) -> None:
    try:
        sibling.unlink(missing_ok=True)
    except OSError:
        return  # its folder does not exist, so neither does it


def writable_folder(path: str | os.PathLike[str]) -> Path:
    """``path`` as a folder that exists and takes files, so that a long run fails early or not at all.

    Raises:
        InputError: it cannot be made or written.
    """
    folder = Path(path)
    with atomic_path(folder / "probe"):
        pass
    (folder / "probe").unlink()
    return folder
