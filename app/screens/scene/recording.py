"""What an uploaded recording became."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.sources import RigFolder


@dataclass(frozen=True, slots=True)
class ReadRecording:
    """A rig in the session's folder, and what is to be said of it."""

    source: RigFolder
    notes: tuple[str, ...]
    """One sentence each."""
