"""The rig that was made from an uploaded recording."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.sources import RigFolder


@dataclass(frozen=True, slots=True)
class ReadRecording:
    """A rig in the session's folder, and notes on it."""

    source: RigFolder
    notes: tuple[str, ...]
    """Notes, one sentence each."""
