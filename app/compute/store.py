"""Results stored on disk by key, in a folder that the computing processes of one server share."""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import time
import zlib
from collections.abc import Callable, Generator, Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from packetmesh.errors import InputError
from packetmesh.files import atomic_path
from pipeline.spec import Spec, StageName

Step = TypeVar("Step")

CHECKSUM_BYTES = 4
"""Length of the checksum at the start of every file: the CRC-32 of the bytes after it."""
BLOCK_BYTES = 1 << 20

_newest: dict[tuple[str, str], tuple[Path, Any]] = {}
"""By folder and stage: the file of the last result that this process used, and the result itself."""


@dataclass(frozen=True, slots=True)
class Store:
    """A private folder of pickled results; over its size limit, the least recently used ones are deleted."""

    folder: str
    limit_bytes: int = 3 << 30

    def remember(
        self,
        key: tuple[Hashable, ...],
        compute: Callable[[], Generator[Step, None, Any]],
    ) -> Generator[Step, None, Any]:
        """Return the result for ``key``; compute it only if no process has stored it yet.

        Args:
            key: the name of the stage, and all that its result depends on.
            compute: yields progress reports and returns the result.
        """
        stage, path = str(key[0]), self._path(key)
        newest, value = _newest.get((self.folder, stage), (None, None))
        if newest == path:
            return value
        value = _read(path)
        if value is None:
            value = yield from compute()
            self._write(path, value)
        _newest[self.folder, stage] = (path, value)
        return value

    def has(self, key: tuple[Hashable, ...]) -> bool:
        """Return whether a file is stored for ``key``; it may be damaged."""
        return self._path(key).exists()

    def get(self, key: tuple[Hashable, ...]) -> Any:
        """Return the result for ``key``; None if it is not stored or damaged."""
        return _read(self._path(key))

    def put(self, key: tuple[Hashable, ...], value: Any) -> None:
        """Write a result to the folder, but do not keep it in this process's memory."""
        self._write(self._path(key), value)

    def stage(self, spec: Spec, stage: StageName) -> Generator[Any, None, Any]:
        """Return the result of a stage of the chain; compute the stages before it if necessary."""
        (value,) = yield from self.stages(spec, stage)
        return value

    def stages(self, spec: Spec, *stages: StageName) -> Generator[Any, None, tuple[Any, ...]]:
        """Return the results of different stages, in order; compute the stages before them if necessary."""
        from pipeline.stages import run  # large libraries, which the server does not need

        done = yield from run(spec, self, stages)
        return tuple(one.value for one in done.values())

    def _path(self, key: tuple[Hashable, ...]) -> Path:
        return Path(self.folder, f"{key[0]}-{hashlib.sha256(repr(key).encode()).hexdigest()[:24]}")

    def _write(self, path: Path, value: Any) -> None:
        """Write a checksum and the result. If that fails, later calls compute the result again."""
        with contextlib.suppress(InputError, OSError):
            with atomic_path(path) as temporary, temporary.open("wb") as file:
                file.write(bytes(CHECKSUM_BYTES))
                summed = _Summed(file)
                pickle.dump(value, summed, protocol=pickle.HIGHEST_PROTOCOL)
                file.seek(0)
                file.write(_as_bytes(summed.checksum))
            self._prune(path)

    def _prune(self, newest: Path) -> None:
        """Delete the least recently used files until the folder fits its limit; keep the newest.

        Files dated in the future are deleted first: they were used before the clock was set back.
        """
        files, now_ns = [], time.time_ns()
        for path in Path(self.folder).iterdir():
            with contextlib.suppress(OSError):  # another process may be deleting it
                if path.is_file():
                    used_ns = path.stat().st_mtime_ns
                    files.append((used_ns <= now_ns, used_ns, path.stat().st_size, path))
        excess = sum(size for *_, size, _ in files) - self.limit_bytes
        for *_, size, path in sorted(files):
            if excess <= 0:
                return
            if path != newest:
                path.unlink(missing_ok=True)
                excess -= size


class _Summed:
    """A file that computes the checksum of the bytes written to it."""

    def __init__(self, file: BinaryIO) -> None:
        self.checksum = 0
        self._file = file

    def write(self, data: bytes) -> int:
        self.checksum = zlib.crc32(data, self.checksum)
        return self._file.write(data)


def _as_bytes(checksum: int) -> bytes:
    return checksum.to_bytes(CHECKSUM_BYTES, "little")


def _read(path: Path) -> Any:
    """Read a stored result; None if there is none or it is damaged, so that it is computed again."""
    try:
        with path.open("rb") as file:
            stored_checksum, checksum = file.read(CHECKSUM_BYTES), 0
            while block := file.read(BLOCK_BYTES):
                checksum = zlib.crc32(block, checksum)
            if stored_checksum != _as_bytes(checksum):
                return None
            file.seek(CHECKSUM_BYTES)
            value = pickle.load(file)
        os.utime(path)
        return value
    except (OSError, EOFError, pickle.UnpicklingError, AttributeError, ImportError):  # pickled by other code
        return None
