"""The server's own folder: locked while the server lives, so that what a killed one left can be deleted."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # Windows: nothing is locked there, and nothing of others deleted
    fcntl = None  # type: ignore[assignment]

PREFIX = "packetmesh-"
LOCK = "in-use"


@dataclass(frozen=True, slots=True)
class OwnFolder:
    """A folder for as long as this process lives."""

    path: Path
    lock: IO[str]

    def delete(self) -> None:
        """Delete it with all that is in it."""
        self.lock.close()
        shutil.rmtree(self.path, ignore_errors=True)


def own_folder() -> OwnFolder:
    """A new folder; those of servers that were killed are deleted first.

    Raises:
        OSError: there is no place for it.
    """
    delete_abandoned()
    path = Path(tempfile.mkdtemp(prefix=PREFIX))
    early = path / f".{LOCK}"
    lock = early.open("w")
    if fcntl is not None:
        fcntl.flock(lock, fcntl.LOCK_EX)
    early.rename(path / LOCK)  # whoever sees it finds it locked
    return OwnFolder(path, lock)


def delete_abandoned() -> None:
    """Delete the folders of servers that live no more, as far as they are this user's."""
    for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):  # another user's, without a lock, or in use
            if fcntl is not None and not path.is_symlink():
                with (path / LOCK).open("r+") as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(path, ignore_errors=True)
