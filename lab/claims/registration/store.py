"""Results as JSON lines: one task a line, so that an interrupted run goes on where it stopped."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

from packetmesh.errors import InputError
from packetmesh.files import finite

logger = logging.getLogger(__name__)

Task = tuple[str, int]
"""Condition (or ``capture``) and room."""


class Store:
    """The results of one set-up in one file, which only ever grows.

    Args:
        folder: made when it is missing.
        key: the set-up's; another set-up has another file.

    Raises:
        InputError: the file cannot be read or written.
    """

    def __init__(self, folder: Path, key: str) -> None:
        self.path = folder / f"trials-{key}.jsonl"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self.results = self._read()
        except OSError as error:
            raise InputError(
                f"{self.path} cannot be used ({error.strerror or error}); try another folder"
            ) from None

    def add(self, task: Task, result: dict[str, Any]) -> None:
        """Append a task's result, as strict JSON (NaN becomes null), and keep it."""
        line = json.dumps(finite({"task": list(task), "result": result}), allow_nan=False) + "\n"
        with self.path.open("a", encoding="utf-8") as file:
            file.write(line)
        self.results[task] = json.loads(line)["result"]

    def _read(self) -> dict[Task, dict[str, Any]]:
        """Whole lines only; half a line at the end, left by an interruption, is cut off."""
        if not self.path.exists():
            return {}
        contents = self.path.read_bytes()
        whole = contents[: contents.rfind(b"\n") + 1]
        if len(whole) < len(contents):
            with self.path.open("r+b") as file:
                file.truncate(len(whole))
        results = {}
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                entry = json.loads(line)
                condition, room = entry["task"]
                results[str(condition), int(room)] = entry["result"]
            except (ValueError, KeyError, TypeError):
                logger.warning("%s: line %d is not a result; its task runs again", self.path, number)
        return results
