"""Settings of the completion network's training; without torch, so that the command line starts at once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class CompletionConfig:
    """Settings of a training; recorded in its checkpoint."""

    data: Path
    """Folder of rendered shards."""
    out: Path
    """Folder of the checkpoint and the log."""
    minutes: float = 70.0
    """Wall-clock budget."""
    learning_rate: float = 2e-3
    """Peak of the one-cycle schedule."""
    batch: int = 16
    threads: int = 1
    """Of the arithmetic; one more process draws the frames."""
    seed: int = 0
