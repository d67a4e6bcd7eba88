"""The server's temporary folder, locked while it runs, so that those of killed servers can be deleted."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # on Windows nothing is locked, and no folder of another server is deleted
    fcntl = None  # type: ignore[assignment]

PREFIX = "packetmesh-"
LOCK = "in-use"


@dataclass(frozen=True, slots=True)
class OwnFolder:
    """A folder that exists as long as this process."""

    path: Path
    lock: IO[str]
    """The open lock file; other servers delete the folder once it is closed."""

    def delete(self) -> None:
        """Delete the folder and its content."""
        self.lock.close()
        shutil.rmtree(self.path, ignore_errors=True)


def own_folder() -> OwnFolder:
    """Delete the folders of killed servers and return a new one.

    Raises:
        OSError: no folder can be made.
    """
    delete_abandoned()
    path = Path(tempfile.mkdtemp(prefix=PREFIX))
    early = path / f".{LOCK}"
    lock = early.open("w")
    if fcntl is not None:
        fcntl.flock(lock, fcntl.LOCK_EX)
    early.rename(path / LOCK)  # the lock file appears under this name already locked
    return OwnFolder(path, lock)


def delete_abandoned() -> None:
    """Delete the folders of servers that no longer run, if they belong to this user."""
    for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):  # another user's folder, without a lock, or in use
            if fcntl is not None and not path.is_symlink():
                with (path / LOCK).open("r+") as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(path, ignore_errors=True)
