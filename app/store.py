"""Results of stages by key, in a folder that the computing processes of one server share."""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import tempfile
from collections.abc import Callable, Generator, Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

Said = TypeVar("Said")

_recent: dict[str, tuple[str, Any]] = {}
"""The last result of every stage that this process had in its hands."""


@dataclass(frozen=True, slots=True)
class Store:
    """A private folder of pickled results, the oldest dropped when it grows over its limit."""

    folder: str
    limit_bytes: int = 3 << 30

    def remember(
        self,
        key: tuple[Hashable, ...],
        compute: Callable[[], Generator[Said, None, Any]],
    ) -> Generator[Said, None, Any]:
        """The result for ``key``, computed only if no process has it yet."""
        stage = str(key[0])
        name = f"{stage}-{hashlib.sha256(repr(key).encode()).hexdigest()[:24]}"
        if stage in _recent and _recent[stage][0] == name:
            return _recent[stage][1]
        path = Path(self.folder, name)
        value = _read(path)
        if value is None:
            value = yield from compute()
            self._write(path, value)
        _recent[stage] = (name, value)
        return value

    def _write(self, path: Path, value: Any) -> None:
        with contextlib.suppress(OSError):
            descriptor, temporary = tempfile.mkstemp(dir=self.folder)
            with os.fdopen(descriptor, "wb") as file:
                pickle.dump(value, file, protocol=pickle.HIGHEST_PROTOCOL)
            os.replace(temporary, path)
            self._prune(path)

    def _prune(self, newest: Path) -> None:
        files = sorted(Path(self.folder).iterdir(), key=lambda file: file.stat().st_mtime)
        excess = sum(file.stat().st_size for file in files) - self.limit_bytes
        for file in files:
            if excess <= 0 or file == newest:
                return
            excess -= file.stat().st_size
            file.unlink(missing_ok=True)


def _read(path: Path) -> Any:
    try:
        with path.open("rb") as file:
            value = pickle.load(file)
        os.utime(path)
        return value
    except (OSError, EOFError, pickle.UnpicklingError):
        return None
