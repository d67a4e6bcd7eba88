"""What people have uploaded, for all browsers of one server: each upload in a folder with a name of its own.

The name cannot be guessed. It stands in the address, so that a reload or a second tab opens the same upload;
files keep their own names in it, so that a command can name them.
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
"""How long an upload stays when the last browser that has opened it is gone."""
LIMIT_BYTES = 4 << 30
"""Of all uploads that no browser has open; the ones left longest ago go first."""
GONE = "The address names an upload that this server no longer keeps; upload it again."
OWN = "own"
"""Folder of the files of an upload as they came; with a number where there are several."""
_NAME = re.compile(rf"/({PREFIX}[\w-]{{20,}})(?=/|$)")
_FOLDER = re.compile(rf"[^\s'=]*/{PREFIX}[\w-]{{20,}}/(?:{OWN}\d*/)?")


def name_in(source: Source) -> str | None:
    """The name of the upload that a source is, or that is laid over it; None where nothing was uploaded."""
    names = _NAME.findall(" ".join(source.arguments()))
    return names[-1] if names else None


def plain(command: str) -> str:
    """A command that names uploaded files as their owner knows them, without the server's own folders."""
    return _FOLDER.sub("", command)


def keep_upload(file: viser.UploadedFile, folder: Path, limit_bytes: int, instead: str) -> Path:
    """The file where an upload is kept, in ``folder`` by its own name.

    Raises:
        InputError: it is larger than the limit; ``instead`` says what to do then.
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
    """A folder, and who has it open."""

    folder: Path
    source: Source | None = None
    """What can be opened again; until then the folder belongs to its browser alone."""
    owners: set[int] = field(default_factory=set)
    left_s: float = 0.0
    """When the last one left."""


class Uploads:
    """The folders of a server, from any thread; its owner deletes what is below ``root`` at the end."""

    def __init__(self, root: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._root, self._clock = root, clock
        self._uploads: dict[str, _Upload] = {}
        self._lock = threading.Lock()

    def new_folder(self, owner: object) -> Path:
        """An empty folder that is there as long as its owner, or longer if a source in it is kept."""
        name = PREFIX + secrets.token_urlsafe(16)
        folder = self._root / name
        folder.mkdir(mode=0o700)
        with self._lock:
            self._uploads[name] = _Upload(folder, owners={id(owner)})
        return folder

    def keep(self, source: Source, owner: object) -> None:
        """Have a source be found by its name, if any of it was uploaded; the owner has it open."""
        with self._lock:
            names = _NAME.findall(" ".join(source.arguments()))
            for name in names:
                if name in self._uploads:
                    self._uploads[name].owners.add(id(owner))
            if names and names[-1] in self._uploads:
                self._uploads[names[-1]].source = source

    def find(self, name: str) -> Source | None:
        """The source of that name; None if there is none, or no longer."""
        with self._lock:
            self._prune()
            upload = self._uploads.get(name)
            return None if upload is None else upload.source

    def leave(self, owner: object) -> None:
        """The owner is gone; what nobody could open again goes, too."""
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
