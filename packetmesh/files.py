"""File access: atomic writing, strict JSON, and reading with a size limit."""

from __future__ import annotations

import codecs
import csv
import errno
import json
import math
import os
import re
import secrets
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from packetmesh.errors import InputError

MAX_TEXT_BYTES = 1_000_000
"""Largest text file that is read where no other limit is given, such as intrinsics and poses."""
MAX_IMAGE_BYTES = 64_000_000
MAX_IMAGE_PIXELS = 25_000_000
MAX_GEOMETRY_BYTES = 1_000_000_000
"""Largest cloud or mesh file that is read."""
MAX_UNPACKED_BYTES = 1 << 30
"""Largest total size of the files in an archive, unpacked."""
BROKEN_ZIP = (
    zipfile.BadZipFile,
    NotImplementedError,  # unknown compression method
    RuntimeError,  # encrypted
    EOFError,
    OSError,
    ValueError,
    zlib.error,
)
"""Errors that reading a damaged ZIP raises."""


_UNFINISHED = re.compile(r"\..*-[0-9a-f]{8}(\..*)?")
"""Names of the temporary files of ``atomic_path``."""
_LEAVES = re.compile(r"^[/\\]|^[A-Za-z]:|(^|[/\\])\.\.([/\\]|$)|\0")
"""Parts of a name that lead out of a folder, on any system."""


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary sibling of ``path`` to write to, and rename it to ``path`` if the body succeeds.

    The sibling has the same suffix, so that libraries choose the same format. A missing folder is created.
    If the body raises, no partial file remains and an older ``path`` is unchanged.

    Raises:
        InputError: the folder or the file cannot be written, or the body raises an OSError.
    """
    path = Path(path)
    sibling = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        sibling.touch()
        yield sibling
        sibling.replace(path)
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror or error}); {remedy(error)}") from None
    finally:
        with suppress(OSError):  # its folder does not exist, so neither does the sibling
            sibling.unlink(missing_ok=True)


def path_below(folder: Path, *names: str) -> Path:
    """Join a folder with names that come from a browser, an archive or a file.

    Raises:
        InputError: a name is empty or absolute, or has ``..``, a drive or a null character; or the names
            lead to the folder itself.

    >>> path_below(Path("runs"), "node_00", "color.png").as_posix()
    'runs/node_00/color.png'
    """
    path = folder.joinpath(*names)
    if not names or path == folder or any(not name or _LEAVES.search(name) for name in names):
        raise InputError(f"{'/'.join(names)[:80]!r} does not name a file below its folder; rename it")
    return path


def delete_unfinished(folder: Path) -> None:
    """Delete temporary siblings left by killed processes, in a folder to which no other process writes."""
    for path in folder.glob(".*"):
        if path.is_file() and _UNFINISHED.fullmatch(path.name):
            path.unlink(missing_ok=True)


def writable_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder if it is missing, and test it with a probe file, so that a long run fails early.

    Raises:
        InputError: the folder cannot be created or written.
    """
    folder = Path(path)
    with atomic_path(folder / "probe"):
        pass
    (folder / "probe").unlink()
    return folder


@contextmanager
def removed_if_empty(folder: Path) -> Iterator[None]:
    """Delete a folder, and those above it, that this block created and left empty when it failed."""
    created = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        yield
    except BaseException:
        with suppress(OSError):  # not there, or not empty
            for path in created:
                path.rmdir()
        raise


def write_json(path: Path, value: Any) -> None:
    """Write ``value`` as strict JSON (NaN and infinity become null)."""
    with atomic_path(path) as temporary:
        Path(temporary).write_text(json.dumps(finite(value), indent=1, allow_nan=False) + "\n")


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a CSV file with a line per row; its columns are the keys of all rows, in order of appearance."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def file_trouble(error: OSError) -> str:
    """Return a sentence about a file that could not be written or read."""
    return f"{error.filename or 'A file'} cannot be used ({error.strerror or error}); {remedy(error)}"


def remedy(error: OSError) -> str:
    """Return the part of a sentence that says what to try when a file cannot be written."""
    full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return "delete something there, as the disk is full" if full else "try another folder"


def finite(value: Any) -> Any:
    """Return ``value`` with tuples and arrays as plain lists and non-finite numbers as None."""
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if hasattr(value, "tolist"):
        return finite(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def read_bytes(path: str | os.PathLike[str], max_bytes: int, what: str) -> bytes:
    """Return the content of a file.

    Args:
        path: the file.
        max_bytes: largest size that is accepted.
        what: kind of the file, for the error messages (``"depth image"``).

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


def read_text(path: str | os.PathLike[str], what: str, max_bytes: int | None = None) -> str:
    """Return the content of a text file of at most ``max_bytes`` (None means ``MAX_TEXT_BYTES``).

    The text is UTF-8, or UTF-16 with a byte order mark, as Windows writes it; all line ends become ``\\n``.

    Raises:
        InputError: as for ``read_bytes``, or the file has another encoding.
    """
    data = read_bytes(path, MAX_TEXT_BYTES if max_bytes is None else max_bytes, what)
    try:
        return text_in(data)
    except UnicodeDecodeError:
        raise InputError(
            f"The {what} {path} is not a text file in UTF-8; try to save it as one, or check the path"
        ) from None


def text_in(data: bytes, errors: str = "strict") -> str:
    """Decode UTF-8, or UTF-16 with a byte order mark; drop the mark, make all line ends ``\\n``.

    Raises:
        UnicodeDecodeError: ``data`` has another encoding, and ``errors`` is "strict".
    """
    marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # never the beginning of UTF-8
    text = data.decode("utf-16" if marked else "utf-8-sig", errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def unpacked(archive: zipfile.ZipFile, item: zipfile.ZipInfo) -> bytes:
    """Unpack a file in a ZIP up to its declared size only; ``ZipFile.read`` would unpack all of it.

    Raises:
        Exception: one of ``BROKEN_ZIP``.
    """
    with archive.open(item) as file:
        return file.read(item.file_size)


def read_json(path: str | os.PathLike[str], what: str) -> dict[str, Any]:
    """Return the object in a JSON file of at most ``MAX_TEXT_BYTES``.

    Raises:
        InputError: as for ``read_text``, or the text is not JSON, too deeply nested, or not an object.
    """
    return json_object(read_text(path, what), path, what)


def json_object(text: str, path: str | os.PathLike[str], what: str) -> dict[str, Any]:
    """Parse the text of a file as a JSON object; raises as ``read_json``."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"The {what} {path} is not valid JSON ({error}); try to write or export it again"
        ) from None
    if not isinstance(value, dict):
        raise InputError(f"The {what} {path} holds no JSON object, such as {{...}}; check the path")
    return value
