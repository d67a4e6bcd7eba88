"""Uploaded files of all browsers of one server, each upload in a folder with a random name.

The name cannot be guessed. It is in the page's address, so that a reload or a second tab opens the same
upload. The files keep their own names, so that a command line can name them.
"""

from __future__ import annotations

import re
import secrets
import shutil
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, path_below
from pipeline.sources import Source

if TYPE_CHECKING:
    import viser

PREFIX = "upload-"
KEPT_S = 2 * 3600.0
"""Time that an upload is kept after the last browser that had it open has gone, seconds."""
LIMIT_BYTES = 4 << 30
"""Limit on all uploads that no browser has open; those closed longest ago are deleted first."""
GONE = "The address names an upload that this server no longer keeps; upload it again."
OWN = "own"
"""Folder for an upload's files as they were sent; with a number if there are several."""
_NAME = re.compile(rf"/({PREFIX}[\w-]{{20,}})(?=/|$)")
_FOLDER = re.compile(rf"[^\s'=]*/{PREFIX}[\w-]{{20,}}/(?:{OWN}\d*/)?")


def name_in(source: Source) -> str | None:
    """Return the name of the upload that a source is or contains; None if nothing was uploaded."""
    names = _NAME.findall(" ".join(source.arguments()))
    return names[-1] if names else None


def plain(command: str) -> str:
    """Return a text, such as a command line, without the server's folders before uploaded files' names."""
    return _FOLDER.sub("", command)


def keep_upload(file: viser.UploadedFile, folder: Path, limit_bytes: int, instead: str) -> Path:
    """Store an uploaded file in ``folder`` under its own name, without special characters; return its path.

    Raises:
        InputError: it cannot be written, or is larger than the limit; ``instead`` advises what to do then.
    """
    if len(file.content) > limit_bytes:
        raise InputError(
            f"{file.name} has {len(file.content) >> 20} MB; the app takes up to {limit_bytes >> 20} MB, so "
            f"{instead}."
        )
    last = re.split(r"[/\\]", file.name)[-1]
    name = re.sub(r"[^\w.() -]+", "-", last)[-80:].strip(". ") or "file"
    folder.mkdir(parents=True, exist_ok=True)
    path = path_below(folder, Path(name).stem + Path(name).suffix.lower())
    with atomic_path(path) as temporary:
        temporary.write_bytes(file.content)
    return path


@dataclass(slots=True, eq=False)
class _Upload:
    """An upload's folder, and the sessions that have it open."""

    folder: Path
    source: Source | None = None
    """The source that can be opened again; None while the folder belongs to one session only."""
    owners: set[int] = field(default_factory=set)
    left_s: float = 0.0
    """Time at which the last session closed it, seconds."""


class Uploads:
    """The upload folders of a server, usable on any thread; the server deletes ``root`` at its end."""

    def __init__(self, root: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._root, self._clock = root, clock
        self._uploads: dict[str, _Upload] = {}
        self._lock = threading.Lock()

    def new_folder(self, owner: object) -> Path:
        """Make an empty folder. It is kept while its owner exists, or longer if it holds a kept source."""
        name = PREFIX + secrets.token_urlsafe(16)
        folder = self._root / name
        folder.mkdir(mode=0o700)
        with self._lock:
            self._uploads[name] = _Upload(folder, owners={id(owner)})
        return folder

    def keep(self, source: Source, owner: object) -> None:
        """Make a source that was uploaded available by its name; ``owner`` has it open."""
        with self._lock:
            names = _NAME.findall(" ".join(source.arguments()))
            for name in names:
                if name in self._uploads:
                    self._uploads[name].owners.add(id(owner))
            if names and names[-1] in self._uploads:
                self._uploads[names[-1]].source = source

    def find(self, name: str) -> Source | None:
        """Return the source of this name; None if it does not exist or was deleted."""
        with self._lock:
            self._prune()
            upload = self._uploads.get(name)
            return None if upload is None else upload.source

    def leave(self, owner: object) -> None:
        """Release an owner's folders; delete those that cannot be opened again."""
        with self._lock:
            for upload in self._uploads.values():
                if id(owner) in upload.owners:
                    upload.owners.discard(id(owner))
                    upload.left_s = self._clock()
            self._prune()

    def _prune(self) -> None:
        left = {name: upload for name, upload in self._uploads.items() if not upload.owners}
        sizes = {name: _size_bytes(upload.folder) for name, upload in left.items()}
        excess = sum(sizes.values()) - LIMIT_BYTES
        for name, upload in sorted(left.items(), key=lambda one: one[1].left_s):
            old = self._clock() - upload.left_s > KEPT_S
            if upload.source is None or old or excess > 0:
                shutil.rmtree(upload.folder, ignore_errors=True)
                del self._uploads[name]
                excess -= sizes[name]


def _size_bytes(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
