"""The source that was made from an uploaded recording."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.sources import Recorded, RigFolder


@dataclass(frozen=True, slots=True)
class ReadRecording:
    """A rig or a recording in the session's folder, and notes on it."""

    source: RigFolder | Recorded
    notes: tuple[str, ...]
    """Notes, one sentence each."""
